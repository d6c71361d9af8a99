//! Sidebands and autocorrelation of light whose phase sound modulates.
//!
//! Theory: docs/theory.md#tagged-light.

use crate::Bins;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};

/// Sidebands and delays of tagged light. Light of weight w and phase amplitude Φ has *parts*: w
/// J_m(|Φ|)² for the orders m from 0 on, then w J₀(2|Φ| sin(ωτ/2)) for the delays τ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sidebands {
    /// Wave number of the light in vacuum: 2π over its wavelength.
    wave_number: f64,
    /// Highest order.
    orders: u32,
    /// Number of delays.
    delays: u32,
}

impl Sidebands {
    /// Largest value of the highest order.
    pub const MAX_ORDERS: u32 = 100;
    /// Largest number of delays.
    pub const MAX_DELAYS: u32 = 1000;

    /// Creates orders up to `orders`, and `delays` equal steps of the delay up to half a period of
    /// the sound. The wavelength is in vacuum, in scene units. Returns `None` if the wavelength is
    /// not positive or a number is above its maximum.
    ///
    /// ```
    /// use morgana_transport::sidebands::Sidebands;
    ///
    /// let sidebands = Sidebands::new(532e-6, 2, 1).unwrap();
    /// // The carrier, two sidebands, and the delay of half a period.
    /// assert_eq!(sidebands.parts(), 4);
    /// assert!(Sidebands::new(0.0, 2, 1).is_none());
    /// ```
    pub fn new(wavelength: f64, orders: u32, delays: u32) -> Option<Self> {
        let wave_number = TAU / wavelength;
        let known = wavelength > 0.0 && wave_number > 0.0 && wave_number.is_finite();
        let few = orders <= Self::MAX_ORDERS && delays <= Self::MAX_DELAYS;
        (known && few).then_some(Sidebands {
            wave_number,
            orders,
            delays,
        })
    }

    /// Returns the wavelength of the light in vacuum, in scene units.
    pub fn wavelength(&self) -> f64 {
        TAU / self.wave_number
    }

    /// Returns the highest order.
    pub fn orders(&self) -> u32 {
        self.orders
    }

    /// Returns the number of delays.
    pub fn delays(&self) -> u32 {
        self.delays
    }

    /// Returns the number of parts: the orders from 0 on, then the delays.
    pub fn parts(&self) -> usize {
        self.orders as usize + 1 + self.delays as usize
    }

    /// Bins centred at the orders.
    pub fn order_bins(&self) -> Bins {
        let count = self.orders as usize + 1;
        Bins {
            min: -0.5,
            max: count as f64 - 0.5,
            count,
        }
    }

    /// Bins centred at the delays, in periods of the sound; `None` if there are no delays.
    pub fn delay_bins(&self) -> Option<Bins> {
        let step = 0.5 / f64::from(self.delays);
        (self.delays > 0).then_some(Bins {
            min: 0.5 * step,
            max: 0.5 + 0.5 * step,
            count: self.delays as usize,
        })
    }

    /// Returns the fractions of all parts, given the amplitude of the light's optical length; NaN
    /// if the amplitude is unknown.
    #[inline]
    pub(crate) fn shares(&self, modulation: DVec2) -> SmallVec<[f64; 8]> {
        let square = self.wave_number * self.wave_number * modulation.length_squared();
        if (self.orders, self.delays) == (1, 0) && square <= MAX_SQUARED_ARGUMENT {
            SmallVec::from_slice(&slow_squares::<2>(square))
        } else {
            self.all_shares(square)
        }
    }

    /// Returns the fractions of all parts for any orders and delays, given the square of the phase.
    fn all_shares(&self, square: f64) -> SmallVec<[f64; 8]> {
        let orders = self.orders as usize;
        if orders < ORDERS && self.delays == 0 && square <= MAX_SQUARED_ARGUMENT {
            return SmallVec::from_slice(&slow_squares::<ORDERS>(square)[..=orders]);
        }
        let phase = square.sqrt();
        let at_delay = |i| {
            let half_turn = 0.5 * PI * f64::from(i) / f64::from(self.delays);
            correlation(phase, half_turn)
        };
        let orders = squares(square, self.orders);
        orders.chain((1..=self.delays).map(at_delay)).collect()
    }
}

/// Returns the fractions J_m(|Φ|)² of the orders m from 0 to `orders` in light whose phase has the
/// amplitude `phase`.
///
/// ```
/// use morgana_transport::sidebands::order_shares;
///
/// let shares: Vec<f64> = order_shares(0.7, 20).collect();
/// let all = shares[0] + 2.0 * shares[1..].iter().sum::<f64>();
/// assert!((all - 1.0).abs() < 1e-14);
/// ```
pub fn order_shares(phase: f64, orders: u32) -> impl Iterator<Item = f64> {
    squares(phase * phase, orders)
}

/// Returns the autocorrelation J₀(2|Φ| sin(ωτ/2)) of light whose phase has the amplitude `phase`,
/// at the delay τ = 2 `half_turn`/ω.
pub fn correlation(phase: f64, half_turn: f64) -> f64 {
    libm::j0(2.0 * phase * half_turn.sin())
}

