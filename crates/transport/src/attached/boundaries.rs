//! Boundaries of media at which light would be discontinuous when rays move
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::IndexDerivativeError;
use crate::bsdf::Bsdf;
use crate::scene::{Object, Scene};
use crate::shape::Shape;

/// Number of probes along each parameter of a surface, which test whether it is inside another one.
const PROBES: usize = 64;

/// Checks that boundaries are closed, and that rays may graze the smooth dielectric boundaries.
/// `counted` names the option by which the image depends on the number of events of paths.
pub(super) fn check(
    scene: &Scene,
    channels: usize,
    counted: Option<&'static str>,
) -> Result<(), IndexDerivativeError> {
    let all: Vec<&Object> = scene.objects().iter().filter(|o| is_boundary(o)).collect();
    if let Some(open) = all.iter().find(|o| !o.shape.is_closed()) {
        return Err(IndexDerivativeError::Open(open.name.clone()));
    }
    for (i, glass) in all.iter().enumerate().filter(|(_, o)| is_dielectric(o)) {
        let mut others = all.iter().enumerate().filter(|(k, _)| *k != i);
        if let Some((_, other)) = others.find(|(_, o)| cross(&glass.shape, &o.shape)) {
            return Err(IndexDerivativeError::Crossing(
                glass.name.clone(),
                other.name.clone(),
            ));
        }
    }
    // A single boundary is seen along constant rays through the surroundings, or from within.
    let seen = all.iter().filter(|o| is_dielectric(o) && all.len() > 1);
    seen.clone().try_for_each(|o| check_tint(o, channels))?;
    match (seen.clone().next(), counted) {
        (Some(object), Some(what)) => {
            let name = object.name.clone();
            Err(IndexDerivativeError::Counted { name, what })
        }
        _ => Ok(()),
    }
}

/// Returns true if the object separates media.
fn is_boundary(object: &Object) -> bool {
    let sides = object.sides.filter(|s| s.interior != s.exterior);
    sides.is_some() && object.emitter.is_none()
}

fn is_dielectric(object: &Object) -> bool {
    matches!(object.bsdf, Bsdf::Dielectric(_))
}

/// Checks that all light is reflected at grazing incidence, as it passes where rays miss the
/// surface.
fn check_tint(object: &Object, channels: usize) -> Result<(), IndexDerivativeError> {
    match &object.bsdf {
        Bsdf::Dielectric(dielectric) if !dielectric.reflects_all(channels) => {
            Err(IndexDerivativeError::Tinted(object.name.clone()))
        }
        _ => Ok(()),
    }
}

/// Returns true if the surfaces of two closed shapes cross.
fn cross(a: &Shape, b: &Shape) -> bool {
    let apart = !a.aabb().overlaps(&b.aabb());
    !apart && (is_divided(a, b) || is_divided(b, a))
}

/// Returns true if a surface lies partly inside another shape.
fn is_divided(surface: &Shape, other: &Shape) -> bool {
    let at = |k: usize| (k as f64 + 0.5) / PROBES as f64;
    let point = |i: usize| {
        surface
            .sample_area([at(i % PROBES), at(i / PROBES)])
            .position
    };
    let mut inside = (0..PROBES * PROBES).map(|i| other.contains(point(i)));
    let first = inside.next();
    inside.any(|is| Some(is) != first)
}
