//! Scaling of renders with threads, and cost of a graded index.
//!
//! ```text
//! cargo bench -p morgana-transport
//! ```
//!
//! Each row renders one scene with one thread and with two, in turn, and the same scene with a
//! constant index. Ratios are medians over the rounds of times within one round.
//!
//! The speed-up by two threads is compared with the speed-up that the machine offers at that
//! moment. This is the ratio for an arithmetic loop without shared data, timed in the same round.
//! On two idle cores the loop reaches 2, and the goal of 1.9 for renders is a fraction of 0.95. On
//! a busy machine both ratios fall.

#[path = "../tests/transport/common/mod.rs"]
mod common;

use common::{camera, container, fog, glass, parts, sky, vacuum};
use eikonal::Field;
use eikonal::field::{Bspline, Constant, Gaussian, Placement};
use eikonal::{Aabb, Tolerance};
use glam::DVec3;
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Filter;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::scene::FilmSpec;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::time::Instant;

const ROUNDS: usize = 11;
const SIDE: usize = 64;
const SAMPLES: u64 = 4;

fn main() {
    let pools = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().expect("two threads can be started")
    });
    println!(
        "{:34} {:>10} {:>10} {:>10} {:>8} {:>13}",
        "", "paths/s", "2 threads", "arithmetic", "share", "cost of bend"
    );
    let light = Emitter::Point {
        position: DVec3::new(0.3, 0.5, -0.2),
        intensity: Spectrum::ONE,
    };
    row("bump in fog under the sky", &pools, bump(), sky());
    row("grid 64³ in fog under the sky", &pools, grid(), sky());
    row("bump in fog, light inside", &pools, bump(), light.clone());
    row("grid 64³ in fog, light inside", &pools, grid(), light);
}

fn bump() -> Field {
    Gaussian::new(1.33, 0.05, DVec3::ZERO, 0.4).unwrap().into()
}

/// The bump, sampled on a grid.
fn grid() -> Field {
    let cube = Aabb::new(DVec3::splat(-1.05), DVec3::splat(1.05));
    let field = bump();
    let grid = Bspline::from_fn([64; 3], cube, Placement::Nodes, |x| field.n(x));
    grid.unwrap().into()
}

/// A glass ball of fog.
fn scene(index: Field, emitter: Emitter) -> Scene {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let mut parts = parts(
        vec![container(ball, glass())],
        vec![vacuum(), fog(index, 2.0, 0.9, 0.7)],
        vec![emitter],
        camera(DVec3::Z * 3.5, DVec3::ZERO),
    );
    parts.film = FilmSpec {
        width: SIDE,
        height: SIDE,
        channels: 1,
        group_size: Spectrum::CHANNELS,
        filter: Filter::Box,
        window: None,
    };
    parts.tolerance = Tolerance::new(1e-5);
    Scene::new(parts).expect("the scene is valid")
}

fn row(name: &str, pools: &[ThreadPool; 2], index: Field, emitter: Emitter) {
    let graded = [scene(index, emitter.clone())];
    let straight = [scene(Constant::new(1.33).into(), emitter)];
    let [mut one, mut speed_up, mut ideal, mut share, mut bend] = [const { Vec::new() }; 5];
    for round in 0..=ROUNDS {
        let arithmetic = pools.each_ref().map(arithmetic);
        let [alone, shared] = pools.each_ref().map(|pool| seconds(pool, &graded));
        let plain = seconds(&pools[0], &straight);
        // The first round warms up.
        if round > 0 {
            one.push(alone);
            speed_up.push(alone / shared);
            ideal.push(arithmetic[0] / arithmetic[1]);
            share.push(alone / shared / (arithmetic[0] / arithmetic[1]));
            bend.push(alone / plain);
        }
    }
    let paths = (SIDE * SIDE) as f64 * SAMPLES as f64;
    println!(
        "{name:34} {:10.3e} {:10.2} {:10.2} {:8.2} {:13.2}",
        paths / median(one),
        median(speed_up),
        median(ideal),
        median(share),
        median(bend),
    );
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the time in seconds of independent arithmetic tasks, as many as a render has.
fn arithmetic(pool: &ThreadPool) -> f64 {
    let task = |seed: u64| {
        let mut x = black_box(seed as f64 * 1e-3);
        for _ in 0..300_000 {
            x = x * 0.999_999 + 1e-6;
        }
        black_box(x);
    };
    let start = Instant::now();
    pool.install(|| (0..256u64).into_par_iter().for_each(task));
    start.elapsed().as_secs_f64()
}

fn seconds(pool: &ThreadPool, scene: &[Scene]) -> f64 {
    let options = RenderOptions::new(Integrator::Path(PathTracer::default()), SAMPLES, 1);
    let start = Instant::now();
    let rendering = pool.install(|| render(scene, &options, |_| ControlFlow::Continue(())));
    assert_eq!(rendering.samples, SAMPLES);
    start.elapsed().as_secs_f64()
}
