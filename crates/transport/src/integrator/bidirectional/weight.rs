//! Multiple importance sampling over all strategies (Veach 1997, chapter 10): docs/theory.md#bidirectional.

/// How the strategies that can sample a path share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// In proportion to their densities.
    #[default]
    Balance,
    /// In proportion to the squares of their densities.
    Power,
}

/// What is known of vertex xᵢ of a path x₀ (sensor) … x_k (emitter), i ≥ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Density {
    /// Density with which xᵢ is sampled from the side of the sensor, given what comes before.
    pub from_sensor: f64,
    /// Density with which it is sampled from the side of the emitter.
    pub from_emitter: f64,
    /// How easily connections find the edge from xᵢ₋₁ to xᵢ; 0 if they do not look for it.
    pub discovery: f64,
}

/// The weight of the strategy that samples the first `t` vertices, x₀ included, from the sensor and
/// connects them to the others. `path` lists x₁ … x_k.
///
/// With p_t the density of strategy t, p_{t+1}/p_t is the ratio of the two densities of x_t times that of
/// the discovery probabilities of the edges that they connect. A strategy that connects nothing, t = k + 1, has discovery
/// probability 1; one whose edge connections do not look for has none (docs/theory.md#connectable-edges).
pub(super) fn weight(heuristic: Heuristic, path: &[Density], t: usize) -> f64 {
    let discovery = |t: usize| path.get(t - 1).map_or(1.0, |d| d.discovery);
    let power = |p: f64| match heuristic {
        Heuristic::Balance => p,
        Heuristic::Power => p * p,
    };
    // Densities over p_t/e_t by eq. (strategy ratio), for strategies with more of the sensor's vertices …
    let mut others = 0.0;
    let mut ratio = 1.0;
    for (j, d) in path.iter().enumerate().skip(t - 1) {
        ratio *= d.from_sensor / d.from_emitter;
        if ratio == 0.0 || ratio.is_nan() {
            break;
        }
        let discovery = discovery(j + 2);
        others += if discovery > 0.0 {
            power(ratio * discovery)
        } else {
            0.0
        };
    }
    // … and for those with fewer.
    ratio = 1.0;
    for (j, d) in path.iter().enumerate().take(t - 1).rev() {
        ratio *= d.from_emitter / d.from_sensor;
        if ratio == 0.0 || ratio.is_nan() {
            break;
        }
        let discovery = discovery(j + 1);
        others += if discovery > 0.0 {
            power(ratio * discovery)
        } else {
            0.0
        };
    }
    // The weight p_t^β/Σ p^β.
    let own = power(discovery(t));
    own / (own + others)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over all strategies of one path the weights sum to one.
    #[test]
    fn weights_sum_to_one() {
        let density = |a, b, discovery| Density {
            from_sensor: a,
            from_emitter: b,
            discovery,
        };
        let delta = [density(2.0, 3.0, 1.0), density(0.0, 1.0, 0.125)];
        let broad = [
            density(0.5, 1e-3, 1.0),
            density(7.0, 2.0, 0.0),
            density(1e4, 1e-4, 1.0),
            density(3.0, 0.25, 0.1),
        ];
        for path in [&delta[..], &broad[..]] {
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                let strategies = (1..=path.len() + 1).filter(|&t| {
                    path.get(t - 1).is_none_or(|d| d.discovery > 0.0)
                        && path[..t - 1].iter().all(|d| d.from_sensor > 0.0)
                });
                let sum: f64 = strategies.map(|t| weight(heuristic, path, t)).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum}");
            }
        }
    }

    /// Two strategies share in proportion to their densities, or to the squares of these.
    #[test]
    fn two_strategies() {
        let path = [
            Density {
                from_sensor: 1.0,
                from_emitter: 1.0,
                discovery: 0.0,
            },
            Density {
                from_sensor: 3.0,
                from_emitter: 1.0,
                discovery: 0.5,
            },
        ];
        // By connection: 1 · 0.5. By chance: 3.
        assert!((weight(Heuristic::Balance, &path, 2) - 0.5 / 3.5).abs() < 1e-15);
        assert!((weight(Heuristic::Power, &path, 3) - 9.0 / 9.25).abs() < 1e-15);
    }
}
