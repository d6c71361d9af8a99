//! Reconstruction filters: each sample counts in all pixels under the filter, with weights that add
//! up to one.
//!
//! An even image stays even with every filter, without any error. Stated errors of pixels and of
//! the image's mean are compared with the spread over forty seeds, at a family-wise false-alarm rate
//! of 1e-3.

use crate::common::{camera, container, parts, path_tracer, sky, vacuum};
use glam::DVec3;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::film::{Film, Filter, SignedFilter};
use morgana_transport::integrator::{Bdpt, Integrator};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::sampling::Replicates;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use rayon::prelude::*;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

const SEEDS: u64 = 40;
const FALSE_ALARM: f64 = 1e-3;

fn filters() -> [Filter; 8] {
    [
        Filter::Box,
        Filter::Tent { radius: 0.4 },
        Filter::Tent { radius: 1.0 },
        Filter::Gaussian { stddev: 0.3 },
        Filter::Gaussian { stddev: 0.5 },
        Filter::Signed(SignedFilter::cubic(1.0 / 3.0, 1.0 / 3.0)),
        Filter::Signed(SignedFilter::cubic(0.0, 0.5)),
        Filter::Signed(SignedFilter::lanczos(3)),
    ]
}

fn film_of(parts: Parts, integrator: Integrator, replicates: Replicates, seed: u64) -> Film {
    let scene = Scene::new(parts).unwrap();
    let options = RenderOptions {
        replicates,
        ..RenderOptions::new(integrator, 16, seed)
    };
    render(&[scene], &options, |_| ControlFlow::Continue(())).film
}

#[test]
fn an_even_sky_stays_even() {
    for filter in filters() {
        let mut parts = parts(
            Vec::new(),
            vec![vacuum()],
            vec![sky()],
            camera(DVec3::ZERO, DVec3::Z),
        );
        (parts.film.width, parts.film.height) = (7, 5);
        parts.film.filter = filter;
        let film = film_of(parts, path_tracer(), Replicates::SINGLE, 1);
        assert!(film.mean().iter().all(|v| *v == 1.0), "{filter:?}");
        assert!(film.variance().iter().all(|v| *v == 0.0), "{filter:?}");
    }
}

/// A bright ball whose edge and whose light on a larger ball make noise.
fn balls(filter: Filter) -> Parts {
    let ball = |center, radius, reflectance, emitter| Object {
        emitter,
        ..container(
            Sphere::around(center, radius).unwrap(),
            Bsdf::Diffuse(Diffuse::new(Spectrum::splat(reflectance)).unwrap()),
        )
    };
    let objects = vec![
        Object {
            sides: None,
            ..ball(DVec3::new(-0.2, 0.1, 0.0), 0.7, 0.8, None)
        },
        Object {
            sides: None,
            ..ball(DVec3::new(0.7, 0.5, 0.6), 0.2, 0.0, Some(0))
        },
    ];
    let light = Emitter::Area {
        object: 1,
        radiance: Spectrum::splat(3.0),
    };
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    let mut parts = parts(objects, vec![vacuum()], vec![light], sensor);
    (parts.film.width, parts.film.height) = (24, 18);
    parts.film.filter = filter;
    parts
}

/// Means of pixels and their variances, the mean of the image, and its error.
type Picture = (Vec<f32>, Vec<f32>, (f64, f64));

/// Logarithms of stated variances over the variances among some pictures: of the sum over pixels,
/// and of the image's mean.
fn ratios(pictures: &[&Picture]) -> [f64; 2] {
    let count = pictures.len() as f64;
    let scatter = |values: &mut dyn Iterator<Item = f64>| {
        let (mut sum, mut squares) = (0.0, 0.0);
        values.for_each(|v| {
            sum += v;
            squares += v * v;
        });
        (squares - sum * sum / count) / (count - 1.0)
    };
    let of_pixel = |i: usize| scatter(&mut pictures.iter().map(|(mean, _, _)| f64::from(mean[i])));
    let found: f64 = (0..pictures[0].0.len()).map(of_pixel).sum();
    let variances = pictures.iter().flat_map(|(_, variance, _)| variance);
    let stated = variances.map(|v| f64::from(*v)).sum::<f64>() / count;
    let found_mean = scatter(&mut pictures.iter().map(|(_, _, (mean, _))| *mean));
    let squares = pictures.iter().map(|(_, _, (_, error))| error * error);
    let stated_mean = squares.sum::<f64>() / count;
    [(stated / found).ln(), (stated_mean / found_mean).ln()]
}

/// The ratios over their standard errors by the jackknife over seeds.
fn zs(pictures: &[Picture]) -> [f64; 2] {
    let all: Vec<&Picture> = pictures.iter().collect();
    let whole = ratios(&all);
    let without = (0..all.len()).map(|k| {
        let mut rest = all.clone();
        rest.remove(k);
        ratios(&rest)
    });
    let without: Vec<[f64; 2]> = without.collect();
    let n = without.len() as f64;
    [0, 1].map(|i| {
        let mean = without.iter().map(|r| r[i]).sum::<f64>() / n;
        let scatter: f64 = without.iter().map(|r| (r[i] - mean).powi(2)).sum();
        let error = ((n - 1.0) / n * scatter).sqrt();
        println!("  ratio {:.3} ± {error:.3}", whole[i].exp());
        whole[i] / error
    })
}

#[test]
fn stated_errors_are_the_spread_over_seeds() {
    let (gauss, lanczos) = (
        Filter::Gaussian { stddev: 0.5 },
        Filter::Signed(SignedFilter::lanczos(3)),
    );
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let cases = [
        (gauss, path_tracer(), Replicates::SINGLE),
        (gauss, path_tracer(), Replicates::new(8).unwrap()),
        (lanczos, path_tracer(), Replicates::SINGLE),
        (Filter::Tent { radius: 1.0 }, bdpt, Replicates::SINGLE),
    ];
    let found = cases.map(|(filter, integrator, replicates)| {
        println!("{filter:?} {integrator:?} {replicates:?}");
        let picture = |seed| {
            let film = film_of(balls(filter), integrator, replicates, seed);
            (film.mean(), film.variance(), film.summary())
        };
        zs(&(0..SEEDS)
            .into_par_iter()
            .map(picture)
            .collect::<Vec<Picture>>())
    });
    max_abs_z(found.as_flattened(), FALSE_ALARM).unwrap();
}
