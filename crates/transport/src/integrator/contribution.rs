//! What an estimator hands to the film.

use crate::Spectrum;
use crate::film::PathFacts;
use crate::path::StrategyShares;

/// A contribution of one path to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Where on the image, in units of its size from the top left; `None` for the pixel whose sample it
    /// is. Elsewhere the value is per unit of the image's area: a pixel receives it times its filter.
    pub image: Option<[f64; 2]>,
    /// Number of vertices that were sampled from the emitter and from the sensor, ends included; zeros
    /// of an estimator that does not tell strategies apart.
    pub strategy: (u32, u32),
    /// Unweighted.
    pub value: Spectrum,
    /// The part of the value that is bias, to second order in the radius within which photons count; zero of an estimator without.
    pub bias: Spectrum,
    /// Weight against the other strategies that can sample this path, in [0, 1].
    pub weight: f64,
    /// How the path is shared among kinds of strategies if all are used; zeros of an estimator that does not tell them apart.
    pub shares: StrategyShares,
    /// What is known of the path.
    pub path: PathFacts,
}

impl Contribution {
    /// Whether its value, weight and bias are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        self.weighted().is_finite() && self.bias.is_finite()
    }

    /// Value times weight.
    pub fn weighted(&self) -> Spectrum {
        self.value * self.weight
    }
}
