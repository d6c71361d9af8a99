//! Costs of samples in renders of the lens.

use crate::clock::median;
use crate::common::lens;
use cpu_time::ProcessTime;
use morgana_transport::film::Filter;
use morgana_transport::integrator::{Bdpt, Integrator, PathTracer};
use morgana_transport::render::{RenderOptions, Rendering};
use morgana_transport::scene::FilmSpec;
use morgana_transport::{Scene, Spectrum};

const ROUNDS: usize = 5;
const SIDE: usize = 32;
/// Samples per pixel of two renders; the difference of their times excludes the pilot.
const SAMPLES: [u64; 2] = [4, 20];
/// Samples per pixel for the variance, which comes in part from rare bright samples.
const VARIANCE_SAMPLES: u64 = 64;
const DEPTH: u32 = 8;

pub fn table() {
    let mut parts = lens::scene();
    parts.film = FilmSpec {
        width: SIDE,
        height: SIDE,
        channels: 1,
        group_size: Spectrum::CHANNELS,
        filter: Filter::Box,
        window: None,
    };
    let scene = Scene::new(parts).expect("the scene is valid");
    let path = Integrator::Path(PathTracer {
        max_depth: Some(DEPTH),
        ..PathTracer::default()
    });
    let bdpt = Integrator::Bdpt(Bdpt {
        max_depth: Some(DEPTH),
        ..Bdpt::default()
    });
    println!("\nsamples of renders of the lens, depth {DEPTH}");
    println!(
        "{:6} {:>9} {:>8} {:>8} {:>8} {:>10} {:>12} {:>10} {:>10} {:>8} {:>10}",
        "",
        "tolerance",
        "µs",
        "evals",
        "shots",
        "variance",
        "time × var.",
        "certified",
        "searches",
        "q",
        "mean"
    );
    let rows = [(path, false), (bdpt, false), (path, true), (bdpt, true)];
    let mut seconds: Vec<Vec<f64>> = vec![Vec::new(); rows.len()];
    for _ in 0..ROUNDS {
        for (row, seconds) in rows.iter().zip(&mut seconds) {
            let times = SAMPLES.map(|samples| {
                let start = ProcessTime::now();
                render(&scene, *row, samples, 1);
                start.elapsed().as_secs_f64()
            });
            seconds.push((times[1] - times[0]) / pixels(SAMPLES[1] - SAMPLES[0]));
        }
    }
    for (row, seconds) in rows.iter().zip(seconds) {
        print(&scene, *row, median(seconds));
    }
}

fn pixels(samples: u64) -> f64 {
    (SIDE * SIDE) as f64 * samples as f64
}

/// An estimator, and true if a pilot chooses the tolerance.
type Row = (Integrator, bool);

fn print(scene: &Scene, row: Row, seconds: f64) {
    let [few, more] = SAMPLES.map(|samples| render(scene, row, samples, 1));
    let many = render(scene, row, VARIANCE_SAMPLES, 2);
    let work = more.stats.work.evaluations - few.stats.work.evaluations;
    let shots = more.stats.work.shots - few.stats.work.shots;
    let counts = [few.stats.connections, more.stats.connections];
    let per = |count: u64| count as f64 / pixels(SAMPLES[1] - SAMPLES[0]);
    let variance = relative_variance(&many);
    println!(
        "{:6} {:9.0e} {:8.2} {:8.1} {:8.2} {:10.2} {:12.1} {:10.2} {:10.3} {:8.3} {:10.5}",
        row.0.name(),
        many.accuracy.tolerance,
        1e6 * seconds,
        per(work),
        per(shots),
        variance,
        1e6 * seconds * variance,
        per(counts[1].certified - counts[0].certified),
        per(counts[1].searches - counts[0].searches),
        many.search,
        many.film.summary().0,
    );
}

/// Returns the mean over all pixels of the relative variance of a sample. It is the variance
/// divided by the squared brightness of the pixel plus the square of a twentieth of the image's
/// mean.
fn relative_variance(rendering: &Rendering) -> f64 {
    let mean = rendering.film.mean();
    let variance = rendering.film.variance();
    let floor = (0.05 * rendering.film.summary().0).powi(2);
    let relative = |(mean, variance): (&f32, &f32)| {
        f64::from(*variance) * rendering.samples as f64 / (f64::from(*mean).powi(2) + floor)
    };
    mean.iter().zip(&variance).map(relative).sum::<f64>() / mean.len() as f64
}

fn render(scene: &Scene, row: Row, samples: u64, seed: u64) -> Rendering {
    let (integrator, loosens_tolerance) = row;
    scene.render(&RenderOptions {
        loosens_tolerance,
        ..RenderOptions::new(integrator, samples, seed)
    })
}
