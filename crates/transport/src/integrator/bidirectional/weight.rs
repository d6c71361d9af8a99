//! Multiple importance sampling over all strategies (Veach 1997, chapter 10):
//! docs/theory.md#bidirectional.

use crate::path::{StrategyKind, StrategyRates, StrategyShares};

/// All kinds of strategies, in the order of [`StrategyShares`].
const KINDS: [StrategyKind; 4] = [
    StrategyKind::Hit,
    StrategyKind::Direct,
    StrategyKind::Sensed,
    StrategyKind::Joined,
];

/// Heuristic that weights the strategies that can sample a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// Weights in proportion to the densities.
    #[default]
    Balance,
    /// Weights in proportion to the squares of the densities.
    Power,
}

/// Densities at vertex xᵢ of a path x₀ (sensor) … x_k (emitter), i ≥ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Density {
    /// Density with which xᵢ is sampled from the sensor's side, given the vertices before it.
    pub from_sensor: f64,
    /// Density with which xᵢ is sampled from the emitter's side.
    pub from_emitter: f64,
    /// Probability that connections discover the edge from xᵢ₋₁ to xᵢ; 0 if they do not search for
    /// it.
    pub discovery: f64,
    /// Weight of merging at xᵢ: see [`MergeContents`](super::MergeContents).
    pub merging: f64,
}

/// Technique that sampled a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Technique {
    /// Connection of the first `t` vertices, including x₀, from the sensor, with the other vertices
    /// from the emitter.
    Connection { t: usize },
    /// Merging at x_t of the vertices up to x_t from the sensor with the vertices from x_t on from
    /// the emitter.
    Merging { t: usize },
}

/// MIS weight of a strategy, and the fractions of the path's density that the kinds of strategies
/// have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    /// Weight of the strategy.
    pub own: f64,
    /// Fractions of the path's density that the kinds of strategies have if all are used.
    pub shares: StrategyShares,
}

