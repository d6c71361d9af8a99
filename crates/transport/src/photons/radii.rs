//! Radii within which photons contribute, and their decrease
//! (docs/theory.md#progressive-photon-maps).

/// Radii of one map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radii {
    /// Radius for photons in media.
    pub volume: f64,
    /// Radius for photons on surfaces.
    pub surface: f64,
}

impl Radii {
    /// Returns the radii of a sample's map, given the radius of the first map. Photons in media are
    /// merged in `in_media` dimensions.
    pub(crate) fn shrunk(first: f64, sample: u64, in_media: f64) -> Self {
        Radii {
            volume: first * shrinkage(in_media, sample),
            surface: first * shrinkage(2.0, sample),
        }
    }
}

/// Returns the radius of a sample's map, counted from 0, relative to the first one. The exponent
/// makes bias and noise of the mean decrease alike: the content r^d shrinks by (i + α)/(i + 1)
/// after sample i (Knaus and Zwicker 2011). This gives r_i^d = Γ(i + α)/(Γ(1 + α) Γ(i + 1)), i
/// counted from 1.
fn shrinkage(dimensions: f64, sample: u64) -> f64 {
    let alpha = 4.0 / (dimensions + 4.0);
    let i = sample as f64 + 1.0;
    let log = libm::lgamma(i + alpha) - libm::lgamma(1.0 + alpha) - libm::lgamma(i + 1.0);
    (log / dimensions).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_by_the_recursion() {
        for dimensions in [2.0, 3.0] {
            let alpha = 4.0 / (dimensions + 4.0);
            let mut content = 1.0;
            for sample in 0..1000 {
                let expected = f64::powf(content, 1.0 / dimensions);
                let found = shrinkage(dimensions, sample);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
                let i = sample as f64 + 1.0;
                content *= (i + alpha) / (i + 1.0);
            }
        }
    }
}
