//! Conversion of transforms to affine maps, orientations and axes.

use crate::diagnostic::lints;
use crate::query::Query;
use glam::{DAffine3, DMat4, DVec3, DVec4};
use transport::Orientation;

/// Relative error of lengths that numbers rounded to four digits explain: three entries of a row,
/// each with an error of up to 5e-5, and some margin.
const ROUNDING: f64 = 2e-4;
/// Relative error of lengths above which a map is not considered a rotation.
pub(super) const MAX_DEFORMATION: f64 = 1e-2;

/// Returns the affine map of a matrix. Reports a projective matrix.
pub(super) fn affine(matrix: DMat4, name: &str, query: &mut Query) -> DAffine3 {
    let map = DAffine3::from_mat4(matrix);
    if matrix.row(3) != DVec4::W {
        query.error(name, "the last row of the matrix must be 0 0 0 1");
    }
    map
}

/// Returns the position and the orientation that `to_world` gives a `thing` which cannot be
/// deformed. Ignores the scale. Replaces a map that is nearly a rotation or a mirror by the nearest
/// one, with a warning if the error exceeds rounding. `None` after an error.
pub(super) fn pose(query: &mut Query, thing: &str) -> Option<(DVec3, Orientation)> {
    const NAME: &str = "to_world";
    let matrix = query.transform(NAME);
    let map = affine(matrix, NAME, query);
    let Some((orientation, error)) = Orientation::nearest(map.matrix3) else {
        query.error(NAME, SINGULAR);
        return None;
    };
    if error > MAX_DEFORMATION {
        let message = format!(
            "{thing} can only be rotated, mirrored and scaled evenly, but this transform changes lengths unevenly, by up to {}",
            percent(error)
        );
        query.error(NAME, message);
        return None;
    }
    if error > ROUNDING {
        let message = format!(
            "the transform changes lengths by up to {}, more than numbers rounded to four digits explain; {thing} \
             takes the nearest rotation",
            percent(error)
        );
        query.warning(lints::NOT_A_ROTATION, NAME, message);
    }
    Some((map.translation, orientation))
}

/// Message about a transform without an inverse.
const SINGULAR: &str = "the transform is singular: it flattens space";

/// Returns the position and the unit direction of local +z that `to_world` gives; `None`, with a
/// report, if it maps +z to zero.
pub(super) fn axis(query: &mut Query) -> Option<(DVec3, DVec3)> {
    const NAME: &str = "to_world";
    let matrix = query.transform(NAME);
    let map = affine(matrix, NAME, query);
    let axis = map.matrix3.z_axis.try_normalize();
    if axis.is_none() {
        query.error(NAME, SINGULAR);
    }
    axis.map(|axis| (map.translation, axis))
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}
