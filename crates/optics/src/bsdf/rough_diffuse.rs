//! Rough diffuse surface: V-shaped cavities with Lambertian walls (Oren and Nayar 1994). It
//! reflects on the side of the normal only.

use super::error::unbounded;
use super::surface::above;
use super::tint::{BsdfEvent, reciprocal};
use super::{BsdfError, BsdfSample, Surface, factor};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// Rough diffuse reflector. The model is a fit. At grazing directions, white surfaces reflect up to
/// 4.5 % more than they receive.
#[derive(Clone, Debug)]
pub struct RoughDiffuse {
    reflectance: Texture,
    alpha: Texture,
    fast: bool,
}

/// Directly reflected light, and light reflected between opposite walls.
struct Cavities {
    single: f64,
    double: f64,
}

impl RoughDiffuse {
    /// Creates the reflector, with `reflectance` in [0, 1] and `alpha` ≥ 0. `alpha` is Beckmann's
    /// roughness, √2 times the standard deviation of the slopes, as in Mitsuba. With `fast`, light
    /// between walls is omitted, as in the short form of the model.
    ///
    /// # Errors
    /// Fails if the reflectance lies outside [0, 1], or if the roughness is negative or not finite.
    pub fn new(
        reflectance: impl Into<Texture>,
        alpha: impl Into<Texture>,
        fast: bool,
    ) -> Result<Self, BsdfError> {
        let alpha = alpha.into();
        unbounded("alpha", &alpha)?;
        Ok(RoughDiffuse {
            reflectance: factor("reflectance", reflectance)?,
            alpha,
            fast,
        })
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let local = cosine_hemisphere_sample([u[1], u[2]]);
        let direction = Frame::from_normal(s.normal).to_world(local).normalize();
        let pdf = self.pdf(s, toward, direction);
        let value = || self.eval(s, toward, direction);
        BsdfSample::reflected(direction, pdf, value)
    }

    pub(super) fn reflectance(&self) -> &Texture {
        &self.reflectance
    }

    pub(super) fn albedo(&self, s: &Surface) -> Spectrum {
        self.reflectance.at(&s.site)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let Some([o, i, _]) = above(s, toward, direction) else {
            return Spectrum::ZERO;
        };
        let cavities = self.cavities(s, o, i);
        let cosine = cosine_hemisphere_pdf(i);
        let value = |r: f64| r * (cavities.single + r * cavities.double) * cosine;
        self.reflectance.at(&s.site).map(value)
    }

    fn cavities(&self, s: &Surface, o: DVec3, i: DVec3) -> Cavities {
        let sigma2 = 0.5 * self.alpha.number_at(&s.site).powi(2);
        if self.fast {
            Cavities::direct(sigma2, o, i)
        } else {
            Cavities::of(sigma2, o, i)
        }
    }

    pub(super) fn tint_derivative(&self, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let Some([o, i, _]) = above(s, event.toward, event.direction) else {
            return Spectrum::ZERO;
        };
        let Cavities { single, double } = self.cavities(s, o, i);
        let colour = self.reflectance.at(&s.site);
        let second = reciprocal(colour.map(|r| single + r * double)) * double;
        reciprocal(colour) + second
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        above(s, toward, direction).map_or(0.0, |[_, i, _]| cosine_hemisphere_pdf(i))
    }
}

/// Returns the cosine of the difference in azimuth; 0 along the normal, where the azimuth is
/// undefined.
fn cos_between(o: DVec3, i: DVec3) -> f64 {
    let [o, i] = [o, i].map(|d| d.truncate().normalize_or_zero());
    o.dot(i).clamp(-1.0, 1.0)
}

impl Cavities {
    /// Computes the short form of the model, for walls whose slopes have variance `sigma2`.
    fn direct(sigma2: f64, o: DVec3, i: DVec3) -> Self {
        let [low, high] = if o.z < i.z { [o, i] } else { [i, o] };
        let b = 0.45 * sigma2 / (sigma2 + 0.09);
        let sin = low.truncate().length();
        let tan = high.truncate().length() / high.z;
        Cavities {
            single: 1.0 - 0.5 * sigma2 / (sigma2 + 0.33)
                + b * cos_between(o, i).max(0.0) * sin * tan,
            double: 0.0,
        }
    }

    /// Computes the full model, eqs. 27 to 30.
    fn of(sigma2: f64, o: DVec3, i: DVec3) -> Self {
        let [low, high] = if o.z < i.z { [o, i] } else { [i, o] };
        let angle = |d: DVec3| d.truncate().length().atan2(d.z).min(FRAC_PI_2);
        let (alpha, beta) = (angle(low), angle(high));
        let cos = cos_between(o, i);
        let relative = sigma2 / (sigma2 + 0.09);
        let far = FRAC_2_PI * beta;
        let c1 = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
        let backward = if cos > 0.0 { 0.0 } else { far.powi(3) };
        let c2 = 0.45 * relative * (low.truncate().length() - backward);
        let c3 = 0.125 * relative * (FRAC_2_PI * FRAC_2_PI * alpha * beta).powi(2);
        let c4 = 0.17 * sigma2 / (sigma2 + 0.13);
        let tan = high.truncate().length() / high.z;
        let half = (0.5 * (alpha + beta)).tan();
        Cavities {
            single: c1 + cos * c2 * tan + (1.0 - cos.abs()) * c3 * half,
            double: c4 * (1.0 - cos * far * far),
        }
    }
}
