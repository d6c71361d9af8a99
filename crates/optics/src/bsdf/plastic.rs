//! Diffuse base under a smooth dielectric coat. It reflects on the side of the normal only.

use super::surface::reflect;
use super::tint::{BsdfEvent, reciprocal};
use super::{BsdfError, BsdfSample, Surface, Tint, check_eta, factor, fresnel};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Smooth plastic, as Mitsuba's `plastic`.
#[derive(Clone, Debug)]
pub struct Plastic {
    eta: f64,
    specular_reflectance: Texture,
    base: Base,
    /// Mean reflectance of the coat from below.
    from_below: f64,
}

/// Diffuse base under a coat.
#[derive(Clone, Debug)]
pub(super) struct Base {
    pub(super) reflectance: Texture,
    nonlinear: bool,
    /// Factor 1/η².
    shrink: f64,
}

impl Base {
    /// Creates the base; `eta` is the index of the coat relative to the outside.
    pub(super) fn new(
        eta: f64,
        reflectance: impl Into<Texture>,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        Ok(Base {
            reflectance: factor("diffuse_reflectance", reflectance)?,
            nonlinear,
            shrink: 1.0 / (eta * eta),
        })
    }

    /// Returns π times the value of the base, without the transmittances of the coat on the way in
    /// and out. `back` is the mean reflectance of the coat from below. Light is reflected
    /// repeatedly between base and coat. With `nonlinear`, each reflection multiplies it by the
    /// colour of the base; otherwise the colour applies once.
    pub(super) fn value(&self, s: &Surface, back: f64) -> Spectrum {
        let returned = |r: f64| if self.nonlinear { r * back } else { back };
        let reflectance = self.reflectance.at(&s.site);
        reflectance.map(|r| r * self.shrink / (1.0 - returned(r)))
    }

    /// Returns the derivative of the logarithm of [`Base::value`] with respect to the colour.
    pub(super) fn derivative(&self, s: &Surface, back: f64) -> Spectrum {
        let reflectance = self.reflectance.at(&s.site);
        if self.nonlinear {
            // Planted error "derivatives by colours of bases as if none of their light came back to them", found by morgana-transport/transport::derivatives::colours::a_base_below_a_coat_deepens_with_its_colour:
            // reciprocal(reflectance)
            reciprocal(reflectance.map(|r| r * (1.0 - r * back)))
        } else {
            reciprocal(reflectance)
        }
    }
}

impl Plastic {
    /// Creates the surface. `eta` > 0 is the index of the coat relative to the outside; the
    /// reflectances are in [0, 1]. With `nonlinear`, each reflection below the coat deepens the
    /// colour.
    ///
    /// # Errors
    /// Fails if the index is not positive and finite, or if a reflectance lies outside [0, 1].
    pub fn new(
        eta: f64,
        diffuse_reflectance: impl Into<Texture>,
        specular_reflectance: impl Into<Texture>,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        check_eta(eta)?;
        Ok(Plastic {
            eta,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            base: Base::new(eta, diffuse_reflectance, nonlinear)?,
            from_below: fresnel::mean(eta, 1.0),
        })
    }

    fn coat(&self, cos: f64) -> f64 {
        fresnel::dielectric(cos.clamp(0.0, 1.0), 1.0, self.eta).reflectance
    }

    /// Samples the coat with probability F, otherwise the base.
    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let cos = s.normal.dot(toward);
        if cos <= 0.0 {
            return None;
        }
        let f = self.coat(cos);
        if u < f {
            return Some(BsdfSample {
                direction: reflect(toward, s.normal, cos).normalize(),
                weight: self.specular_reflectance.at(&s.site),
                pdf: f,
                delta: true,
                transmitted: false,
            });
        }
        let local = cosine_hemisphere_sample([v, w]);
        let pdf = (1.0 - f) * cosine_hemisphere_pdf(local);
        (pdf > 0.0).then(|| BsdfSample {
            direction: Frame::from_normal(s.normal).to_world(local),
            weight: self.base.value(s, self.from_below) * (1.0 - self.coat(local.z)),
            pdf,
            delta: false,
            transmitted: false,
        })
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::DiffuseReflectance => Some(&self.base.reflectance),
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            _ => None,
        }
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        match (tint, event.delta) {
            (Tint::SpecularReflectance, true) => reciprocal(self.specular_reflectance.at(&s.site)),
            (Tint::DiffuseReflectance, false) => self.base.derivative(s, self.from_below),
            _ => Spectrum::ZERO,
        }
    }

    pub(super) fn albedo(&self, s: &Surface) -> Spectrum {
        self.base.reflectance.at(&s.site)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let leaves = 1.0 - self.coat(s.normal.dot(direction));
        self.base.value(s, self.from_below) * (leaves * self.pdf(s, toward, direction))
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let cos = s.normal.dot(toward);
        if cos <= 0.0 {
            return 0.0;
        }
        let cosine = DVec3::new(0.0, 0.0, s.normal.dot(direction));
        (1.0 - self.coat(cos)) * cosine_hemisphere_pdf(cosine)
    }
}
