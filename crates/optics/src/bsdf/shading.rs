//! Scattering by a shading normal that is not that of the surface (docs/theory.md#shading-normals).

use super::{Bsdf, BsdfSample, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;

impl Bsdf {
    /// Draws a direction; `None` where light is absorbed or the model loses it.
    pub fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        if !self.is_shaded(s) {
            return self.sample_by_normal(s, toward, u);
        }
        if !s.is_consistent(toward) {
            return None;
        }
        let sample = self.sample_by_normal(&s.shaded(), toward, u)?;
        s.is_consistent(sample.direction).then_some(sample)
    }

    /// f̃·|cosθ| with θ the angle between `direction` and the shading normal; zero for delta events.
    pub fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        if !self.is_shaded(s) {
            self.eval_by_normal(s, toward, direction)
        } else if s.is_consistent(toward) && s.is_consistent(direction) {
            self.eval_by_normal(&s.shaded(), toward, direction)
        } else {
            Spectrum::ZERO
        }
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `direction`; zero for delta events.
    pub fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        if !self.is_shaded(s) {
            self.pdf_by_normal(s, toward, direction)
        } else if s.is_consistent(toward) && s.is_consistent(direction) {
            self.pdf_by_normal(&s.shaded(), toward, direction)
        } else {
            0.0
        }
    }

    /// [`Bsdf::sample`] for a path from an emitter, which light follows from `toward` to the direction that is drawn.
    pub fn sample_importance(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let sample = self.sample(s, toward, u)?;
        if !self.leans(s) || sample.delta && sample.transmitted {
            return Some(sample);
        }
        let weight = if sample.delta {
            // The mirror's own cosines are equal.
            // Planted error "mirrors that lean as bright for light as for views", found by morgana-transport/transport::agreement::shading::mirrors:
            // sample.weight
            sample.weight * s.cosine_ratio(sample.direction, toward)
        } else {
            self.eval_importance(s, toward, sample.direction) / sample.pdf
        };
        Some(BsdfSample { weight, ..sample })
    }

    /// [`Bsdf::eval`] for a path from an emitter, which light follows from `toward` to `direction`: by eq. (shaded importance),
    /// from the value for light that goes the other way.
    pub fn eval_importance(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        if !self.leans(s) {
            return self.eval(s, toward, direction);
        }
        let index = |v: DVec3| s.facing(v).n_near;
        let indices = index(direction) / index(toward);
        let ratio = s.cosine_ratio(direction, toward) * indices * indices;
        // Planted error "light from emitters scattered by shading normals as if they were the surface's", found by morgana-transport/transport::agreement::shading::diffuse_and_glossy:
        // self.eval(s, toward, direction) * (ratio / ratio)
        self.eval(s, direction, toward) * ratio
    }

    /// The unit normal by which it scatters light where `toward` leads to the viewer, on the side of the surface's own.
    pub fn normal(&self, s: &Surface, toward: DVec3) -> DVec3 {
        match self {
            Bsdf::NormalMap(b) => b.normal(&s.shaded(), toward),
            Bsdf::Mask(b) => b.nested().normal(s, toward),
            Bsdf::TwoSided(b) => b.normal(s, toward),
            _ => s.shading_normal,
        }
    }

    /// Whether it scatters by another normal than that of the surface.
    pub fn leans(&self, s: &Surface) -> bool {
        self.is_shaded(s) || self.turns_normals()
    }

    /// Whether it scatters by the shading normal of the surface, and this is another one.
    pub(super) fn is_shaded(&self, s: &Surface) -> bool {
        s.shading_normal != s.normal && !self.keeps_true_surface()
    }
}

impl Surface {
    /// The surface whose normal is that of shading.
    pub(super) fn shaded(&self) -> Self {
        Surface {
            normal: self.shading_normal,
            ..*self
        }
    }

    /// Whether a direction is on the same side by both normals. If not, nothing is scattered there: no light comes from below
    /// the surface.
    fn is_consistent(&self, direction: DVec3) -> bool {
        (self.normal.dot(direction) > 0.0) == (self.shading_normal.dot(direction) > 0.0)
    }

    /// |cos| of one direction over that of another, by the true normal; 0 where the other grazes.
    fn cosine_ratio(&self, direction: DVec3, toward: DVec3) -> f64 {
        let cos = self.normal.dot(toward).abs();
        if cos > 0.0 {
            self.normal.dot(direction).abs() / cos
        } else {
            0.0
        }
    }
}