/// Returns the MIS weight of a technique. `path` lists x₁ … x_k, and `rates` are the probabilities
/// with which strategies are used.
///
/// Let p_t be the density of strategy t. The ratio p_{t+1}/p_t is a product: the ratio of the two
/// densities of x_t times the ratio of the discovery probabilities of the connected edges. A
/// strategy without a connection, t = k + 1, has discovery probability 1. A strategy with an edge
/// that connections do not search for has discovery probability 0
/// (docs/theory.md#connectable-edges). Merging at x_t has the product of three densities: the
/// density of strategy t without its discovery probability, the density of x_t from the sensor, and
/// [`Density::merging`] (docs/theory.md#vertex-merging).
pub(super) fn weight(
    heuristic: Heuristic,
    path: &[Density],
    technique: Technique,
    rates: &StrategyRates,
) -> Weight {
    let (Technique::Connection { t } | Technique::Merging { t }) = technique;
    let discovery = |t: usize| path.get(t - 1).map_or(1.0, |d| d.discovery);
    let kind = |t: usize| StrategyKind::of(path.len() + 1 - t, t);
    let power = |p: f64| match heuristic {
        Heuristic::Balance => p,
        Heuristic::Power => p * p,
    };
    let (mut kinds, mut merged) = ([0.0; 4], 0.0);
    let mut add = |t: usize, density: f64| {
        if let (true, Some(kind)) = (density > 0.0, kind(t)) {
            kinds[kind as usize] += power(density);
        }
    };
    // Sum densities over p_t/e_t by eq. (strategy ratio), for techniques with more sensor vertices
    // …
    let mut ratio = 1.0;
    for (j, d) in path.iter().enumerate().skip(t - 1) {
        merged += power(ratio * d.from_sensor * d.merging);
        ratio *= d.from_sensor / d.from_emitter;
        if ratio == 0.0 || ratio.is_nan() {
            break;
        }
        let discovery = discovery(j + 2);
        if discovery > 0.0 {
            add(j + 2, ratio * discovery);
        }
    }
    // … and for techniques with fewer.
    ratio = 1.0;
    for (j, d) in path.iter().enumerate().take(t - 1).rev() {
        merged += power(ratio * d.from_emitter * d.merging);
        ratio *= d.from_emitter / d.from_sensor;
        if ratio == 0.0 || ratio.is_nan() {
            break;
        }
        let discovery = discovery(j + 1);
        if discovery > 0.0 {
            add(j + 1, ratio * discovery);
        }
    }
    add(t, discovery(t));
    // Compute the weight p_t^β/Σ p^β.
    let all: f64 = kinds.iter().sum::<f64>() + merged;
    let used: f64 = KINDS
        .iter()
        // Planted error "strategies weighed as if all were used", found by morgana-transport/transport::connections::any_rate_of_strategies_is_unbiased:
        // .map(|kind| kinds[*kind as usize])
        .map(|kind| power(rates.of(*kind)) * kinds[*kind as usize])
        .sum();
    let own = match technique {
        Technique::Connection { t } => {
            kind(t).map_or(0.0, |kind| power(rates.of(kind)) * power(discovery(t)))
        }
        Technique::Merging { t } => {
            let d = &path[t - 1];
            power(d.from_sensor * d.merging)
        }
    };
    Weight {
        // Planted error "merging left out of the weights", found by morgana-transport/transport::photons::merging::merging_shows_what_connections_show:
        // own: own / used,
        own: own / (used + merged),
        shares: kinds.map(|kind| (kind / all) as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weights of all techniques of one path sum to one.
    #[test]
    fn weights_sum_to_one() {
        let density = |a, b, discovery, merging| Density {
            from_sensor: a,
            from_emitter: b,
            discovery,
            merging,
        };
        let delta = [density(2.0, 3.0, 1.0, 5.0), density(0.0, 1.0, 0.125, 0.0)];
        let broad = [
            density(0.5, 1e-3, 1.0, 0.7),
            density(7.0, 2.0, 0.0, 0.0),
            density(1e4, 1e-4, 1.0, 0.3),
            density(3.0, 0.25, 0.1, 0.0),
        ];
        let rates = StrategyRates {
            light: 0.5,
            direct: 0.25,
            sensed: 0.125,
            joined: 1.0,
        };
        for path in [&delta[..], &broad[..]] {
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                let strategies = (1..=path.len() + 1).filter(|&t| {
                    path.get(t - 1).is_none_or(|d| d.discovery > 0.0)
                        && path[..t - 1].iter().all(|d| d.from_sensor > 0.0)
                });
                let connections = strategies.map(|t| Technique::Connection { t });
                let mergings = (1..path.len()).map(|t| Technique::Merging { t });
                let sum: f64 = connections
                    .chain(mergings)
                    .map(|technique| weight(heuristic, path, technique, &rates).own)
                    .sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum}");
            }
        }
    }

    /// Only hits find a path of one edge.
    #[test]
    fn an_emitter_in_view_is_hit() {
        let path = [Density {
            from_sensor: 1.0,
            from_emitter: 5.0,
            discovery: 1.0,
            merging: 0.0,
        }];
        let hit = Technique::Connection { t: 2 };
        let weight = weight(Heuristic::Balance, &path, hit, &StrategyRates::default());
        assert_eq!((weight.own, weight.shares), (1.0, [1.0, 0.0, 0.0, 0.0]));
    }

    /// Two strategies have weights in proportion to their densities, or to the squares of their
    /// densities.
    #[test]
    fn two_strategies() {
        let path = [
            Density {
                from_sensor: 1.0,
                from_emitter: 1.0,
                discovery: 0.0,
                merging: 0.0,
            },
            Density {
                from_sensor: 3.0,
                from_emitter: 1.0,
                discovery: 0.5,
                merging: 0.0,
            },
        ];
        // The density is 1 · 0.5 by connection, and 3 by a hit.
        let own = |heuristic, t| {
            let connection = Technique::Connection { t };
            weight(heuristic, &path, connection, &StrategyRates::default()).own
        };
        assert!((own(Heuristic::Balance, 2) - 0.5 / 3.5).abs() < 1e-15);
        assert!((own(Heuristic::Power, 3) - 9.0 / 9.25).abs() < 1e-15);
    }
}
