//! Data about a group of channels that pilots determine before its first sample.

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
    /// Adjoint estimate: expected further contribution of paths.
    pub(super) adjoint: AdjointEstimate,
    /// First-vertex techniques of paths.
    pub(super) first_vertex: FirstVertexTechniques,
    /// Radius of the first photon map, or of the first merging; zero if there is none.
    pub(super) radius: f64,
    /// Accuracy of rays.
    pub(super) accuracy: RayAccuracy,
}

impl Prepared {
    /// Creates the data before any pilot. The accuracy is the scene's.
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

    /// Returns the lowest accuracy of rays in all groups.
    pub(super) fn least_accuracy(groups: &[Prepared], scene: &Scene) -> RayAccuracy {
        let least = |a: RayAccuracy, b: RayAccuracy| RayAccuracy {
            tolerance: a.tolerance.max(b.tolerance),
            effect: a.effect.max(b.effect),
        };
        let all = groups.iter().map(|p| p.accuracy);
        all.fold(RayAccuracy::of(scene), least)
    }

    /// Returns the first-vertex techniques that any of the groups uses.
    pub(super) fn first_vertex_of_any(groups: &[Prepared]) -> FirstVertexTechniques {
        let all = || groups.iter().map(|p| p.first_vertex);
        FirstVertexTechniques {
            forced_collisions: all().map(|b| b.forced_collisions).max().unwrap_or(0),
            splitting: all().any(|b| b.splitting),
        }
    }
}

/// Accuracy of the rays of a render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RayAccuracy {
    /// Relative position error per unit of arc length: see [`Tolerance`](eikonal::Tolerance).
    pub tolerance: f64,
    /// Maximum effect of the looser tolerance on a pixel's mean, in standard deviations of one
    /// sample: a mean over the image, estimated by a pilot. Zero if the tolerance is the scene's.
    pub effect: f64,
}

impl RayAccuracy {
    /// Returns the accuracy that a scene requests.
    pub(super) fn of(scene: &Scene) -> Self {
        RayAccuracy {
            tolerance: scene.tolerance().get(),
            effect: 0.0,
        }
    }

    /// Returns the effect in standard errors of a pixel of `samples` samples.
    pub fn effect_beside_noise(&self, samples: u64) -> f64 {
        self.effect * (samples as f64).sqrt()
    }
}