/// Returns J_m(x)² of the orders from 0 to `orders`, given x².
fn squares(square: f64, orders: u32) -> impl Iterator<Item = f64> {
    let of_slow = (square <= MAX_SQUARED_ARGUMENT).then(|| slow_squares::<ORDERS>(square));
    let x = square.sqrt();
    (0..=orders).map(move |order| match (order as usize, of_slow) {
        (m @ 0..ORDERS, Some(squares)) => squares[m],
        (0, None) => libm::j0(x).powi(2),
        (1, None) => libm::j1(x).powi(2),
        _ => libm::jn(order as i32, x).powi(2),
    })
}

/// Largest x² at which J_m of the first [`ORDERS`] orders is summed as a series of [`TERMS`] terms.
const MAX_SQUARED_ARGUMENT: f64 = 4.0;
const ORDERS: usize = 4;
const TERMS: usize = 12;

/// Coefficients (−1)^k/(k! (k + m)!) of the orders m.
const SERIES: [[f64; ORDERS]; TERMS] = {
    let mut series = [[1.0; ORDERS]; TERMS];
    let mut m = 1;
    while m < ORDERS {
        series[0][m] = series[0][m - 1] / m as f64;
        m += 1;
    }
    let mut k = 1;
    while k < TERMS {
        let mut m = 0;
        while m < ORDERS {
            series[k][m] = -series[k - 1][m] / (k * (k + m)) as f64;
            m += 1;
        }
        k += 1;
    }
    series
};

/// Returns J_m(x)² of the first orders for x² up to [`MAX_SQUARED_ARGUMENT`], to rounding, without
/// roots and divisions.
#[inline]
fn slow_squares<const N: usize>(square: f64) -> [f64; N] {
    let z = 0.25 * square;
    let z2 = z * z;
    // Sum even and odd powers separately, so that the two sums do not wait for each other.
    let (mut even, mut odd) = ([0.0; N], [0.0; N]);
    for [of_even, of_odd] in SERIES.as_chunks().0.iter().rev() {
        for m in 0..N {
            even[m] = even[m] * z2 + of_even[m];
            odd[m] = odd[m] * z2 + of_odd[m];
        }
    }
    let mut power = 1.0;
    std::array::from_fn(|m| {
        let sum = even[m] + z * odd[m];
        // Planted error "sidebands as amplitudes, not powers", found by morgana-transport/lib::observe::sidebands::tests::shares_are_squares_of_bessel_functions:
        // let of_order = f64::sqrt(power) * sum.abs();
        let of_order = power * (sum * sum);
        power *= z;
        of_order
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orders add up to all light. Their autocorrelation is Σ_m J_m² cos mωτ (Neumann's addition
    /// theorem), to the accuracy of the Bessel functions.
    #[test]
    fn orders_add_up_and_correlate() {
        let sidebands = Sidebands::new(1e-3, 60, 7).unwrap();
        for phase in [0.0, 1e-3, 0.7, 3.0, 20.0] {
            let modulation = DVec2::from_angle(1.3) * (phase / sidebands.wave_number);
            let shares = sidebands.shares(modulation);
            assert_eq!(shares.len(), sidebands.parts());
            for delay in 0..=7 {
                let turn = PI * f64::from(delay) / 7.0;
                let of = |m: usize| 2.0 * shares[m] * (m as f64 * turn).cos();
                let sum = shares[0] + (1..=60).map(of).sum::<f64>();
                let expected = match delay {
                    0 => 1.0,
                    _ => shares[60 + delay as usize],
                };
                assert!((sum - expected).abs() < 1e-12, "{phase}, {delay}: {sum}");
            }
        }
        let unknown = sidebands.shares(DVec2::NAN);
        assert!(unknown.iter().all(|share| share.is_nan()));
    }

    /// Phases reach from zero to the end of the series and beyond, with few sidebands and with
    /// several.
    #[test]
    fn shares_are_squares_of_bessel_functions() {
        let [few, many] = [[2, 0], [5, 2]].map(|[orders, delays]| {
            let sidebands = Sidebands::new(1e-3, orders, delays);
            sidebands.unwrap()
        });
        for step in 0..=500 {
            let phase = 0.01 * f64::from(step);
            let modulation = DVec2::from_angle(0.4) * (phase / few.wave_number);
            let [shares, more] = [few.shares(modulation), many.shares(modulation)];
            assert_eq!(shares[..], more[..3]);
            for order in 0..=5 {
                let expected = libm::jn(order, phase).powi(2);
                assert!((more[order as usize] - expected).abs() < 1e-15, "{phase}");
            }
        }
    }

    #[test]
    fn bins_are_around_orders_and_delays() {
        let sidebands = Sidebands::new(1.0, 2, 4).unwrap();
        assert_eq!(sidebands.order_bins().edges(), [-0.5, 0.5, 1.5, 2.5]);
        let delays = sidebands.delay_bins().unwrap();
        assert_eq!(delays.edges(), [0.0625, 0.1875, 0.3125, 0.4375, 0.5625]);
        assert!(Sidebands::new(1.0, 2, 0).unwrap().delay_bins().is_none());
        for wavelength in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Sidebands::new(wavelength, 1, 0).is_none());
        }
        assert!(Sidebands::new(1.0, Sidebands::MAX_ORDERS + 1, 0).is_none());
    }
}
