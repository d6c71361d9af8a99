//! Surface with shading normals perturbed by a map of normals or of heights
//! (docs/theory.md#bump-and-normal-maps).

use super::tint::BsdfEvent;
use super::{Bsdf, BsdfError, BsdfSample, Surface, Tint};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// Source of the perturbed normals.
#[derive(Clone, Debug)]
pub enum NormalSource {
    /// Texture with the normal in its first three channels c: the normal is 2c − 1, of any length.
    /// Its frame consists of ∂x/∂u, the tangent across it, and the normal of the surface.
    Normals(Texture),
    /// Texture with the height of the bumps in its first channel, times a factor. The product is in
    /// scene units.
    Heights(Texture, f64),
}

/// Surface with perturbed normals. Light that is reflected between bumps is lost.
#[derive(Clone, Debug)]
pub struct NormalMap {
    source: NormalSource,
    flips: bool,
    shadows: bool,
    nested: Arc<Bsdf>,
}

/// Fraction of directions sampled around the unperturbed normal, if normals are flipped. A flipped
/// normal depends on the viewing direction, so the reverse path may have another normal. It may
/// then scatter where this path does not.
const UNPERTURBED_FRACTION: f64 = 0.1;

impl NormalMap {
    /// Creates the map over `nested`, which must be neither null nor a smooth interface, because
    /// these ignore shading normals. If `flips` is set, a normal that faces away from the viewer is
    /// rotated by half a turn about the surface normal. If `shadows` is set, light from low
    /// directions is dimmed to account for shadows of bumps. Both depend on the viewing direction,
    /// so the reverse path may be scattered differently. Mirrors are neither flipped nor dimmed,
    /// because for them one direction determines the other.
    ///
    /// # Errors
    /// Fails if the nested surface ignores shading normals.
    pub fn new(
        source: NormalSource,
        flips: bool,
        shadows: bool,
        nested: Bsdf,
    ) -> Result<Self, BsdfError> {
        if nested.keeps_true_surface() {
            return Err(BsdfError::TrueSurface);
        }
        Ok(NormalMap {
            source,
            flips: flips && !nested.is_mirror(),
            shadows,
            nested: Arc::new(nested),
        })
    }

    pub(super) fn nested(&self) -> &Bsdf {
        &self.nested
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let around = self.around();
        if u[0] < around {
            let local = cosine_hemisphere_sample([u[1], u[2]]);
            let normal = s.facing(toward).normal;
            let direction = Frame::from_normal(normal).to_world(local);
            let pdf = self.pdf(s, toward, direction);
            return BsdfSample::reflected(direction, pdf, || self.eval(s, toward, direction));
        }
        let turned = self.turned(s, toward);
        let rest = (u[0] - around) / (1.0 - around);
        let nested = self
            .nested
            .sample(&turned.surface, toward, [rest, u[1], u[2]])?;
        if nested.delta {
            return Some(nested);
        }
        let weight = nested.weight * self.unshadowed(&turned, nested.direction);
        let pdf = self.pdf(s, toward, nested.direction);
        Some(BsdfSample {
            weight: weight * (nested.pdf / pdf),
            pdf,
            ..nested
        })
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let turned = self.turned(s, toward);
        self.nested.eval(&turned.surface, toward, direction) * self.unshadowed(&turned, direction)
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        if event.delta {
            return self.nested.tint_derivative(tint, s, event);
        }
        let turned = self.turned(s, event.toward);
        self.nested.tint_derivative(tint, &turned.surface, event)
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let around = self.around();
        let turned = self.turned(s, toward);
        let by_nested = self.nested.pdf(&turned.surface, toward, direction);
        let cos = s.facing(toward).normal.dot(direction);
        let by_chance = cosine_hemisphere_pdf(DVec3::new(0.0, 0.0, cos));
        (1.0 - around) * by_nested + around * by_chance
    }

    /// Returns the normal for a viewing direction.
    pub(super) fn normal(&self, s: &Surface, toward: DVec3) -> DVec3 {
        self.turned(s, toward).surface.shading_normal
    }

    /// Returns the fraction [`UNPERTURBED_FRACTION`], or 0 if normals are not flipped.
    fn around(&self) -> f64 {
        if self.flips {
            UNPERTURBED_FRACTION
        } else {
            0.0
        }
    }

    /// Returns the surface with the normal for a viewing direction.
    fn turned(&self, s: &Surface, toward: DVec3) -> Turned {
        let frame = s.frame();
        let mut normal = match &self.source {
            NormalSource::Normals(map) => {
                let Spectrum([x, y, z, _]) = map.at(&s.site);
                DVec3::new(x, y, z) * 2.0 - 1.0
            }
            NormalSource::Heights(map, scale) => {
                let slopes = map.gradient_at(&s.site) * *scale;
                let lifted =
                    |t: DVec3, slope: f64| t.reject_from_normalized(s.normal) + s.normal * slope;
                let [u, v] = [0, 1].map(|k| lifted(s.tangents[k], slopes[k]));
                let across = u.cross(v);
                frame.to_local(across * s.normal.dot(across).signum())
            }
        };
        normal = normal.try_normalize().unwrap_or(DVec3::Z);
        let view = frame.to_local(toward);
        if self.flips && view.z * view.dot(normal) <= 0.0 {
            normal = DVec3::new(-normal.x, -normal.y, normal.z);
        }
        Turned {
            surface: Surface {
                shading_normal: frame.to_world(normal).normalize(),
                ..*s
            },
            cos: normal.z,
        }
    }

    /// Returns the fraction of light along a direction that is not shadowed by facets with the mean
    /// slope of the perturbed normal (A. Conty Estevez et al., "A microfacet-based shadowing
    /// function to solve the bump terminator problem", Ray Tracing Gems, 2019).
    fn unshadowed(&self, turned: &Turned, direction: DVec3) -> f64 {
        if !self.shadows {
            return 1.0;
        }
        let tan2 = |cos: f64| (1.0 - cos * cos).max(0.0) / (cos * cos).max(f64::MIN_POSITIVE);
        let alpha2 = (tan2(turned.cos) / 8.0).min(1.0);
        let cos = turned.surface.normal.dot(direction);
        2.0 / (1.0 + (1.0 + alpha2 * tan2(cos)).sqrt())
    }
}

/// Surface with a perturbed shading normal, and the cosine of the angle of perturbation.
struct Turned {
    surface: Surface,
    cos: f64,
}
