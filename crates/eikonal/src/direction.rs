//! Unit vectors along vectors of any length.

use glam::DVec3;

/// Returns the unit vector along a finite `direction` that is not zero, otherwise `None`. Scaling
/// by a power of two first keeps the square of the length representable.
pub(crate) fn unit(direction: DVec3) -> Option<DVec3> {
    let (_, exponent) = libm::frexp(direction.abs().max_element());
    direction
        .map(|c| libm::scalbn(c, -exponent))
        .try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_of_any_length_have_a_unit_vector() {
        let along = DVec3::new(1.0, -2.0, 2.0);
        for length in [5e-324, 1e-200, 1e-160, 1.0, 7.3, 1e160, 1e200, 8e307] {
            let off = unit(along * length).map(|unit| unit.distance(along / 3.0));
            assert!(off.is_some_and(|off| off < 1e-15), "{length}: {off:?}");
        }
        let other = DVec3::new(0.3, 1.7, -0.9);
        assert_eq!(unit(other), other.try_normalize());
        for none in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(unit(DVec3::new(0.0, 0.0, none)), None);
        }
    }
}
