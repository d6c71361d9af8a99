//! A mixture of two surfaces.

use super::tint::{BsdfEvent, share};
use super::{Bsdf, BsdfError, BsdfSample, Surface, Tint, factor};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// Sum of (1 − w) times one opaque surface and w times another.
#[derive(Clone, Debug)]
pub struct BlendBsdf {
    weight: Texture,
    pair: Arc<[Bsdf; 2]>,
}

impl BlendBsdf {
    /// Creates the mixture. `weight`, a number in [0, 1], is the fraction of `second`. Both
    /// surfaces must be opaque.
    ///
    /// # Errors
    /// Fails if the weight lies outside [0, 1], or if a surface transmits light.
    pub fn new(weight: impl Into<Texture>, first: Bsdf, second: Bsdf) -> Result<Self, BsdfError> {
        let pair = [first.opaque("blendbsdf")?, second.opaque("blendbsdf")?];
        Ok(BlendBsdf {
            weight: factor("weight", weight)?,
            pair: pair.into(),
        })
    }

    pub(super) fn pair(&self) -> &[Bsdf; 2] {
        &self.pair
    }

    /// Returns both surfaces with their fractions.
    fn shares(&self, s: &Surface) -> [(&Bsdf, f64); 2] {
        let w = self.weight.number_at(&s.site);
        [(&self.pair[0], 1.0 - w), (&self.pair[1], w)]
    }

    /// Samples one of the two surfaces, chosen by its fraction. A delta direction belongs to the
    /// chosen surface alone; other directions belong to both.
    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let [(first, left), (second, share)] = self.shares(s);
        let (bsdf, share, u) = if u < share {
            (second, share, u / share)
        } else {
            (first, left, (u - share) / left)
        };
        let sample = bsdf.sample(s, toward, [u, v, w])?;
        if sample.delta {
            let pdf = share * sample.pdf;
            return Some(BsdfSample { pdf, ..sample });
        }
        let pdf = self.pdf(s, toward, sample.direction);
        (pdf > 0.0).then(|| BsdfSample {
            weight: self.eval(s, toward, sample.direction) / pdf,
            pdf,
            ..sample
        })
    }

    pub(super) fn albedo(&self, s: &Surface, toward: DVec3) -> Spectrum {
        let [a, b] = self
            .shares(s)
            .map(|(bsdf, share)| bsdf.albedo(s, toward) * share);
        a + b
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let [a, b] = self
            .shares(s)
            .map(|(bsdf, share)| bsdf.eval(s, toward, direction) * share);
        a + b
    }

    /// Returns the derivative. A delta direction belongs to the only surface that is a mirror.
    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let [(first, left), (second, right)] = self.shares(s);
        if event.delta {
            let mirror = if first.is_mirror() { first } else { second };
            return mirror.tint_derivative(tint, s, event);
        }
        let part = |bsdf: &Bsdf, share: f64| {
            let value = bsdf.eval(s, event.toward, event.direction) * share;
            value * bsdf.tint_derivative(tint, s, event)
        };
        let parts = part(first, left) + part(second, right);
        share(parts, self.eval(s, event.toward, event.direction))
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let [a, b] = self
            .shares(s)
            .map(|(bsdf, share)| bsdf.pdf(s, toward, direction) * share);
        a + b
    }
}
