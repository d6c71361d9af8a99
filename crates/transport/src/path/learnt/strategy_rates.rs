//! Rates of the strategies of bidirectional path tracing, and their training.
//!
//! Theory: docs/theory.md#strategy-rates.

use serde::{Deserialize, Serialize};

/// Number of levels: rates are 2⁻ᵏ with k below this.
const LEVELS: usize = 5;
/// Fraction of the variance that is attributed to strategies of every kind, whatever the pilot
/// found. Few samples may miss light that only one kind finds.
const PRIOR_FRACTION: f64 = 0.01;
/// Number of rounds of the search for the best rates; kinds influence each other.
const SEARCH_ROUNDS: usize = 3;

/// Kinds of strategies with s vertices from the emitter and t from the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrategyKind {
    /// s = 0: the sensor subpath hits the emitter.
    Hit,
    /// s = 1: a vertex of the sensor subpath is connected to an emitter.
    Direct,
    /// t = 1: a vertex of the emitter subpath is connected to the sensor.
    Sensed,
    /// s, t ≥ 2: a vertex of one subpath is connected to one of the other.
    Joined,
}

impl StrategyKind {
    /// Returns the kind of a strategy; `None` if the strategy is not used. Only hits find a path of
    /// one edge.
    pub fn of(s: usize, t: usize) -> Option<Self> {
        match (s, t) {
            (0, _) => Some(StrategyKind::Hit),
            (1, 1) => None,
            (_, 1) => Some(StrategyKind::Sensed),
            (1, _) => Some(StrategyKind::Direct),
            _ => Some(StrategyKind::Joined),
        }
    }
}

/// Fraction of the density of a path that each [`StrategyKind`] has, among all strategies that can
/// sample the path.
pub type StrategyShares = [f32; 4];

/// Probabilities with which strategies are used. Paths are weighted for fractional numbers of
/// samples (Veach 1997, §9.2.2). Any values in (0, 1] are unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrategyRates {
    /// Probability of an emitter subpath, which the last two strategies need.
    pub light: f64,
    /// Probability of a connection from a vertex of the sensor subpath to an emitter.
    pub direct: f64,
    /// Probability of a connection from a vertex of the emitter subpath to the sensor, given an
    /// emitter subpath.
    pub sensed: f64,
    /// Probability of a connection from a vertex of the sensor subpath to the emitter subpath,
    /// given an emitter subpath.
    pub joined: f64,
}

impl Default for StrategyRates {
    fn default() -> Self {
        StrategyRates {
            light: 1.0,
            direct: 1.0,
            sensed: 1.0,
            joined: 1.0,
        }
    }
}

impl StrategyRates {
    /// Returns the probability with which a strategy of a kind is used.
    pub fn of(&self, kind: StrategyKind) -> f64 {
        match kind {
            StrategyKind::Hit => 1.0,
            StrategyKind::Direct => self.direct,
            StrategyKind::Sensed => self.light * self.sensed,
            StrategyKind::Joined => self.light * self.joined,
        }
    }

    /// Returns the rates of levels: of an emitter subpath, and of the connections.
    fn at([light, direct, sensed, joined]: [usize; 4]) -> Self {
        let [light, direct, sensed, joined] =
            [light, direct, sensed, joined].map(|level| 0.5f64.powi(level as i32));
        StrategyRates {
            light,
            direct,
            sensed,
            joined,
        }
    }
}

/// Work for each part of a sample, by the probabilities of [`StrategyRates`].
#[derive(Clone, Copy, Debug, Default)]
pub struct StrategyWork {
    /// Work for emitter subpaths.
    pub light: f64,
    /// Work for connections to emitters.
    pub direct: f64,
    /// Work for connections to the sensor.
    pub sensed: f64,
    /// Work for connections between subpaths.
    pub joined: f64,
}

