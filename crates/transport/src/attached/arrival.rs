//! Emitted light at the ends of paths, and its derivatives by position and direction.

use crate::Spectrum;
use crate::connection_end::OnSurface;
use crate::emitter::Emitter;
use crate::scene::{MediumId, Scene};
use crate::texture::Texture;
use glam::DVec3;

/// Emitter at the end of a path.
#[derive(Clone, Copy, Debug)]
pub(super) enum Arrival {
    /// Environment, reached by leaving the scene in a unit direction.
    Sky { direction: DVec3, medium: MediumId },
    /// Panel, reached on a surface.
    Panel { on: OnSurface, medium: MediumId },
}

impl Arrival {
    /// Returns the basic radiance L_e/n² of the emitter.
    pub(super) fn light(&self, scene: &Scene, x: DVec3, direction: DVec3) -> Spectrum {
        let radiance = match self {
            Arrival::Sky { direction, .. } => scene
                .environments()
                .fold(Spectrum::ZERO, |sum, (_, e)| sum + e.radiance(*direction)),
            Arrival::Panel { on, .. } => scene
                .emitted(on, -direction)
                .map_or(Spectrum::ZERO, |(_, radiance, _)| radiance),
        };
        let n = scene.n(self.medium(), x);
        radiance / (n * n)
    }

    /// Returns the medium in which the path reaches the emitter.
    pub(super) fn medium(&self) -> MediumId {
        match self {
            Arrival::Sky { medium, .. } | Arrival::Panel { medium, .. } => *medium,
        }
    }

    /// Returns the derivatives of Σ weight × L_e over the channels, by the position and by the unit
    /// direction.
    pub(super) fn gradient(&self, scene: &Scene, weights: Spectrum) -> [DVec3; 2] {
        match self {
            Arrival::Sky { direction, .. } => {
                let gradients = scene
                    .environments()
                    .map(|(_, e)| e.gradient(*direction, weights));
                [DVec3::ZERO, gradients.flatten().sum()]
            }
            Arrival::Panel { on, .. } => [panel(scene, on, weights), DVec3::ZERO],
        }
    }
}

/// Returns the derivative of Σ weight × L_e by the position on a flat shape with linear texture
/// coordinates.
fn panel(scene: &Scene, on: &OnSurface, weights: Spectrum) -> DVec3 {
    let object = &scene.objects()[on.object];
    let emitter = object.emitter.map(|emitter| &scene.emitters()[emitter]);
    let Some(Emitter::Textured(area)) = emitter else {
        return DVec3::ZERO;
    };
    let Texture::Bitmap(bitmap) = area.texture() else {
        return DVec3::ZERO;
    };
    let by = bitmap.gradient_of(&on.site, |pixel| (pixel * weights).sum());
    let uv = |x| object.shape.inverse_area(x, on.site.primitive);
    let (x, [u, v]) = (on.site.position, uv(on.site.position));
    let slope = |axis| {
        let [u_there, v_there] = uv(x + axis);
        by.x * (u_there - u) + by.y * (v_there - v)
    };
    DVec3::from_array(DVec3::AXES.map(slope))
}
