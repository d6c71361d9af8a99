//! Scattering by a shading normal that differs from the geometric normal
//! (docs/theory.md#shading-normals).

use super::{Bsdf, BsdfSample, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;

impl Bsdf {
    /// Samples a direction; `None` if light is absorbed or the model loses it.
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

    /// Returns f̃·|cosθ|, with θ the angle between `direction` and the shading normal; zero for
    /// delta events.
    pub fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        if !self.is_shaded(s) {
            self.eval_by_normal(s, toward, direction)
        } else if s.is_consistent(toward) && s.is_consistent(direction) {
            self.eval_by_normal(&s.shaded(), toward, direction)
        } else {
            Spectrum::ZERO
        }
    }

    /// Returns the density per steradian with which [`Bsdf::sample`] generates `direction`; zero
    /// for delta events.
    pub fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        if !self.is_shaded(s) {
            self.pdf_by_normal(s, toward, direction)
        } else if s.is_consistent(toward) && s.is_consistent(direction) {
            self.pdf_by_normal(&s.shaded(), toward, direction)
        } else {
            0.0
        }
    }

    /// Samples like [`Bsdf::sample`] for a path from an emitter, along which light travels from
    /// `toward` to the sampled direction.
    pub fn sample_importance(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let sample = self.sample(s, toward, u)?;
        if !self.uses_perturbed_normal(s) || sample.delta && sample.transmitted {
            return Some(sample);
        }
        let weight = if sample.delta {
            // The two cosines to the shading normal of the mirror are equal.
            // Planted error "mirrors that lean as bright for light as for views", found by morgana-transport/transport::agreement::shading::mirrors:
            // sample.weight
            sample.weight * s.cosine_ratio(sample.direction, toward)
        } else {
            self.eval_importance(s, toward, sample.direction) / sample.pdf
        };
        Some(BsdfSample { weight, ..sample })
    }

    /// Evaluates like [`Bsdf::eval`] for a path from an emitter, along which light travels from
    /// `toward` to `direction`. By eq. (shaded importance), the value follows from the value for
    /// the reverse direction.
    pub fn eval_importance(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        if !self.uses_perturbed_normal(s) {
            return self.eval(s, toward, direction);
        }
        let index = |v: DVec3| s.facing(v).n_near;
        let indices = index(direction) / index(toward);
        let ratio = s.cosine_ratio(direction, toward) * indices * indices;
        // Planted error "light from emitters scattered by shading normals as if they were the surface's", found by morgana-transport/transport::agreement::shading::diffuse_and_glossy:
        // self.eval(s, toward, direction) * (ratio / ratio)
        self.eval(s, direction, toward) * ratio
    }

    /// Returns the unit normal for scattering where `toward` leads to the viewer, on the side of
    /// the surface normal.
    pub fn normal(&self, s: &Surface, toward: DVec3) -> DVec3 {
        match self {
            Bsdf::NormalMap(b) => b.normal(&s.shaded(), toward),
            Bsdf::Mask(b) => b.nested().normal(s, toward),
            Bsdf::TwoSided(b) => b.normal(s, toward),
            _ => s.shading_normal,
        }
    }

    /// Returns true if the bsdf scatters by a normal other than the geometric one.
    pub fn uses_perturbed_normal(&self, s: &Surface) -> bool {
        self.is_shaded(s) || self.perturbs_normals()
    }

    /// Returns true if the bsdf scatters by the shading normal of the surface, and this differs
    /// from the geometric normal.
    pub(super) fn is_shaded(&self, s: &Surface) -> bool {
        s.shading_normal != s.normal && !self.keeps_true_surface()
    }
}

impl Surface {
    /// Returns the surface with its normal replaced by the shading normal.
    pub(super) fn shaded(&self) -> Self {
        Surface {
            normal: self.shading_normal,
            ..*self
        }
    }

    /// Returns true if a direction is on the same side by both normals. Otherwise nothing is
    /// scattered there, because no light comes from below the surface.
    fn is_consistent(&self, direction: DVec3) -> bool {
        (self.normal.dot(direction) > 0.0) == (self.shading_normal.dot(direction) > 0.0)
    }

    /// Returns |cos| of `direction` over |cos| of `toward`, by the geometric normal; 0 where
    /// `toward` is grazing.
    fn cosine_ratio(&self, direction: DVec3, toward: DVec3) -> f64 {
        let cos = self.normal.dot(toward).abs();
        if cos > 0.0 {
            self.normal.dot(direction).abs() / cos
        } else {
            0.0
        }
    }
}
