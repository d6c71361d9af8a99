//! A surface whose shading normals are turned, by a map of normals or of heights (docs/theory.md#bump-and-normal-maps).

use super::tint::BsdfEvent;
use super::{Bsdf, BsdfError, BsdfSample, Surface, Tint};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// What turns the normals of a surface.
#[derive(Clone, Debug)]
pub enum NormalSource {
    /// The first three channels c of a texture: the normal is 2c − 1, of any length, in the frame of ∂x/∂u, what is across it,
    /// and the normal.
    Normals(Texture),
    /// The height of the surface above itself in scene units: the first channel of a texture, times a factor.
    Heights(Texture, f64),
}

/// Another surface with turned normals. Light that is reflected between its bumps is lost.
#[derive(Clone, Debug)]
pub struct NormalMap {
    source: NormalSource,
    flips: bool,
    shadows: bool,
    nested: Arc<Bsdf>,
}

/// Share of directions that are drawn around the normal that is not turned. Flipped normals are other ones for light than for
/// views, and either may scatter where the other does not.
const AROUND: f64 = 0.1;

impl NormalMap {
    /// `nested` must be neither null nor a smooth interface, which keep their surface. A normal that faces away from the viewer is
    /// turned by half a turn about the true one if `flips` is set; light from low directions is dimmed as bumps would dim it if
    /// `shadows` is set. Both are for views, and light that goes the other way need not find the same: mirrors, of which one
    /// direction decides the other, are neither flipped nor dimmed.
    ///
    /// # Errors
    /// A nested surface that keeps its true normal.
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

    /// The normal that a viewer sees.
    pub(super) fn normal(&self, s: &Surface, toward: DVec3) -> DVec3 {
        self.turned(s, toward).surface.shading_normal
    }

    /// See [`AROUND`].
    fn around(&self) -> f64 {
        if self.flips { AROUND } else { 0.0 }
    }

    /// The surface with the normal that a viewer sees.
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

    /// Share of light along a direction that facets of a mean slope like that of the turned normal do not shadow (A. Conty Estevez
    /// et al., "A microfacet-based shadowing function to solve the bump terminator problem", Ray Tracing Gems, 2019).
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

/// A surface whose shading normal is turned, and the cosine of the angle.
struct Turned {
    surface: Surface,
    cos: f64,
}