/// Contribution of a strategy to a sample of a pilot that uses all strategies.
#[derive(Clone, Copy, Debug)]
pub struct StrategyFind {
    /// The kind of strategy.
    pub kind: StrategyKind,
    /// Weighted contribution.
    pub value: f64,
    /// Fractions of the density of the path that the kinds of strategies have.
    pub shares: StrategyShares,
    /// Weight of the squared error of the contribution.
    pub importance: f64,
}

/// Contributions of a sample of a pilot.
#[derive(Clone, Debug, Default)]
pub struct StrategySample {
    /// Contributions to the sample's own pixel.
    pub own: Vec<StrategyFind>,
    /// Contributions to other pixels.
    pub splats: Vec<StrategyFind>,
}

/// Estimates of variance and work for reduced rates, from a pilot that uses all strategies.
///
/// Let F be the contribution of a path and Dₖ the density with which strategies of kind k sample
/// it. Used with probabilities q, each contributes F/ΣqₖDₖ = X/Σqₖsₖ. Here X = F/ΣDₖ is the
/// contribution in the pilot and sₖ = Dₖ/ΣDₖ are the kinds' shares. This holds for the balance
/// heuristic. For the power heuristic the rates are an approximation, which is unbiased as well.
#[derive(Clone, Debug, Default)]
pub struct StrategyTraining {
    /// Pairs of samples of a pixel, and the weight of the squared error of the pixel.
    pub pairs: Vec<([StrategySample; 2], f64)>,
    /// Work for all samples.
    pub work: f64,
    /// Part of the work that depends on rates.
    pub parts: StrategyWork,
}

/// Mean and variance of the contribution of a sample, over the random choice of strategies.
struct Expected {
    mean: f64,
    variance: f64,
}

impl StrategyTraining {
    /// Returns the rates with the least variance × work.
    pub fn best(&self) -> StrategyRates {
        let mut levels = [0; 4];
        let prior = PRIOR_FRACTION * self.variance(&StrategyRates::default());
        if !(prior > 0.0 && prior.is_finite() && self.work > 0.0) {
            return StrategyRates::default();
        }
        let cost = |levels: [usize; 4]| {
            let rates = StrategyRates::at(levels);
            let kinds = [
                StrategyKind::Direct,
                StrategyKind::Sensed,
                StrategyKind::Joined,
            ];
            let rare: f64 = kinds.map(|kind| rates.of(kind).recip() - 1.0).iter().sum();
            (self.variance(&rates) + prior * rare) * self.work_at(&rates)
        };
        for place in (0..SEARCH_ROUNDS).flat_map(|_| 0..4) {
            let with = |level: usize| {
                let mut levels = levels;
                levels[place] = level;
                levels
            };
            let by_cost = |a: &usize, b: &usize| cost(with(*a)).total_cmp(&cost(with(*b)));
            levels[place] = (0..LEVELS).min_by(by_cost).unwrap_or(0);
        }
        StrategyRates::at(levels)
    }

    /// Returns the expected variance, up to a factor.
    pub fn variance(&self, rates: &StrategyRates) -> f64 {
        let pair = |(samples, importance): &([StrategySample; 2], f64)| {
            let [a, b] = samples.each_ref().map(|sample| sample.expected(rates));
            let own = (a.mean - b.mean).powi(2) + a.variance + b.variance;
            let splats = samples.iter().flat_map(|sample| &sample.splats);
            let squares =
                splats.map(|find| find.importance * find.used(rates).powi(2) * rates.of(find.kind));
            // Add the variances of both samples, and the squares of the splats of both samples.
            importance * own + squares.sum::<f64>()
        };
        self.pairs.iter().map(pair).sum()
    }

    fn work_at(&self, rates: &StrategyRates) -> f64 {
        let StrategyWork {
            light,
            direct,
            sensed,
            joined,
        } = self.parts;
        let rest = self.work - light - direct - sensed - joined;
        rest + rates.direct * direct
            + rates.light * (light + rates.sensed * sensed + rates.joined * joined)
    }
}

