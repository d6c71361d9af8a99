//! Choices between refraction and reflection along a ray (docs/theory.md#connections).

/// List of the encounters of a ray with refracting interfaces at which it is reflected although
/// refraction is possible.
///
/// Encounters are counted 0, 1, 2, … along the ray. Total reflections count; interfaces that are
/// index-matched by declaration do not. A total reflection is no choice: it happens with every
/// pattern, and no pattern lists it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Pattern(u32);

impl Pattern {
    /// Pattern without reflections: the ray refracts wherever refraction is possible.
    pub const REFRACT: Pattern = Pattern(0);

    /// Number of encounters that a pattern can list. At later encounters the ray is never reflected
    /// by choice.
    pub const MAX_ENCOUNTERS: u32 = u32::BITS;

    /// Returns true if the ray is reflected at encounter `i`.
    pub fn reflects(self, i: u32) -> bool {
        i < Self::MAX_ENCOUNTERS && self.0 >> i & 1 == 1
    }

    /// Returns this pattern with a reflection at encounter `i`; `None` if `i` is not below
    /// [`Self::MAX_ENCOUNTERS`].
    pub fn with(self, i: u32) -> Option<Self> {
        (i < Self::MAX_ENCOUNTERS).then(|| Pattern(self.0 | 1 << i))
    }

    /// Returns the last encounter at which the ray is reflected; `None` if there is none.
    pub(super) fn last(self) -> Option<u32> {
        self.0.checked_ilog2()
    }

    /// Returns the number of reflections.
    pub fn reflections(self) -> u32 {
        self.0.count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_list_reflections() {
        let pattern = Pattern::REFRACT.with(0).and_then(|p| p.with(31)).unwrap();
        let listed: Vec<u32> = (0..40).filter(|&i| pattern.reflects(i)).collect();
        assert_eq!(listed, [0, 31]);
        assert_eq!(pattern.reflections(), 2);
        assert_eq!(pattern.with(31), Some(pattern));
        assert_eq!(pattern.with(32), None);
        assert_eq!(Pattern::REFRACT.reflections(), 0);
        assert_eq!(Pattern::default(), Pattern::REFRACT);
    }
}
