//! Angular distributions of the light that leaves a point of an aperture.

use crate::sampling::disc::{
    gaussian_disc_pdf, gaussian_disc_sample, truncated_gaussian_disc_pdf,
    truncated_gaussian_disc_sample, uniform_disc_pdf, uniform_disc_sample,
};
use crate::sampling::sphere::uniform_cone_sample;
use crate::sampling::{DistributionError, PiecewiseConstant};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Largest sine of the angle between light of a fan and the plane of the fan. It is small compared
/// with all angles that matter, and large compared with rounding errors of directions.
const FAN_SINE: f64 = 1e-6;
/// Relative amount by which directions at the edge of a fan may lie beyond it after rounding.
const FAN_ROUNDING: f64 = 1e-6;
/// Smallest sine by which densities of angles are divided. Light closer to the axis has a probability
/// below 1e-9.
const MIN_SINE: f64 = 1e-9;

/// Angular distribution of the light of a fibre. θ is the angle from the axis, θ₀ the angle of the
/// edge.
#[derive(Clone, Debug)]
pub enum AngularProfile {
    /// Same intensity for θ ≤ θ₀: uniform in solid angle. θ₀ may exceed a right angle.
    Uniform,
    /// Same radiance for θ ≤ θ₀: intensity proportional to cos θ.
    Lambertian,
    /// Radiance proportional to exp(−2 sin²θ/sin²θ₀), over the whole hemisphere.
    Gaussian,
    /// Light in the plane perpendicular to local x: the angle from the axis is uniform up to θ₀ on
    /// either side. θ₀ may exceed a right angle.
    Fan,
    /// Independent normal slopes: the components of the direction along local x and y, over the
    /// component along the axis, have these standard deviations, > 0.
    Slopes([f64; 2]),
    /// Distribution of θ in radians, with any azimuth.
    Angles(Arc<PiecewiseConstant>),
}

impl AngularProfile {
    /// Creates the distribution of angles of which the given angles are quantiles, at equal steps
    /// of probability. `angles` are in radians and increase strictly, within [0, π]. Between them
    /// the density of the angle is constant.
    ///
    /// # Errors
    /// Fails if there are fewer than two angles, or if they do not increase within [0, π].
    pub fn quantiles(angles: Vec<f64>) -> Result<Self, DistributionError> {
        let weights = vec![1.0; angles.len().saturating_sub(1)];
        AngularProfile::angles(angles, &weights)
    }

    /// Creates the distribution of angles that lie between neighbouring `angles` with the given
    /// relative probabilities, one fewer than the angles. `angles` are in radians and increase
    /// strictly, within [0, π]. Between them the density of the angle is constant.
    ///
    /// # Errors
    /// Fails if there are fewer than two angles, or if they do not increase within [0, π]. Fails if
    /// the number of probabilities does not match, or if one is negative or all are zero.
    pub fn angles(angles: Vec<f64>, probabilities: &[f64]) -> Result<Self, DistributionError> {
        if let Some(&position) = angles.iter().find(|a| !(0.0..=PI).contains(*a)) {
            return Err(DistributionError::Outside {
                position,
                range: [0.0, PI],
            });
        }
        let widths = angles.windows(2).map(|pair| pair[1] - pair[0]);
        let densities = probabilities.iter().zip(widths).map(|(p, width)| p / width);
        let mut densities: Vec<f64> = densities.collect();
        // A wrong number of probabilities is an error of the distribution.
        densities.resize(probabilities.len(), 0.0);
        let distribution = PiecewiseConstant::new(angles, &densities)?;
        Ok(AngularProfile::Angles(Arc::new(distribution)))
    }

    /// Returns true if the edge angle θ₀ determines the distribution.
    pub fn has_edge(&self) -> bool {
        !matches!(self, AngularProfile::Slopes(_) | AngularProfile::Angles(_))
    }

    /// Returns the largest angle of the edge, in radians.
    pub fn max_edge(&self) -> f64 {
        match self {
            AngularProfile::Uniform | AngularProfile::Fan => PI,
            _ => FRAC_PI_2,
        }
    }

    /// Returns the sine of the typical angle across which light spreads, at most 1.
    pub(super) fn spread(&self, edge: Edge) -> f64 {
        match self {
            AngularProfile::Fan => FAN_SINE,
            AngularProfile::Slopes(deviations) => deviations[0].min(deviations[1]).min(1.0),
            AngularProfile::Angles(_) => 1.0,
            _ if edge.is_wide => 1.0,
            _ => edge.sin(),
        }
    }

