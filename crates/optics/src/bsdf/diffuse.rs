//! Lambertian reflection on the side of the normal only; the other side is black.

use super::{BsdfError, BsdfSample, Surface, factor};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Lambertian reflector.
#[derive(Clone, Debug)]
pub struct Diffuse {
    reflectance: Texture,
}

impl Diffuse {
    /// Creates the reflector; `reflectance` is in [0, 1] per channel.
    ///
    /// # Errors
    /// Fails if the reflectance lies outside [0, 1].
    pub fn new(reflectance: impl Into<Texture>) -> Result<Self, BsdfError> {
        let reflectance = factor("reflectance", reflectance)?;
        Ok(Diffuse { reflectance })
    }

    /// Returns the reflectance.
    pub fn reflectance(&self) -> &Texture {
        &self.reflectance
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let local = cosine_hemisphere_sample([u[1], u[2]]);
        let pdf = cosine_hemisphere_pdf(local);
        if s.normal.dot(toward) <= 0.0 || pdf <= 0.0 {
            return None;
        }
        let direction = Frame::from_normal(s.normal).to_world(local);
        Some(BsdfSample {
            direction,
            weight: self.reflectance.at(&s.site),
            pdf,
            delta: false,
            transmitted: false,
        })
    }

    pub(super) fn albedo(&self, s: &Surface) -> Spectrum {
        self.reflectance.at(&s.site)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        self.reflectance.at(&s.site) * self.pdf(s, toward, direction)
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        if s.normal.dot(toward) <= 0.0 {
            return 0.0;
        }
        cosine_hemisphere_pdf(DVec3::new(0.0, 0.0, s.normal.dot(direction)))
    }
}
