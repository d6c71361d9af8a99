//! Films that separate light by optical length, bounces and emitters.
//!
//! Statistical tests compare means over independent batches by Welch's t-test, at a false-alarm
//! rate of 1e-3 for each test over all its comparisons.

use crate::common::path_tracer;

mod estimators;
mod lengths;
mod sums;

use morgana_transport::Bins;
use morgana_transport::Scene;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer};
use morgana_transport::render::{RenderOptions, Rendering, render};
use morgana_transport::scene::Parts;
use std::ops::ControlFlow;

/// All estimators with their defaults.
fn estimators() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

/// All estimators with a longest path of `max_depth`.
pub fn bounded(max_depth: u32) -> [Integrator; 3] {
    let max_depth = Some(max_depth);
    [
        Integrator::Path(PathTracer {
            max_depth,
            ..PathTracer::default()
        }),
        Integrator::Particle(ParticleTracer {
            max_depth,
            ..ParticleTracer::default()
        }),
        Integrator::Bdpt(Bdpt {
            max_depth,
            ..Bdpt::default()
        }),
    ]
}

fn bins(min: f64, width: f64, count: usize) -> Option<Bins> {
    let max = min + width * count as f64;
    Some(Bins { min, max, count })
}

/// Renders with a decomposition of light.
fn shoot(
    (integrator, decomposition): (Integrator, Decomposition),
    parts: &Parts,
    samples: u64,
    seed: u64,
) -> Rendering {
    let scene = [Scene::new(parts.clone()).unwrap_or_else(|p| panic!("{p:?}"))];
    let options = RenderOptions {
        decomposition,
        ..RenderOptions::new(integrator, samples, seed)
    };
    render(&scene, &options, |_| ControlFlow::Continue(()))
}

/// Means over the image, one per layer.
fn means(rendering: &Rendering) -> Vec<f64> {
    let layers = rendering.film.layers().unwrap().decomposition().layers();
    let mean = |layer| rendering.film.layer_summary(layer).0;
    (0..layers).map(mean).collect()
}
