//! Light that photons around a vertex of a sensor path scatter towards the sensor
//! (docs/theory.md#photon-maps, docs/theory.md#previews).

use super::kernel::{Kernel, kernel_points};
use super::map::PhotonMap;
use super::photon::{Photon, PhotonSite};
use super::radii::Radii;
use crate::Spectrum;
use crate::path::Vertex;
use crate::scene::{MediumId, Scene};
use glam::DVec3;
use std::f64::consts::PI;

/// Photons of a map within radii of a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhotonsAround<'a> {
    /// Photons of the sample.
    pub map: &'a PhotonMap,
    /// Radii within which photons contribute.
    pub radii: Radii,
    /// True if the light at a vertex in a medium is smoothed over all directions: only its mean and
    /// its first moment count.
    pub smooths_directions: bool,
    /// True if the kernel at a vertex in a medium is normalised over the medium: beside a surface,
    /// photons are on one side only.
    pub is_within_medium: bool,
}

/// Factors of the light of a photon that a vertex scatters towards the sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScatteredLight {
    /// Phase function in a medium, scattering function on a surface.
    pub scattered: Spectrum,
    /// Phase function before it was smoothed, if it was.
    pub sharp: Option<Spectrum>,
    /// Kernel at the photon.
    pub kernel: f64,
    /// Part of the kernel that is bias, to second order in the radius.
    pub bias: f64,
}

impl ScatteredLight {
    /// Returns the light of a photon of a given power, for a path of a given throughput, and the
    /// part of it that is bias.
    pub(crate) fn of(&self, throughput: Spectrum, power: Spectrum) -> [Spectrum; 2] {
        let light = throughput * self.scattered * power;
        let value = light * self.kernel;
        let bias = match self.sharp {
            None => light * self.bias,
            Some(sharp) => value - throughput * sharp * power * (self.kernel - self.bias),
        };
        [value, bias]
    }
}

impl PhotonsAround<'_> {
    /// Passes the light of each photon around a vertex to `found`.
    pub(crate) fn each(
        &self,
        scene: &Scene,
        vertex: &Vertex,
        found: impl FnMut(&Photon, ScatteredLight),
    ) {
        match vertex {
            Vertex::Volume {
                x,
                direction,
                medium,
            } => self.in_medium(scene, *x, *direction, *medium, found),
            Vertex::Surface { .. } => self.on_surface(scene, vertex, found),
        }
    }

    /// Passes the light of each photon around a vertex on a surface to `found`.
    fn on_surface(
        &self,
        scene: &Scene,
        vertex: &Vertex,
        mut found: impl FnMut(&Photon, ScatteredLight),
    ) {
        let (x, kernel) = (vertex.position(), Kernel::disc(self.radii.surface));
        self.map.surface.visit(
            |bounds| bounds.nearest_distance(x) < kernel.radius(),
            |photon| {
                // Compute f̃(ω_p, −γ′) K₂.
                let Some((kernel, bias)) = kernel.between(photon.x, x) else {
                    return;
                };
                if let Some(scattered) = photon.reflected(scene, vertex) {
                    let light = ScatteredLight {
                        scattered,
                        sharp: None,
                        kernel,
                        bias,
                    };
                    found(photon, light);
                }
            },
        );
    }

    /// Passes the light of each photon around a vertex at `x` in a medium to `found`, for a sensor
    /// ray that arrives in a direction.
    fn in_medium(
        &self,
        scene: &Scene,
        x: DVec3,
        direction: DVec3,
        medium: MediumId,
        mut found: impl FnMut(&Photon, ScatteredLight),
    ) {
        let kernel = Kernel::ball(self.radii.volume);
        let smooths = self.smooths_directions;
        let cosine = || scene.medium(medium).phase.mean_cosine(x);
        let mean_cosine = if smooths { cosine() } else { None };
        let mut normalisation = None;
        self.map.volume.visit(
            |bounds| bounds.nearest_distance(x) < kernel.radius(),
            |photon| {
                if self.is_within_medium && photon.place != PhotonSite::Volume(medium) {
                    return;
                }
                // Compute p(ω_p, −γ′) K₃.
                let Some((weight, bias)) = kernel.between(photon.x, x) else {
                    return;
                };
                let factor = *normalisation.get_or_insert_with(|| {
                    // Planted error "photons missing beside walls", found by morgana-transport/transport::photons::agreement::previews_are_as_bright_at_the_rim:
                    // if false && self.is_within_medium {
                    if self.is_within_medium {
                        1.0 / share_inside(scene, x, medium, &kernel)
                    } else {
                        1.0
                    }
                });
                let exact = photon.phase(scene, direction);
                let smoothed = mean_cosine.map(|g| {
                    // The P₁ approximation of the phase function.
                    let cos = photon.direction.dot(-direction);
                    Spectrum::splat((1.0 + 3.0 * g * cos) / (4.0 * PI))
                });
                let light = ScatteredLight {
                    scattered: smoothed.unwrap_or(exact),
                    sharp: smoothed.map(|_| exact),
                    kernel: weight * factor,
                    bias: bias * factor,
                };
                found(photon, light);
            },
        );
    }
}

/// Returns the share of a kernel around `x` that lies in a medium, by points in the kernel.
fn share_inside(scene: &Scene, x: DVec3, medium: MediumId, kernel: &Kernel) -> f64 {
    let points = kernel_points();
    let is_inside = |point: &&DVec3| scene.medium_at(x + **point * kernel.radius()) == medium;
    let inside = points.iter().filter(is_inside).count();
    // The centre is inside.
    (1 + inside) as f64 / (1 + points.len()) as f64
}
