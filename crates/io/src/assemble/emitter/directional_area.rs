//! Parallel light from a flat shape.

use super::super::brightness::light;
use super::super::context::Context;
use super::super::transforms::MAX_DEFORMATION;
use super::Host;
use crate::query::Query;
use crate::scene::ObjectDescription;
use glam::{DAffine3, DMat3};
use transport::Orientation;
use transport::emitter::{Aperture, BeamProfile, Collimated, Emitter};
use transport::shape::Shape;

/// Builds a beam that leaves a rectangle or a disk along its normal; `None` after an error. The
/// radiance of Mitsuba's plugin is the irradiance of the beam: light of a single direction has no
/// radiance.
pub(super) fn directional_area(
    object: &ObjectDescription,
    host: &Host,
    context: &mut Context,
) -> Option<Emitter> {
    let mut q = Query::new(object, context.diagnostics);
    let radiance = q.spectrum("radiance");
    q.finish(&[]);
    let irradiance = light(&radiance, "radiance", object, context);
    let Some(aperture) = aperture(host) else {
        let message = "parallel light leaves a 'rectangle' with right angles or a round 'disk': \
                       use one of these, or the emitter 'area'";
        context.error_at(&object.location, message);
        return None;
    };
    Some(Collimated::with_irradiance(aperture, irradiance).into())
}

/// Returns the whole surface of a flat shape as an aperture; `None` for a shape that is curved, has
/// corners that are not right angles, or is an ellipse.
fn aperture(host: &Host) -> Option<Aperture> {
    let DAffine3 {
        matrix3: map,
        translation: center,
    } = host.frame;
    let normal = host.geometry.sample_area([0.5; 2]).normal;
    let axes = [map.x_axis, map.y_axis];
    let [x, y] = axes.map(|axis| axis.length());
    let axes = axes.map(|axis| axis.normalize());
    let (orientation, error) = Orientation::nearest(DMat3::from_cols(axes[0], axes[1], normal))?;
    let profile = match host.geometry {
        Shape::Rectangle(_) => BeamProfile::Rectangle {
            // Planted error "parallel light from half of a rectangle", found by morgana-io/io::directional_area::all_light_arrives_on_the_floor:
            // width: x,
            width: 2.0 * x,
            height: 2.0 * y,
        },
        Shape::Disk(_) if (x / y - 1.0).abs() <= MAX_DEFORMATION => BeamProfile::Disc {
            radius: (x * y).sqrt(),
        },
        _ => return None,
    };
    (error <= MAX_DEFORMATION).then(|| Aperture::oriented(center, orientation, profile))
}
