//! Contributions of estimators to the film.

use crate::Spectrum;
use crate::film::PathFacts;
use crate::path::StrategyShares;

/// A contribution of one path to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Position on the image, in units of its size from the top left; `None` for the pixel of the
    /// sample. With a position, the value is per unit of the image's area: a pixel receives the
    /// value times the pixel's filter.
    pub image: Option<[f64; 2]>,
    /// Number of vertices that were sampled from the emitter and from the sensor, including the
    /// ends; zeros for an estimator that does not separate strategies.
    pub strategy: (u32, u32),
    /// Unweighted value.
    pub value: Spectrum,
    /// Bias of the value, to second order in the radius of the kernel; zero for an unbiased
    /// estimator.
    pub bias: Spectrum,
    /// MIS weight of the strategy among all strategies that can sample the path, in [0, 1].
    pub weight: f64,
    /// Fractions of the density of the path that the kinds of strategies have if all are used.
    /// Zeros for an estimator that does not separate strategies.
    pub shares: StrategyShares,
    /// Properties of the path.
    pub path: PathFacts,
}

impl Contribution {
    /// Returns true if value, weight and bias are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.weighted().is_finite() && self.bias.is_finite()
    }

    /// Returns value times weight.
    pub fn weighted(&self) -> Spectrum {
        self.value * self.weight
    }
}
