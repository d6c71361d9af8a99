//! Error bounds of progressive photon mapping, and stopping by them.

use crate::common::shoot_by;
use crate::photons::support::{InBox, boxed, photons};
use crate::photons::{FAMILY, long};
use morgana_transport::integrator::{Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::render::{Measure, RenderOptions, Target, render};
use morgana_transport::{Film, Scene};
use testkit::z_test::p_value;

const SAMPLES: u64 = 32;

fn progressive() -> Integrator {
    Integrator::Photon(PhotonMapping {
        progressive: true,
        max_depth: Some(2),
        ..photons(1000, 0.3, PhotonQuery::Beam)
    })
}

/// Computes P(X ≤ k) of a binomial distribution.
fn binomial(n: u64, k: u64, p: f64) -> f64 {
    let mut term = (1.0 - p).powi(n as i32);
    let mut sum = term;
    for i in 0..k {
        term *= (n - i) as f64 / (i + 1) as f64 * p / (1.0 - p);
        sum += term;
    }
    sum
}

/// In every pixel the bound holds in at least 95 % of independent renders, as far as their number
/// can tell, and over all pixels in the long run. Without its term for the bias it does not.
#[test]
fn bounds_hold_as_often_as_they_say() {
    let repeats = if long() { 100 } else { 20 };
    let truth = InBox::pixels();
    let mut kept = vec![[0, 0]; truth.len()];
    for seed in 0..repeats {
        let rendering = shoot_by(progressive(), boxed(), SAMPLES, 100 + seed);
        let film = &rendering.film;
        let bounds = rendering.debiased.as_ref().unwrap().bound(film);
        let noise = film.variance().into_iter().map(|v| 1.96 * v.sqrt());
        let errors = film.mean().into_iter().zip(&truth);
        let errors = errors.map(|(v, t)| (f64::from(v) - t).abs() as f32);
        for (((kept, error), bound), noise) in kept.iter_mut().zip(errors).zip(bounds).zip(noise) {
            kept[0] += u64::from(error <= bound);
            kept[1] += u64::from(error <= noise);
        }
    }
    println!("of {repeats}, with bias and by noise alone: {kept:?}");
    let [p, p_noise] = [0, 1].map(|k| {
        let least = kept.iter().map(|kept| kept[k]).min().unwrap();
        binomial(repeats, least, 0.95)
    });
    assert!(p > FAMILY / truth.len() as f64, "{p:e}");
    let held: u64 = kept.iter().map(|kept| kept[0]).sum();
    let share = held as f64 / (repeats * truth.len() as u64) as f64;
    println!("held in {share}");
    assert!(!long() || share >= 0.95, "{share}");
    assert!(p_noise < FAMILY / truth.len() as f64, "no power");
}

/// A render with a target error ends once it reaches the target.
#[test]
fn renders_stop_at_their_error() {
    let mut options = RenderOptions::new(progressive(), 100_000, 9);
    options.target = Some(Target {
        error: 0.05,
        measure: Measure::Image,
    });
    let scene = Scene::new(boxed()).unwrap();
    let rendering = render(&[scene], &options, |_| std::ops::ControlFlow::Continue(()));
    assert!(rendering.reached && rendering.samples >= 32);
    assert!(rendering.error(Measure::Image) <= 0.05);
    let truth = InBox::pixels().iter().sum::<f64>() / 16.0;
    let difference = (rendering.film.summary().0 - truth) / truth;
    println!("{} samples, off by {difference}", rendering.samples);
    // The bias is within the error with certainty; the noise is within 3.3 times the error except
    // in one of a thousand cases.
    assert!(p_value(3.3) < FAMILY);
    assert!(difference.abs() < 3.3 * 0.05);
}

/// The progressive mean converges: with more samples both bias and noise decrease.
#[test]
fn errors_shrink() {
    let error = |samples| {
        let rendering = shoot_by(progressive(), boxed(), samples, 11);
        let debiased = rendering.debiased.unwrap();
        let film: &Film = &rendering.film;
        (debiased.bias(film).abs(), debiased.film.summary().1)
    };
    let (few, many) = (error(16), error(256));
    println!("{few:?} {many:?}");
    // Squared radii fall as N^(−1/3) and so does their mean, up to 3/2 of the last: 0.44 from 16 to
    // 256. Noise falls by about as much.
    assert!(many.0 < 0.6 * few.0 && many.1 < 0.6 * few.1);
}
