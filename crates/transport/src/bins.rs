//! Equal bins of a quantity.

/// Equal bins from `min` to `max`. Users require [valid](Bins::is_valid) ones.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bins {
    /// Lower edge of the first bin; finite.
    pub min: f64,
    /// Upper edge of the last bin; finite, and above `min`.
    pub max: f64,
    /// Number of bins, at least one.
    pub count: usize,
}

impl Bins {
    /// Returns true if the range from `min` to `max` is positive and finite, and there is at least
    /// one bin.
    pub fn is_valid(&self) -> bool {
        let width = self.max - self.min;
        width > 0.0 && width.is_finite() && self.count > 0
    }

    /// Returns the index of a value's bin. The last bin includes its upper edge.
    pub fn index(&self, value: f64) -> Option<usize> {
        if !(self.min..=self.max).contains(&value) {
            return None;
        }
        let position = (value - self.min) / (self.max - self.min) * self.count as f64;
        Some((position as usize).min(self.count - 1))
    }

    /// Returns the width of a bin.
    pub fn width(&self) -> f64 {
        (self.max - self.min) / self.count as f64
    }

    /// Returns the edges of all bins, one more than the number of bins.
    pub fn edges(&self) -> Vec<f64> {
        let edge = |i: usize| self.min + (self.max - self.min) * i as f64 / self.count as f64;
        (0..=self.count).map(edge).collect()
    }

    /// Returns the bin edges inside the open interval (a, b).
    pub(crate) fn edges_between(&self, a: f64, b: f64) -> impl Iterator<Item = f64> + '_ {
        let width = self.width();
        let first = ((a - self.min) / width).floor().max(0.0);
        let last = ((b - self.min) / width).ceil().min(self.count as f64);
        let edges =
            (first as usize..=last.max(0.0) as usize).map(move |i| self.min + width * i as f64);
        edges.filter(move |edge| *edge > a && *edge < b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_valid_if_values_fall_into_them() {
        let valid = |min, max, count| Bins { min, max, count }.is_valid();
        assert!(valid(-1.0, 1.0, 1));
        for (min, max) in [
            (1.0, 1.0),
            (1.0, -1.0),
            (f64::NAN, 1.0),
            (0.0, f64::NAN),
            (f64::NEG_INFINITY, 1.0),
            (0.0, f64::INFINITY),
            (-f64::MAX, f64::MAX),
        ] {
            assert!(!valid(min, max, 2), "{min} {max}");
        }
        assert!(!valid(-1.0, 1.0, 0));
    }

    #[test]
    fn every_value_has_its_bin() {
        let bins = Bins {
            min: -1.0,
            max: 1.0,
            count: 4,
        };
        assert_eq!(bins.edges(), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        let found = [-1.1, -1.0, -0.6, 0.0, 0.99, 1.0, 1.01, f64::NAN].map(|v| bins.index(v));
        let expected = [
            None,
            Some(0),
            Some(0),
            Some(2),
            Some(3),
            Some(3),
            None,
            None,
        ];
        assert_eq!(found, expected);
        let between = |a, b| bins.edges_between(a, b).collect::<Vec<_>>();
        assert_eq!(between(-0.7, 0.2), [-0.5, 0.0]);
        assert_eq!(between(-9.0, 9.0), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert!(between(0.1, 0.2).is_empty() && between(3.0, 4.0).is_empty());
    }
}
