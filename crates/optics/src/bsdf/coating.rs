//! Dielectric layer, smooth or rough, over another surface (Weidlich and Wilkie 2007). It scatters
//! on the side of the normal only.

use super::coat::Coats;
use super::error::unbounded;
use super::microfacet::Roughness;
use super::surface::{above, reflect, refract};
use super::tint::{BsdfEvent, reciprocal, share};
use super::{Bsdf, BsdfError, BsdfSample, Surface, Tint, check_eta, factor, fresnel};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// Parameters of a layer over another surface.
#[derive(Clone, Debug)]
pub struct CoatingParameters {
    /// Refractive index of the layer, relative to the outside, > 0.
    pub eta: f64,
    /// Absorption coefficient of the layer, ≥ 0.
    pub sigma_a: Texture,
    /// Thickness of the layer in inverse units of `sigma_a`, ≥ 0.
    pub thickness: f64,
    /// Factor of the light that the layer itself reflects, in [0, 1].
    pub specular_reflectance: Texture,
    /// Facets of the layer, with isotropic roughness; `None` for a smooth layer.
    pub roughness: Option<Roughness>,
}

/// Coated surface. Light crosses a rough layer as it crosses a smooth one. Light that the layer
/// reflects back to the surface below is lost, as in Mitsuba 0.6.
#[derive(Clone, Debug)]
pub struct Coating {
    eta: f64,
    sigma_a: Texture,
    thickness: f64,
    specular_reflectance: Texture,
    facets: Option<(Roughness, Arc<Coats>)>,
    nested: Arc<Bsdf>,
}

/// Continuation in the layer of a direction outside.
struct Inside {
    /// Unit direction in the layer, in local coordinates.
    direction: DVec3,
    /// Transmittance of the interface.
    passes: f64,
}

/// Light scattered by the surface below the layer.
struct Below {
    /// Unit vector in the layer towards the viewer.
    /// Unit vector in the layer towards the light.
    toward: DVec3,
    direction: DVec3,
    /// Value of the light that leaves the layer.
    value: Spectrum,
}

impl Coating {
    /// Creates the surface. `nested` must be opaque.
    ///
    /// # Errors
    /// Fails if the index is not positive and finite, or if an absorption or thickness is negative
    /// or not finite. Fails if a reflectance lies outside [0, 1], if the roughness is anisotropic,
    /// or if the nested surface transmits light.
    pub fn new(parameters: CoatingParameters, nested: Bsdf) -> Result<Self, BsdfError> {
        let CoatingParameters {
            eta,
            sigma_a,
            thickness,
            specular_reflectance,
            roughness,
        } = parameters;
        check_eta(eta)?;
        unbounded("sigma_a", &sigma_a)?;
        unbounded("thickness", &thickness.into())?;
        let roughness = roughness.map(|r| r.isotropic("roughcoating"));
        let facets = roughness.transpose()?.map(|roughness| {
            let coats = Coats::new(eta, &roughness, false);
            (roughness, Arc::new(coats))
        });
        Ok(Coating {
            eta,
            sigma_a,
            thickness,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            facets,
            nested: Arc::new(nested.opaque("coating")?),
        })
    }

    pub(super) fn nested(&self) -> &Bsdf {
        &self.nested
    }

    pub(super) fn is_smooth(&self) -> bool {
        self.facets.is_none()
    }

    fn reflectance(&self, cos: f64) -> f64 {
        fresnel::dielectric(cos.clamp(0.0, 1.0), 1.0, self.eta).reflectance
    }

    /// Returns the transmittance of the interface at a cosine outside.
    fn passes(&self, s: &Surface, cos: f64) -> f64 {
        match &self.facets {
            None => 1.0 - self.reflectance(cos),
            Some((roughness, coats)) => coats.at(&roughness.at(s)).passes(cos),
        }
    }

    /// Refracts a direction outside into the layer. Returns `None` if no light gets through.
    fn enter(&self, s: &Surface, o: DVec3) -> Option<Inside> {
        let interface = fresnel::dielectric(o.z.clamp(0.0, 1.0), 1.0, self.eta);
        let passes = self.passes(s, o.z);
        // Use the mirror image of the refracted direction, because directions here point away from
        // the surface.
        let through = -refract(o, DVec3::Z, o.z, interface.cos_far, 1.0 / self.eta);
        let direction = through.try_normalize()?;
        (interface.reflectance < 1.0 && direction.z > 0.0).then_some(Inside { direction, passes })
    }

    /// Returns the direction outside of light that leaves along a local direction in the layer.
    fn leave(&self, inside: DVec3) -> Option<DVec3> {
        let interface = fresnel::dielectric(inside.z.clamp(0.0, 1.0), self.eta, 1.0);
        let out = -refract(inside, DVec3::Z, inside.z, interface.cos_far, self.eta);
        let out = out.try_normalize()?;
        (interface.reflectance < 1.0 && out.z > 0.0).then_some(out)
    }

    /// Returns the transmittance of the absorbing layer on the way in and out, without the
    /// interface.
    fn absorbed(&self, s: &Surface, o: DVec3, i: DVec3) -> Spectrum {
        let path = self.thickness * (1.0 / o.z + 1.0 / i.z);
        self.sigma_a.at(&s.site).map(|a| libm::exp(-a * path))
    }

