//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994) over curved
//! edges. A subpath from the sensor and a subpath from an emitter are connected in every way. Each
//! path is weighted over all strategies that can sample it.
//!
//! A strategy (s, t) takes s vertices from the emitter and t from the sensor. With s = 0 the sensor
//! subpath hits the emitter. With s = 1 or t = 1 the end at the emitter or at the sensor is sampled
//! anew. Only hits find an emitter in view. The sensor does not see delta emitters directly,
//! because their image is a point.
//!
//! Strategies are used with probabilities that a pilot finds
//! ([`StrategyRates`](crate::path::StrategyRates)).
//!
//! Theory: docs/theory.md#bidirectional.

use super::PathFinds;
use super::bidirectional::{Connections, Heuristic, Joining, MergeContents, StrategyContext};
use crate::Spectrum;
use crate::path::{Bounds, LightPath, PathLog, Workspace, sensor_path};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// The bidirectional path tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bdpt {
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and specular events of a subpath after which Russian roulette begins.
    pub rr_depth: u32,
    /// Heuristic that weights strategies.
    pub heuristic: Heuristic,
    /// Selection of vertices to connect.
    pub connections: Connections,
}

impl Default for Bdpt {
    fn default() -> Self {
        Bdpt {
            max_depth: None,
            rr_depth: 5,
            heuristic: Heuristic::default(),
            connections: Connections::default(),
        }
    }
}

impl Bdpt {
    /// Samples the contributions of one sensor subpath and one emitter subpath.
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
            max_vertices: usize::MAX,
            weighs: true,
        };
        // Sample a subpath from the sensor and, with some probability, one from an emitter.
        let from_sensor = sensor_path(scene, ray, &bounds, sampler, ws, log);
        let before = ws.stats().cost();
        // Planted error "subpaths from emitters with the points of those from the sensor", found by morgana-transport/transport::replicates::so_they_are_with_subpaths_from_both_ends:
        // let from_emitter = emitter_path(scene, &bounds, sampler, ws, log);
        let from_emitter = sampler.independently(|s| emitter_path(scene, &bounds, s, ws, log));
        ws.strategy_work.light += ws.stats().cost() - before;
        // Connect them in every way.
        let mut joining = Joining {
            context: StrategyContext {
                scene,
                channel_pdf,
                heuristic: self.heuristic,
                rates: ws.strategies,
                merging: MergeContents::default(),
                max_depth,
            },
            sampler,
            ws,
            out,
            log,
        };
        joining.all(&from_sensor, from_emitter.as_ref(), self.connections);
    }
}

/// Samples a subpath from an emitter, with the probability with which strategies use one.
fn emitter_path(
    scene: &Scene,
    bounds: &Bounds,
    sampler: &mut Sampler,
    ws: &mut Workspace,
    log: &mut impl PathLog,
) -> Option<LightPath> {
    let probability = ws.strategies.light;
    let is_wanted = probability >= 1.0 || sampler.next_1d() < probability;
    ws.particle_balance.is_void = !is_wanted;
    if !is_wanted {
        return None;
    }
    LightPath::sample(scene, bounds, sampler, ws, log)
}
