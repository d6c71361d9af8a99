//! Surface that reflects on both sides.

use super::tint::BsdfEvent;
use super::{Bsdf, BsdfError, BsdfSample, Surface, Tint};
use crate::spectrum::Spectrum;
use glam::DVec3;
use std::sync::Arc;

/// Pair of opaque surfaces, one on the side of the normal and one on the other side.
#[derive(Clone, Debug)]
pub struct TwoSided {
    /// Surfaces on the side of the normal, and behind.
    sides: Arc<[Bsdf; 2]>,
}

impl TwoSided {
    /// Creates the surface. `front` is on the side of the normal. Both surfaces must be opaque.
    ///
    /// # Errors
    /// Fails if a surface transmits light.
    pub fn new(front: Bsdf, back: Bsdf) -> Result<Self, BsdfError> {
        let sides = [front.opaque("twosided")?, back.opaque("twosided")?];
        Ok(TwoSided {
            sides: sides.into(),
        })
    }

    /// Returns the surfaces in front and behind.
    pub fn sides(&self) -> &[Bsdf; 2] {
        &self.sides
    }

    /// Returns the surface seen from `toward`, with the normal on its side.
    pub(super) fn seen(&self, s: &Surface, toward: DVec3) -> (&Bsdf, Surface) {
        if s.normal.dot(toward) >= 0.0 {
            (&self.sides[0], *s)
        } else {
            (&self.sides[1], s.turned())
        }
    }

    pub(super) fn albedo(&self, s: &Surface, toward: DVec3) -> Spectrum {
        let (bsdf, s) = self.seen(s, toward);
        bsdf.albedo(&s, toward)
    }

    /// Returns the normal for scattering, on the side of the surface normal.
    pub(super) fn normal(&self, s: &Surface, toward: DVec3) -> DVec3 {
        let (bsdf, seen) = self.seen(s, toward);
        let normal = bsdf.normal(&seen, toward);
        if seen.is_back == s.is_back {
            normal
        } else {
            -normal
        }
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let (bsdf, s) = self.seen(s, toward);
        bsdf.sample(&s, toward, u)
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let (bsdf, s) = self.seen(s, event.toward);
        bsdf.tint_derivative(tint, &s, event)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let (bsdf, s) = self.seen(s, toward);
        bsdf.eval(&s, toward, direction)
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let (bsdf, s) = self.seen(s, toward);
        bsdf.pdf(&s, toward, direction)
    }
}
