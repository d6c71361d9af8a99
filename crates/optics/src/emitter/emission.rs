//! Rays that start at an emitter (docs/theory.md#subpaths-from-either-end).

use super::{Emitter, Surroundings, each_spot};
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::sampling::Frame;
use crate::sampling::sphere::{
    cosine_hemisphere_pdf, cosine_hemisphere_sample, uniform_sphere_pdf, uniform_sphere_sample,
};
use crate::shape::Shape;
use glam::DVec3;

/// Randomly sampled ray of light: the first ray of a light subpath.
///
/// Sampling has two steps, like a connection to the emitter: an end, then a ray that leaves from
/// the end. The subpath starts with the power `emitted`/(`end_pdf` · `pdf` · probability of the
/// emitter). No refractive index enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// End of the path, as a connection to the emitter samples it.
    pub end: ConnectionEnd,
    /// Density of the end: per unit area on a surface or an aperture, per unit volume, per
    /// steradian for an environment, 1 if there is no choice.
    pub end_pdf: f64,
    /// Position where the light starts.
    pub x: DVec3,
    /// Unit direction in which the light leaves.
    pub direction: DVec3,
    /// Density of the ray, given the end: per steradian from a point, per unit area across the
    /// direction for parallel light.
    pub pdf: f64,
    /// Value of [`Emitter::emitted`] for this ray; not zero.
    pub emitted: Spectrum,
}

impl Emitter {
    /// Samples a ray of light. `shape` returns the shape of an object, and `u` is uniform in [0,
    /// 1)⁴. The first two numbers choose the end as in [`Emitter::sample_end`]. Returns `None` if
    /// no light leaves along the sampled ray.
    pub fn emit<'a>(
        &self,
        around: &Surroundings,
        shape: impl Fn(usize) -> &'a Shape,
        [u0, u1, u2, u3]: [f64; 4],
    ) -> Option<Emission> {
        let sampled = self.sample_end(around, shape, [u0, u1]);
        let (x, direction) = match sampled.end {
            ConnectionEnd::Point { position, surface } => {
                (position, self.direction_from(position, surface, [u2, u3]))
            }
            ConnectionEnd::Plane { direction, .. } => (
                self.start_of_parallel(around, direction, [u2, u3]),
                direction,
            ),
        };
        let pdf = self.pdf_emit(around, &sampled.end, x, direction);
        let emitted = self.emitted(&sampled.end, x, direction);
        (pdf > 0.0 && !emitted.is_zero()).then_some(Emission {
            end: sampled.end,
            end_pdf: sampled.pdf,
            x,
            direction,
            pdf,
            emitted,
        })
    }

    /// Returns the density with which [`Emitter::emit`], given the end, samples the ray that leaves
    /// `x` in the unit `direction`. It is per steradian from a point, and per unit area across the
    /// direction for parallel light. It is zero for rays that are never sampled.
    pub fn pdf_emit(
        &self,
        around: &Surroundings,
        end: &ConnectionEnd,
        x: DVec3,
        direction: DVec3,
    ) -> f64 {
        each_spot!(self, e => e.pdf(direction), {
            Emitter::Point { .. } | Emitter::Volume(_) => uniform_sphere_pdf(),
            Emitter::PointOnFace(point) => point.pdf(end.position().unwrap_or(x), direction),
            Emitter::Area { .. } | Emitter::Textured(_) => match end {
                ConnectionEnd::Point {
                    surface: Some(on), ..
                } => cosine_hemisphere_pdf(DVec3::Z * on.normal.dot(direction)),
                _ => 0.0,
            },
            Emitter::Collimated(beam) => beam.aperture().pdf(x),
            Emitter::Fiber(fiber) => fiber.pdf(x, direction),
            Emitter::Directional { .. } | Emitter::Environment(_) => around.disc_pdf(direction, x),
        })
    }

    /// Samples the direction in which light leaves a point, which may lie on an object with a
    /// normal.
    fn direction_from(&self, position: DVec3, surface: Option<OnSurface>, u: [f64; 2]) -> DVec3 {
        each_spot!(self, e => e.sample(u), {
            Emitter::Fiber(fiber) => fiber.sample(position, u),
            Emitter::PointOnFace(point) => point.sample(position, u),
            _ => match surface {
                Some(on) => Frame::from_normal(on.normal)
                    .to_world(cosine_hemisphere_sample(u))
                    .normalize(),
                None => uniform_sphere_sample(u),
            },
        })
    }

    /// Samples the start of a ray of light parallel to `direction`.
    fn start_of_parallel(&self, around: &Surroundings, direction: DVec3, u: [f64; 2]) -> DVec3 {
        match self {
            Emitter::Collimated(beam) => beam.aperture().sample(u),
            _ => around.disc(direction, u),
        }
    }
}
