//! Reweighted images, in which rare bright samples have less weight, compared with plain ones.

use crate::common::{camera, container, fog, parts, path_tracer, sky, vacuum};
use eikonal::field::Gaussian;
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Film;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;

fn shoot(integrator: Integrator, samples: u64, reweight: bool) -> Film {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let index = Gaussian::new(1.0, 0.3, DVec3::ZERO, 0.3).unwrap();
    // Light close behind fog makes rare bright paths.
    let light = Emitter::Point {
        position: DVec3::new(0.1, 0.0, -1.5),
        intensity: Spectrum::splat(1.0),
    };
    let mut parts = parts(
        vec![ball],
        vec![vacuum(), fog(index, 3.0, 0.95, 0.8)],
        vec![light, sky()],
        camera(DVec3::Z * 2.5, DVec3::ZERO),
    );
    parts.film.width = 5;
    parts.film.height = 5;
    let options = RenderOptions {
        reweight,
        ..RenderOptions::new(integrator, samples, 1)
    };
    let scene = [Scene::new(parts).unwrap()];
    render(&scene, &options, |_| ControlFlow::Continue(())).film
}

fn estimators() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

#[test]
fn the_plain_image_stays_as_it_is_and_levels_add_up_to_it() {
    for integrator in estimators() {
        let with = shoot(integrator, 12, true);
        let without = shoot(integrator, 12, false);
        assert!(with.pixels(0).eq(without.pixels(0)));
        assert_eq!(without.reweighted(), None);
        let outliers = with.outliers(0).unwrap();
        for (i, pixel) in with.pixels(0).enumerate() {
            let (sum, total) = (12.0 * pixel.mean()[0], outliers.total(i)[0]);
            // Rounding of twelve samples, each divided between two levels, and of sums.
            let bound = 36.0 * 2f64.powi(-33);
            assert!((sum - total).abs() <= bound * sum, "{sum} {total}");
        }
    }
}

/// Fraction of the mean that reweighting removes.
fn missing(integrator: Integrator, samples: u64) -> f64 {
    let film = shoot(integrator, samples, true);
    let reweighted = film.reweighted().unwrap();
    let mean = film.mean();
    for (a, b) in reweighted.iter().zip(&mean) {
        assert!(*a >= 0.0 && *a <= b * 1.000_01, "{a} {b}");
    }
    let sum = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>();
    1.0 - sum(&reweighted) / sum(&mean)
}

#[test]
fn less_and_less_is_missing() {
    // Pixels receive few particles, so that `particle` needs more samples. From bdpt nothing is
    // removed at all.
    for (integrator, samples) in estimators().into_iter().zip([8, 64]) {
        let errors = [1, 32].map(|factor| missing(integrator, factor * samples));
        println!("{}: {errors:.4?}", integrator.name());
        assert!(errors[0] > 0.0 && errors[1] < 0.4 * errors[0], "{errors:?}");
    }
}