    /// Returns dω inside over dω outside.
    fn compression(&self, outside: DVec3, inside: DVec3) -> f64 {
        // Planted error "light under a coating as bright as before it spread over wider angles", found by morgana-transport/transport::bsdf::physics::smooth_coatings_let_out_what_fresnel_says:
        // outside.z / inside.z
        outside.z / (self.eta * self.eta * inside.z)
    }

    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let frame = s.frame();
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let passes = self.passes(s, o.z);
        if u >= passes {
            return self.reflected(s, toward, o, [v, w]);
        }
        // Sample the surface below the layer.
        let entered = self.enter(s, o)?;
        let below = frame.to_world(entered.direction).normalize();
        let nested = self.nested.sample(s, below, [u / passes, v, w])?;
        let left = frame.to_local(nested.direction);
        // Leave the layer.
        let i = self.leave(left)?;
        let direction = frame.to_world(i).normalize();
        if nested.delta {
            let through = self.absorbed(s, entered.direction, left) * self.passes(s, i.z);
            return Some(BsdfSample {
                direction,
                weight: nested.weight * through,
                pdf: passes * nested.pdf,
                ..nested
            });
        }
        self.spread(s, toward, direction)
    }

    /// Samples the reflection of the layer itself.
    fn reflected(&self, s: &Surface, toward: DVec3, o: DVec3, u: [f64; 2]) -> Option<BsdfSample> {
        let frame = s.frame();
        let Some((roughness, _)) = &self.facets else {
            return Some(BsdfSample {
                direction: frame.to_world(reflect(o, DVec3::Z, o.z)).normalize(),
                weight: self.specular_reflectance.at(&s.site),
                pdf: self.reflectance(o.z),
                delta: true,
                transmitted: false,
            });
        };
        let h = roughness.at(s).sample_visible(o, u);
        let i = reflect(o, h, o.dot(h)).normalize();
        self.spread(s, toward, frame.to_world(i).normalize())
    }

    /// Creates the sample of a direction that both parts may have generated.
    fn spread(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Option<BsdfSample> {
        let pdf = self.pdf(s, toward, direction);
        let value = || self.eval(s, toward, direction);
        BsdfSample::reflected(direction, pdf, value)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let (layer, below) = self.parts(s, toward, direction);
        below.map_or(layer, |below| layer + below.value)
    }

    /// Returns the light scattered by the layer itself, and by the surface below.
    fn parts(&self, s: &Surface, toward: DVec3, direction: DVec3) -> (Spectrum, Option<Below>) {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return (Spectrum::ZERO, None);
        };
        let mut value = Spectrum::ZERO;
        if let Some((roughness, _)) = &self.facets {
            let facets = roughness.at(s);
            let f = self.reflectance(o.dot(h));
            let lobe = f * facets.g1(i) * facets.pdf_reflected(o, h);
            value = self.specular_reflectance.at(&s.site) * lobe;
        }
        let Some([entered, left]) = self.both(s, o, i) else {
            return (value, None);
        };
        let frame = s.frame();
        let [toward, direction] =
            [&entered, &left].map(|d| frame.to_world(d.direction).normalize());
        let through = self.absorbed(s, entered.direction, left.direction)
            * (entered.passes * left.passes * self.compression(i, left.direction));
        let below = Below {
            toward,
            direction,
            value: self.nested.eval(s, toward, direction) * through,
        };
        (value, Some(below))
    }

    /// Returns the colour `tint` of the layer or of the surface below. Returns `None` if both have
    /// this colour. Also returns `None` if both are mirrors, because both reflect light in one
    /// direction.
    pub(super) fn tint(&self, tint: Tint) -> Option<Texture> {
        let below = self.nested.tint(tint);
        match tint {
            _ if self.is_smooth() && self.nested.is_mirror() => None,
            Tint::SpecularReflectance if below.is_some() => None,
            Tint::SpecularReflectance => Some(self.specular_reflectance.clone()),
            _ => below,
        }
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let is_own = tint == Tint::SpecularReflectance;
        if event.delta {
            return match (self.is_smooth(), is_own) {
                (true, true) => reciprocal(self.specular_reflectance.at(&s.site)),
                (false, false) => self.nested.tint_derivative(tint, s, event),
                _ => Spectrum::ZERO,
            };
        }
        let (layer, below) = self.parts(s, event.toward, event.direction);
        let whole = below.as_ref().map_or(layer, |below| layer + below.value);
        if is_own {
            return share(layer, whole * self.specular_reflectance.at(&s.site));
        }
        below.map_or(Spectrum::ZERO, |below| {
            let event = BsdfEvent {
                toward: below.toward,
                direction: below.direction,
                delta: false,
            };
            share(below.value, whole) * self.nested.tint_derivative(tint, s, &event)
        })
    }

    fn both(&self, s: &Surface, o: DVec3, i: DVec3) -> Option<[Inside; 2]> {
        Some([self.enter(s, o)?, self.enter(s, i)?])
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return 0.0;
        };
        let mut pdf = 0.0;
        let passes = self.passes(s, o.z);
        if let Some((roughness, _)) = &self.facets {
            pdf += (1.0 - passes) * roughness.at(s).pdf_reflected(o, h);
        }
        let Some([entered, left]) = self.both(s, o, i) else {
            return pdf;
        };
        let frame = s.frame();
        let [below, out] = [&entered, &left].map(|d| frame.to_world(d.direction).normalize());
        pdf + passes * self.nested.pdf(s, below, out) * self.compression(i, left.direction)
    }
}
