//! Second moment of a pixel's samples, compared with single samples: exactly for samples of equal
//! seed, and by z for other seeds, at a false-alarm rate of 1e-3.

use crate::common::{camera, container, fog, parts, path_tracer, sky, vacuum};
use eikonal::field::Gaussian;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::film::Film;
use morgana_transport::integrator::{Bdpt, Integrator};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::sampling::Replicates;
use morgana_transport::shape::Sphere;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

const RATE: f64 = 1e-3;
const PIXELS: usize = 16;

fn scene() -> Scene {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(index, 2.0, 0.9, 0.3)];
    let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
    let parts = parts(vec![ball], media, vec![sky()], sensor);
    Scene::new(parts).unwrap()
}

fn film(scene: &Scene, options: &RenderOptions) -> Film {
    let scenes = std::slice::from_ref(scene);
    render(scenes, options, |_| ControlFlow::Continue(())).film
}

/// Second moment by its definition, from renders of one sample, or replicate, each.
fn by_hand(scene: &Scene, whole: &RenderOptions, size: u64) -> Vec<f64> {
    let mut squares = [0.0; PIXELS];
    let scores = whole.samples / size;
    for score in 0..scores {
        let one = RenderOptions {
            first: whole.first + score * size,
            samples: size,
            ..*whole
        };
        let film = film(scene, &one);
        for (i, sum) in squares.iter_mut().enumerate() {
            *sum += f64::from(film.mean_at(None, 0, i)).powi(2);
        }
    }
    squares.map(|sum| sum / scores as f64).into()
}

#[track_caller]
fn agree(found: &Film, expected: &[f64]) {
    for (i, expected) in expected.iter().enumerate() {
        let found = f64::from(found.second_moment_at(0, i));
        // Means of single samples are rounded to single precision.
        let error = (found - expected).abs() / expected;
        assert!(error < 1e-6, "pixel {i}: {found} instead of {expected}");
    }
}

#[test]
fn it_is_the_mean_of_squares() {
    let scene = scene();
    for integrator in [path_tracer(), Integrator::Bdpt(Bdpt::default())] {
        let options = RenderOptions::new(integrator, 8, 3);
        let found = film(&scene, &options);
        agree(&found, &by_hand(&scene, &options, 1));
        // The variance of the mean of n samples is the second moment, less the squared mean, over n
        // − 1.
        for i in 0..PIXELS {
            let [mean, variance] =
                [found.mean_at(None, 0, i), found.variance_at(None, 0, i)].map(f64::from);
            let second = f64::from(found.second_moment_at(0, i));
            assert!((second - (mean * mean + 7.0 * variance)).abs() < 1e-5 * second);
        }
    }
}

/// The second moment of replicates is the second moment of their means.
#[test]
fn replicates_count_as_one() {
    let scene = scene();
    let options = RenderOptions {
        replicates: Replicates::new(8).unwrap(),
        ..RenderOptions::new(path_tracer(), 64, 3)
    };
    agree(&film(&scene, &options), &by_hand(&scene, &options, 8));
}

/// Second moments of long renders agree with squares of single samples by other seeds, within their
/// scatter.
#[test]
fn other_seeds_agree() {
    let scene = scene();
    let long = film(&scene, &RenderOptions::new(path_tracer(), 1024, 1));
    let (mut sums, mut squares) = ([0.0; PIXELS], [0.0; PIXELS]);
    let seeds = 150;
    for seed in 0..seeds {
        let one = film(&scene, &RenderOptions::new(path_tracer(), 1, 1000 + seed));
        for i in 0..PIXELS {
            let square = f64::from(one.mean_at(None, 0, i)).powi(2);
            sums[i] += square;
            squares[i] += square * square;
        }
    }
    let n = seeds as f64;
    let z = |i: usize| {
        let mean = sums[i] / n;
        let variance = (squares[i] / n - mean * mean) / (n - 1.0);
        let expected = f64::from(long.second_moment_at(0, i));
        // The long render has about seven times as many samples, and an error of its own.
        (mean - expected) / (variance * (1.0 + n / 1024.0)).sqrt()
    };
    let zs: Vec<f64> = (0..PIXELS).map(z).collect();
    max_abs_z(&zs, RATE).unwrap();
}