impl StrategyFind {
    /// Returns the contribution if the strategy is used.
    fn used(&self, rates: &StrategyRates) -> f64 {
        let [hit, direct, sensed, joined] = self.shares.map(f64::from);
        let sum = hit
            + direct * rates.of(StrategyKind::Direct)
            + sensed * rates.of(StrategyKind::Sensed)
            + joined * rates.of(StrategyKind::Joined);
        self.value / sum
    }
}

impl StrategySample {
    fn expected(&self, rates: &StrategyRates) -> Expected {
        let (mut mean, mut variance, mut from_light) = (0.0, 0.0, 0.0);
        for find in &self.own {
            let (used, q) = (find.used(rates), rates.of(find.kind));
            mean += q * used;
            if find.kind == StrategyKind::Joined {
                // Connections to one emitter subpath require that the subpath exists.
                variance += rates.light * rates.joined * (1.0 - rates.joined) * used * used;
                from_light += rates.joined * used;
            } else {
                variance += q * (1.0 - q) * used * used;
            }
        }
        variance += rates.light * (1.0 - rates.light) * from_light * from_light;
        Expected { mean, variance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trains on a hundred pairs of samples. In each pair, one sample finds light by hits, and the
    /// other by `Joined` strategies, which could share it.
    fn rates(share: f32, light: f64, joined: f64) -> StrategyRates {
        let find = |kind, value| StrategyFind {
            kind,
            value,
            shares: [1.0 - share, 0.0, 0.0, share],
            importance: 1.0,
        };
        let sample = |kind, value| StrategySample {
            own: vec![find(kind, value)],
            splats: Vec::new(),
        };
        let hit = 1.0 - f64::from(share);
        let joins = f64::from(share);
        let pair = [
            sample(StrategyKind::Hit, hit),
            sample(StrategyKind::Joined, joins),
        ];
        let training = StrategyTraining {
            pairs: vec![(pair, 1.0); 100],
            work: 1.0,
            parts: StrategyWork {
                light,
                joined,
                ..StrategyWork::default()
            },
        };
        training.best()
    }

    /// Rates are low for strategies with much work and little benefit, and 1 for strategies that
    /// find all the light or take no work.
    #[test]
    fn rates_weigh_work_against_variance() {
        let always = rates(0.99, 0.2, 0.2);
        assert_eq!(always.of(StrategyKind::Joined), 1.0);
        let seldom = rates(0.01, 0.45, 0.45);
        assert!(seldom.of(StrategyKind::Joined) <= 1.0 / 8.0, "{seldom:?}");
        assert!(seldom.light <= 1.0 / 8.0, "{seldom:?}");
        // Strategies that take no work can always be used.
        assert_eq!(seldom.direct, 1.0);
    }

    /// Expected means do not depend on rates.
    #[test]
    fn expected_means_do_not_depend_on_rates() {
        let find = |kind, value, shares| StrategyFind {
            kind,
            value,
            shares,
            importance: 1.0,
        };
        // Each of two paths is found by every strategy that can sample it, in proportion to its
        // share.
        let sample = StrategySample {
            own: [[0.5, 0.25, 0.0, 0.25], [0.1, 0.3, 0.0, 0.6]]
                .into_iter()
                .flat_map(|shares: StrategyShares| {
                    [
                        StrategyKind::Hit,
                        StrategyKind::Direct,
                        StrategyKind::Joined,
                    ]
                    .map(|kind| find(kind, 2.0 * f64::from(shares[kind as usize]), shares))
                })
                .collect(),
            splats: Vec::new(),
        };
        for levels in [[0; 4], [1, 2, 3, 4], [3, 0, 1, 2]] {
            let mean = sample.expected(&StrategyRates::at(levels)).mean;
            assert!((mean - 4.0).abs() < 1e-6, "{levels:?}: {mean}");
        }
    }
}
