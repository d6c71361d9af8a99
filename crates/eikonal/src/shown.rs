//! Numbers in messages.

use glam::DVec3;
use std::fmt;

/// Magnitudes that are short when written with all digits.
const DECIMAL_MAGNITUDES: std::ops::Range<f64> = 1e-5..1e16;

/// Displays a number, or the components of a vector, with all its digits, and with an exponent
/// where it would otherwise need hundreds of zeros.
#[derive(Clone, Copy, Debug)]
pub struct Shown<T>(pub T);

impl Shown<f64> {
    /// Returns the number rounded to six significant digits.
    pub fn rounded(number: f64) -> Self {
        Shown(format!("{number:.5e}").parse().unwrap_or(number))
    }
}

impl fmt::Display for Shown<f64> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let v = self.0;
        if v == 0.0 || !v.is_finite() || DECIMAL_MAGNITUDES.contains(&v.abs()) {
            write!(f, "{v}")
        } else {
            write!(f, "{v:e}")
        }
    }
}

impl fmt::Display for Shown<DVec3> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.to_array().map(Shown);
        write!(f, "[{x}, {y}, {z}]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_exact() {
        let cases = [
            (-1.0, "-1"),
            (0.1, "0.1"),
            (-0.0, "-0"),
            (f64::MAX, "1.7976931348623157e308"),
            (-1e-300, "-1e-300"),
            (f64::NAN, "NaN"),
        ];
        assert_eq!(Shown::rounded(2.0 / 3e-7).to_string(), "6666670");
        for (number, text) in cases {
            assert_eq!(Shown(number).to_string(), text);
        }
        assert_eq!(
            Shown(DVec3::new(0.0, 1e20, -0.5)).to_string(),
            "[0, 1e20, -0.5]"
        );
    }
}
