//! Fluorescence of media (docs/theory.md#fluorescence).

use std::sync::Arc;

/// Fluorescence of a medium: light that the medium absorbs in the channel of its scene, and emits
/// in other channels of the film, in all directions equally.
///
/// ```
/// use morgana_optics::medium::Fluorescence;
///
/// // 10 % of the absorbed power leaves in channel 1, after 0.6 units of optical path length on average.
/// let dye = Fluorescence::new(&[0.0, 0.1], 0.6).unwrap();
/// assert_eq!(dye.power_yield(1), 0.1);
/// assert!(Fluorescence::new(&[0.6, 0.6], 0.0).is_none());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Fluorescence {
    power_yields: Arc<[f64]>,
    mean_delay: f64,
}

impl Fluorescence {
    /// Creates the fluorescence. `power_yields` holds the power emitted in each channel of the
    /// film, as a fraction of the power that the medium absorbs. `mean_delay` is the mean time
    /// between absorption and emission, times the speed of light, in scene units. Returns `None` if
    /// a number is negative or not finite, or if the yields add up to more than 1.
    pub fn new(power_yields: &[f64], mean_delay: f64) -> Option<Self> {
        let is_valid = |v: f64| v >= 0.0 && v.is_finite();
        let total: f64 = power_yields.iter().sum();
        let valid = power_yields.iter().all(|y| is_valid(*y)) && is_valid(mean_delay);
        (valid && total <= 1.0).then(|| Fluorescence {
            power_yields: power_yields.into(),
            mean_delay,
        })
    }

    /// Returns the power emitted in a channel of the film, as a fraction of the power that the
    /// medium absorbs.
    pub fn power_yield(&self, channel: usize) -> f64 {
        self.power_yields.get(channel).copied().unwrap_or(0.0)
    }

    /// Returns the mean time between absorption and emission, times the speed of light. Delays have
    /// an exponential distribution.
    pub fn mean_delay(&self) -> f64 {
        self.mean_delay
    }
}
