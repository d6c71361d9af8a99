//! Rough interface between two dielectrics (Walter et al., "Microfacet Models for Refraction
//! through Rough Surfaces", EGSR 2007), with the local indices of the two sides.

use super::microfacet::{Microfacets, Roughness};
use super::surface::{Facing, reflect, refract};
use super::{BsdfError, BsdfSample, Surface, Tint, factor, fresnel};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Relative difference of indices up to which they count as equal; the interface then has no
/// effect. The half vector of a transmission is the difference of two vectors of this relative
/// size, so it would be mostly rounding.
const INDEX_TOLERANCE: f64 = 1e-9;

/// Rough dielectric. It samples a visible facet normal, and then reflection with the probability F,
/// the Fresnel reflectance of the facet.
///
/// Where the two indices match, samples pass straight through as delta events, and `eval` and `pdf`
/// are zero. This is the limit of ever closer indices.
#[derive(Clone, Debug)]
pub struct RoughDielectric {
    roughness: Roughness,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
}

/// Pair of directions and the facet that connects them, in the local frame of the near side.
pub(super) struct Event {
    /// Direction `toward`.
    pub o: DVec3,
    /// Direction `direction`.
    pub i: DVec3,
    /// Facet normal, h.z > 0.
    pub h: DVec3,
    /// Reflectance of the facet.
    pub f: f64,
}

impl RoughDielectric {
    /// Creates the interface with factors in [0, 1] for reflection and transmission. Physically,
    /// both are 1.
    ///
    /// # Errors
    /// Fails if a factor lies outside [0, 1].
    pub fn new(
        roughness: Roughness,
        specular_reflectance: impl Into<Texture>,
        specular_transmittance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        Ok(RoughDielectric {
            roughness,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            specular_transmittance: factor("specular_transmittance", specular_transmittance)?,
        })
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            Tint::SpecularTransmittance => Some(&self.specular_transmittance),
            _ => None,
        }
    }

    pub(super) fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let side = s.facing(toward);
        if matched(&side) {
            return Some(self.straight(s, toward));
        }
        let frame = side.frame();
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        // Sample a facet, and reflection or refraction at it.
        let facets = self.roughness.at(s);
        let h = facets.sample_visible(o, [u[1], u[2]]);
        let cos = o.dot(h).min(1.0);
        let interface = fresnel::dielectric(cos, side.n_near, side.n_far);
        let transmitted = u[0] >= interface.reflectance;
        let i = if transmitted {
            refract(o, h, cos, interface.cos_far, side.n_near / side.n_far)
        } else {
            reflect(o, h, cos)
        };
        // Facets may send light to the wrong side. This light is lost, like masked light.
        if cos <= 0.0 || transmitted != (i.z < 0.0) || i.z == 0.0 {
            return None;
        }
        let event = Event {
            o,
            i: i.normalize(),
            h,
            f: interface.reflectance,
        };
        let pdf = density(&facets, &side, &event);
        (pdf > 0.0).then(|| BsdfSample {
            direction: frame.to_world(event.i).normalize(),
            weight: self.weight(s, &facets, &event),
            pdf,
            delta: false,
            transmitted,
        })
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let side = s.facing(toward);
        event(&side, toward, direction).map_or(Spectrum::ZERO, |e| {
            let facets = self.roughness.at(s);
            self.weight(s, &facets, &e) * density(&facets, &side, &e)
        })
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let side = s.facing(toward);
        event(&side, toward, direction).map_or(0.0, |e| density(&self.roughness.at(s), &side, &e))
    }

    /// Returns the sample for matched indices.
    fn straight(&self, s: &Surface, toward: DVec3) -> BsdfSample {
        BsdfSample {
            direction: -toward,
            weight: self.specular_transmittance.at(&s.site),
            pdf: 1.0,
            delta: true,
            transmitted: true,
        }
    }

    /// Returns f̃·|cosθᵢ|/density: eqs. 20 and 21 times nᵢ²/nₒ², over `density`. Everything cancels
    /// except the shadowing on the side of the light.
    fn weight(&self, s: &Surface, facets: &Microfacets, e: &Event) -> Spectrum {
        let tint = if e.i.z > 0.0 {
            &self.specular_reflectance
        } else {
            &self.specular_transmittance
        };
        tint.at(&s.site) * facets.g1(e.i)
    }
}

/// Returns the density of visible normals, times F or 1 − F, times dω_h/dω_i (Walter et al. eqs. 14
/// and 17).
pub(super) fn density(facets: &Microfacets, side: &Facing, e: &Event) -> f64 {
    let visible = facets.d(e.h) * facets.g1_over_cos(e.o);
    if e.i.z > 0.0 {
        // The 1/(4 o·h) of the reflection cancels the o·h of the visible normals.
        return e.f * visible * 0.25;
    }
    // Compute nₒ o·h + nᵢ i·h as the length of nₒ o + nᵢ i, which is parallel to h.
    let stretch = (side.n_near * e.o + side.n_far * e.i).length_squared();
    if stretch == 0.0 {
        return 0.0;
    }
    let jacobian = side.n_far * side.n_far * e.i.dot(e.h).abs() / stretch;
    (1.0 - e.f) * visible * e.o.dot(e.h).max(0.0) * jacobian
}

/// Returns true if the indices count as equal.
pub(super) fn matched(side: &Facing) -> bool {
    (side.n_near - side.n_far).abs() <= INDEX_TOLERANCE * side.n_near
}

/// Returns the facet that sends light from `direction` to `toward`, if there is one.
pub(super) fn event(side: &Facing, toward: DVec3, direction: DVec3) -> Option<Event> {
    if matched(side) {
        return None;
    }
    let frame = side.frame();
    let (o, i) = (frame.to_local(toward), frame.to_local(direction));
    if o.z <= 0.0 || i.z == 0.0 {
        return None;
    }
    let sum = if i.z > 0.0 {
        o + i
    } else {
        side.n_near * o + side.n_far * i
    };
    let h = sum.try_normalize()?;
    let h = if h.z < 0.0 { -h } else { h };
    // Exclude facets that either direction sees from behind (χ⁺ in Walter et al. eq. 34).
    let faces = o.dot(h) > 0.0 && (i.dot(h) > 0.0) == (i.z > 0.0);
    let f = fresnel::dielectric(o.dot(h).clamp(0.0, 1.0), side.n_near, side.n_far).reflectance;
    faces.then_some(Event { o, i, h, f })
}
