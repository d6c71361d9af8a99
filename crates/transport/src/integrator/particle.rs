//! Particle tracing (light tracing, Dutré et al. 1993): subpaths from the emitters, with a
//! connection from every vertex to the sensor. Rays from the sensor find emitters in view.
//!
//! Light that reaches the sensor over an edge that connections do not search for is missing, such
//! as a view in a metal mirror. The scene then has a warning.
//!
//! Theory: docs/theory.md#particle.

use super::PathFinds;
use super::bidirectional::{Heuristic, Joining, MergeContents, StrategyContext};
use crate::Spectrum;
use crate::path::{Bounds, LightPath, PathLog, StrategyRates, Workspace, sensor_path};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// The particle tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleTracer {
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and specular events after which Russian roulette begins.
    pub rr_depth: u32,
}

impl Default for ParticleTracer {
    fn default() -> Self {
        ParticleTracer {
            max_depth: None,
            rr_depth: 5,
        }
    }
}

impl ParticleTracer {
    /// Samples the contributions of one particle, and of emitters in view along one sensor ray.
    pub(super) fn sample<L: PathLog>(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channel_pdf: Spectrum,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        finds: PathFinds<L>,
    ) {
        let PathFinds { out, log } = finds;
        let max_depth = self.max_depth.unwrap_or(u32::MAX);
        let bounds = Bounds {
            channel_pdf,
            max_depth,
            rr_depth: self.rr_depth,
            max_vertices: 1,
            weighs: false,
        };
        // Sample an edge from the sensor, for emitters in view, and a light subpath.
        let seen = sensor_path(scene, ray, &bounds, sampler, ws, log);
        let light = LightPath::sample(scene, &bounds, sampler, ws, log);
        let first = out.len();
        let mut joining = Joining {
            context: StrategyContext {
                scene,
                channel_pdf,
                heuristic: Heuristic::default(),
                rates: StrategyRates::default(),
                merging: MergeContents::default(),
                max_depth,
            },
            sampler,
            ws,
            out,
            log,
        };
        // Add the emitter that the sensor's edge hits.
        joining.hits(&seen);
        // Connect each vertex of the light subpath to the sensor.
        if let Some(light) = &light {
            for j in 0..light.subpath.vertices.len() {
                joining.sensed(light, j);
            }
        }
        // No other strategy competes.
        for contribution in &mut out[first..] {
            contribution.weight = 1.0;
        }
    }
}