    /// Returns true if the distribution depends on the azimuth around the axis.
    pub(super) fn depends_on_azimuth(&self) -> bool {
        matches!(self, AngularProfile::Fan | AngularProfile::Slopes(_))
    }

    /// Samples a unit vector, with the axis along +z.
    pub(super) fn sample(&self, edge: Edge, u: [f64; 2]) -> DVec3 {
        let lifted = |p: DVec2| p.extend((1.0 - p.length_squared()).max(0.0).sqrt());
        match self {
            AngularProfile::Uniform => uniform_cone_sample(edge.cap(), u),
            AngularProfile::Lambertian => lifted(edge.sin() * uniform_disc_sample(u)),
            AngularProfile::Gaussian => lifted(truncated_gaussian_disc_sample(0.5 * edge.sin(), u)),
            AngularProfile::Fan => {
                let angle = (2.0 * u[0] - 1.0) * edge.angle();
                let x = (2.0 * u[1] - 1.0) * FAN_SINE;
                let across = (1.0 - x * x).sqrt();
                DVec3::new(x, across * angle.sin(), across * angle.cos())
            }
            AngularProfile::Slopes(deviations) => {
                let slopes = gaussian_disc_sample(1.0, u) * DVec2::from(*deviations);
                slopes.extend(1.0).normalize()
            }
            AngularProfile::Angles(angles) => {
                let (angle, _) = angles.sample(u[0]);
                (angle.sin() * DVec2::from_angle(TAU * u[1])).extend(angle.cos())
            }
        }
    }

    /// Returns the density of [`AngularProfile::sample`] per steradian.
    pub(super) fn pdf(&self, edge: Edge, local: DVec3) -> f64 {
        match self {
            AngularProfile::Fan => {
                let angle = local.y.atan2(local.z).abs();
                let rounded = 1.0 + FAN_ROUNDING;
                if local.x.abs() <= rounded * FAN_SINE && angle <= rounded * edge.angle() {
                    1.0 / (2.0 * edge.angle() * 2.0 * FAN_SINE)
                } else {
                    0.0
                }
            }
            AngularProfile::Slopes(deviations) if local.z > 0.0 => {
                let deviations = DVec2::from(*deviations);
                let standard = local.truncate() / local.z / deviations;
                // The slopes p have the solid angle cos³θ d²p.
                gaussian_disc_pdf(1.0, standard) / (deviations.x * deviations.y) / local.z.powi(3)
            }
            AngularProfile::Slopes(_) => 0.0,
            _ => self.round_pdf(edge, local.z, local.truncate().length()),
        }
    }

    /// Returns the density per steradian at an angle with the given cosine and sine, for
    /// distributions that do not depend on the azimuth.
    pub(super) fn round_pdf(&self, edge: Edge, cos: f64, sin: f64) -> f64 {
        if let AngularProfile::Angles(angles) = self {
            return angles.pdf(sin.atan2(cos)) / (TAU * sin.max(MIN_SINE));
        }
        if edge.is_wide {
            // Light at the edge may lie beyond it after rounding.
            let inside = sin.atan2(cos) <= edge.angle() * (1.0 + f64::EPSILON);
            return if inside {
                1.0 / (TAU * edge.cap())
            } else {
                0.0
            };
        }
        if cos <= 0.0 {
            return 0.0;
        }
        let (p, edge_sine) = (DVec2::new(sin, 0.0), edge.sin());
        match self {
            AngularProfile::Uniform if sin <= edge_sine => 1.0 / (TAU * edge.cap()),
            AngularProfile::Lambertian => {
                cos * uniform_disc_pdf(p / edge_sine) / (edge_sine * edge_sine)
            }
            AngularProfile::Gaussian => cos * truncated_gaussian_disc_pdf(0.5 * edge_sine, p),
            _ => 0.0,
        }
    }
}

/// Edge of a cone of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    /// Sine of the edge angle. It exceeds 1 if a numerical aperture is larger than the index.
    pub sine: f64,
    /// True if the edge angle exceeds a right angle.
    pub is_wide: bool,
}

impl Edge {
    /// Returns the sine of the edge angle, at most 1.
    pub(super) fn sin(self) -> f64 {
        self.sine.min(1.0)
    }

    /// Returns the edge angle.
    fn angle(self) -> f64 {
        let acute = self.sin().asin();
        if self.is_wide { PI - acute } else { acute }
    }

    /// Returns the height 1 − cos of the cap that the cone cuts out of the unit sphere.
    fn cap(self) -> f64 {
        let sin2 = self.sin() * self.sin();
        let cos = (1.0 - sin2).sqrt();
        if self.is_wide {
            1.0 + cos
        } else {
            sin2 / (1.0 + cos)
        }
    }
}
