//! Spot emitters.

use super::super::context::Context;
use super::super::surface_texture::{Role, texture};
use super::super::transforms::{axis, pose};
use super::{check_medium, light};
use crate::query::{Input, Query};
use crate::scene::{ObjectDescription, PluginKind};
use glam::DVec3;
use transport::emitter::{Emitter, Spot};

/// Builds a spot emitter, possibly with a texture; `None` after an error.
pub(super) fn spot(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    const TEXTURE: &str = "texture";
    let mut q = Query::new(object, context.diagnostics);
    let inside = q.child(PluginKind::Medium).cloned();
    let thrown = q.role(PluginKind::Texture, TEXTURE);
    // A texture is not rotationally symmetric: it needs an orientation.
    let (origin, axis, orientation) = match thrown {
        None => {
            let (origin, axis) = axis(&mut q)?;
            (origin, axis, None)
        }
        Some(_) => {
            let (origin, orientation) = pose(&mut q, "a spot with a texture")?;
            (origin, orientation.to_world(DVec3::Z), Some(orientation))
        }
    };
    let intensity = q.spectrum("intensity");
    let cutoff = q.float("cutoff_angle");
    let beam = q.float_within("beam_width", 0.0..=cutoff, 0.75 * cutoff);
    q.finish(&[]);
    let intensity = light(&intensity, "intensity", object, context);
    check_medium(inside, context);
    let [cutoff, beam] = [cutoff, beam].map(f64::to_radians);
    let spot = Spot::new(origin, axis, intensity, cutoff, beam);
    let (Some(thrown), Some(orientation)) = (thrown, orientation) else {
        return Some(Emitter::Spot(spot));
    };
    let input = Input::Object(thrown);
    let texture = texture(input, Role::Coefficient, object, TEXTURE, &None, context);
    let spot = spot.with_texture(orientation, texture);
    context.accept(&thrown.location, spot).map(Emitter::Spot)
}
