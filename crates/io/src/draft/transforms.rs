//! Maps in transforms. Impossible maps are refused with a message.

use crate::diagnostic::Diagnostics;
use crate::diagnostic::difference::ROTATE;
use glam::{DMat3, DMat4, DVec3};

/// Returns a scale by three factors; none may be zero.
pub(crate) fn scale(factors: DVec3) -> Result<DMat4, String> {
    let volume = factors.x * factors.y * factors.z;
    if factors.min_element() == 0.0 || volume == 0.0 {
        Err("a scale of zero cannot be undone".into())
    } else {
        Ok(DMat4::from_scale(factors))
    }
}

/// Maximum deviation from 1 of the length of an axis that counts as a unit vector.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Returns a rotation around an axis of any length, with the angle in degrees. Notes a difference
/// if the length is not 1, because Mitsuba then computes another map.
pub(crate) fn rotate(
    axis: DVec3,
    degrees: f64,
    diagnostics: &mut Diagnostics,
) -> Result<DMat4, String> {
    let length = axis.length();
    let axis = axis.try_normalize();
    let axis = axis.ok_or("the axis of a rotation must not be zero")?;
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        diagnostics.differ(ROTATE);
    }
    Ok(DMat4::from_axis_angle(axis, degrees.to_radians()))
}

/// Advice for a view that [`look_at`] refuses.
pub(crate) const VIEW: &str =
    "'target' must differ from 'origin', and 'up' must not be parallel to the view";

/// Returns the map from camera to world: the camera looks along +z, with y up and x to the left. If
/// `up` is zero, the function chooses it.
pub(crate) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Result<DMat4, String> {
    transport::sensor::look_at(origin, target, up)
        .map(DMat4::from)
        .ok_or_else(|| "'origin', 'target' and 'up' do not define a direction of view".into())
}

/// Returns a matrix of 16 numbers row by row, or of 9 numbers for its linear part.
pub(crate) fn matrix(rows: &[f64]) -> Result<DMat4, String> {
    let matrix = if let Ok(rows) = <[f64; 16]>::try_from(rows) {
        DMat4::from_cols_array(&rows).transpose()
    } else if let Ok(rows) = <[f64; 9]>::try_from(rows) {
        DMat4::from_mat3(DMat3::from_cols_array(&rows).transpose())
    } else {
        let message = format!(
            "expected 9 or 16 numbers (row by row), found {}",
            rows.len()
        );
        return Err(message);
    };
    let determinant = matrix.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        Err("the matrix cannot be inverted".into())
    } else {
        Ok(matrix)
    }
}
