//! Check for a field of view in radians, where degrees belong.

use crate::diagnostic::lints;
use crate::scene::{ObjectDescription, Value};
use eikonal::{Aabb, Shown};
use glam::DVec3;
use std::f64::consts::PI;
use transport::scene::{Scene, SceneProblem, Subject};

/// Smallest ratio of the scene's angular size to a field of view that is probably in radians. Taken
/// as radians, the field of view is 57 times as wide, and the scene fills more than a third of it.
const MIN_RATIO: f64 = 20.0;

/// Returns a warning if the scene extends far beyond the view of a camera, and the number of
/// degrees could be an angle in radians.
pub(in super::super) fn warning(camera: &ObjectDescription, scene: &Scene) -> Option<SceneProblem> {
    let fov = camera.properties.iter().find(|p| p.name == "fov")?;
    let fov = match fov.value {
        Value::Float(fov) => fov,
        Value::Integer(fov) => fov as f64,
        _ => return None,
    };
    let objects = scene.objects().iter().map(|o| o.shape.aabb());
    let all = objects.fold(Aabb::EMPTY, Aabb::union);
    let size = angular_size(&all, scene.sensor().position()).to_degrees();
    let is_narrow = fov < PI && size > MIN_RATIO * fov;
    is_narrow.then(|| {
        SceneProblem::warning(
            lints::NARROW_VIEW,
            Subject::Sensor,
            format!(
                "the camera sees {}° of a scene that is {size:.0}° wide: 'fov' looks like radians",
                Shown(fov)
            ),
            format!(
                "'fov' is in degrees: for {} radians write {:.4}",
                Shown(fov),
                fov.to_degrees()
            ),
        )
    })
}

/// Returns the largest angle between two corners of a box, seen from a point, in radians: 0 for an
/// empty box, and a full turn from inside.
fn angular_size(region: &Aabb, eye: DVec3) -> f64 {
    if region.is_empty() {
        return 0.0;
    }
    if region.contains(eye) {
        return 2.0 * PI;
    }
    let seen = region.corners().map(|corner| corner - eye);
    let pairs = seen
        .iter()
        .flat_map(|a| seen.iter().map(|b| a.angle_between(*b)));
    pairs.fold(0.0, f64::max)
}
