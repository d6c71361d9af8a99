//! Data about a group of channels that pilots find before its first sample.

use crate::path::{AdjointEstimate, FirstVertexTechniques, NeeRates, StrategyRates};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// Results of the pilots of a group of channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prepared {
    /// Probability with which connections are searched for further branches.
    pub(super) search: f64,
    /// Probabilities with which vertices are connected to emitters.
    pub(super) rates: NeeRates,
    /// Probabilities with which strategies of bidirectional estimators are used.
    pub(super) strategies: StrategyRates,
    /// What paths may still bring.
    pub(super) adjoint: AdjointEstimate,
    /// How paths begin.
    pub(super) first_vertex: FirstVertexTechniques,
    /// Radius of the first photon map, or of the first merging; zero if there is none.
    pub(super) radius: f64,
    /// How accurate rays are.
    pub(super) accuracy: RayAccuracy,
}

impl Prepared {
    /// Starts before any pilot: with the accuracy that the scene asks for.
    pub(super) fn new(scene: &Scene) -> Self {
        Prepared {
            search: 1.0,
            rates: NeeRates::default(),
            strategies: StrategyRates::default(),
            adjoint: AdjointEstimate::default(),
            first_vertex: FirstVertexTechniques::default(),
            radius: 0.0,
            accuracy: RayAccuracy::of(scene),
        }
    }

    /// Least accuracy of rays in all groups.
    pub(super) fn least_accuracy(groups: &[Prepared], scene: &Scene) -> RayAccuracy {
        let least = |a: RayAccuracy, b: RayAccuracy| RayAccuracy {
            tolerance: a.tolerance.max(b.tolerance),
            effect: a.effect.max(b.effect),
        };
        let all = groups.iter().map(|p| p.accuracy);
        all.fold(RayAccuracy::of(scene), least)
    }

    /// Techniques at the first vertices of paths that are used in any of the groups.
    pub(super) fn first_vertex_of_any(groups: &[Prepared]) -> FirstVertexTechniques {
        let all = || groups.iter().map(|p| p.first_vertex);
        FirstVertexTechniques {
            forced_collisions: all().map(|b| b.forced_collisions).max().unwrap_or(0),
            splitting: all().any(|b| b.splitting),
        }
    }
}

/// How accurate the rays of a render are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RayAccuracy {
    /// Relative position error per unit of arc length: see [`Tolerance`](eikonal::Tolerance).
    pub tolerance: f64,
    /// What a looser tolerance than the scene's does to a pixel's mean, at most, in standard deviations of one sample: by a pilot, a mean over
    /// the image. Zero if the tolerance is that of the scene.
    pub effect: f64,
}

impl RayAccuracy {
    /// Accuracy that a scene asks for.
    pub(super) fn of(scene: &Scene) -> Self {
        RayAccuracy {
            tolerance: scene.tolerance().get(),
            effect: 0.0,
        }
    }

    /// The effect in standard errors of a pixel of so many samples.
    pub fn effect_beside_noise(&self, samples: u64) -> f64 {
        self.effect * (samples as f64).sqrt()
    }
}
