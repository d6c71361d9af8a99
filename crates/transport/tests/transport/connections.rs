//! Random choices of connections: whether to connect, and to which of many emitters. A furnace
//! gives the exact mean, because black emitters of radiance 1 look like the sky of radiance 1.
//!
//! False alarms: below 4e-4 for the file. Nineteen means of the path tracer and of strategies are
//! compared with exact ones at |z| < 4.4. Batches of bidirectional path tracing, and variances,
//! have rates of 1e-4.

use crate::common::{Batches, camera, container, fog, glass, mean, parts, shoot, sky, vacuum};
use eikonal::field::{Constant, Gaussian, LinearIndex};
use glam::DVec3;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{Class, Emitter};
use morgana_transport::integrator::{Bdpt, Contribution, Integrator, PathTracer};
use morgana_transport::path::{NeeRates, StrategyRates, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use testkit::Family;
use testkit::batches::{moments, one_sample, welch};

const Z: f64 = 4.4;

fn ball(center: DVec3, radius: f64) -> Sphere {
    Sphere::around(center, radius).unwrap()
}

/// Fog in a ball that bends light, inside a shell of emitters of very different sizes.
fn shell_of_lights(wall: Bsdf) -> Parts {
    let index: eikonal::Field = match wall {
        Bsdf::Null => Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.25).unwrap().into(),
        _ => LinearIndex::new(1.3, DVec3::Y * 0.15, DVec3::ZERO)
            .unwrap()
            .into(),
    };
    let mut objects = vec![container(ball(DVec3::ZERO, 1.0), wall)];
    let mut light = |center: DVec3, radius: f64| {
        let emitter = objects.len() - 1;
        objects.push(Object {
            name: "light".into(),
            bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
            sides: None,
            emitter: Some(emitter),
            ..container(ball(center, radius), Bsdf::Null)
        });
    };
    for i in 0..30 {
        let turn = 2.4 * i as f64;
        let z = (i as f64 + 0.5) / 15.0 - 1.0;
        let around = (1.0 - z * z).sqrt();
        let direction = DVec3::new(around * turn.cos(), around * turn.sin(), z);
        light(direction * 1.6, 0.05 * 1.06f64.powi(i));
    }
    let area = |object| Emitter::Area {
        object,
        radiance: Spectrum::ONE,
    };
    let emitters = (1..objects.len()).map(area).chain([sky()]).collect();
    let sensor = camera(DVec3::new(0.1, 0.3, 0.5), DVec3::ZERO);
    parts(
        objects,
        vec![vacuum(), fog(index, 2.0, 1.0, 0.5)],
        emitters,
        sensor,
    )
}

/// n² at the sensor, which is the radiance that the sensor sees in the furnace.
fn exact(parts: &Parts) -> f64 {
    parts.media[1].index.n(DVec3::new(0.1, 0.3, 0.5)).powi(2)
}

#[test]
fn many_lights() {
    for (wall, seed) in [(Bsdf::Null, 1), (glass(), 2)] {
        let parts = shell_of_lights(wall);
        let exact = exact(&parts);
        let (mean, error) = mean(&shoot(parts, 512, seed));
        println!("{mean} ± {error}, exact {exact}");
        assert!((mean - exact).abs() < Z * error && error < 0.02);
    }
}

#[test]
fn many_lights_from_both_ends() {
    let mut family = Family::new(1e-4);
    for wall in [Bsdf::Null, glass()] {
        let mut parts = shell_of_lights(wall);
        parts.reflections = 1;
        let exact = exact(&parts);
        let bdpt = Integrator::Bdpt(Bdpt::default());
        let each = crate::common::samples(32, 12);
        let all = Batches::new(bdpt, parts, 80);
        let batches: Vec<f64> = (0..12)
            .map(|batch| mean(&all.render(batch, each)).0)
            .collect();
        let m = moments(&batches);
        println!("{} ± {}, exact {exact}", m.mean(), m.standard_error());
        assert!(m.standard_error() < 0.05 * exact);
        family.push("bdpt", one_sample(&batches, exact, 1e-6));
    }
    family.check().unwrap();
}

/// Values of `n` samples of a pixel.
fn values(scene: &Scene, ws: &mut Workspace, seed: u64, n: u64) -> Vec<f64> {
    let path = Integrator::Path(PathTracer::default());
    let sums = |found: &[Contribution]| found.iter().map(|c| c.weighted()[0]).sum();
    samples(path, scene, ws, seed, n)
        .iter()
        .map(|found| sums(found))
        .collect()
}

/// Contributions of a number of samples of a pixel, by an estimator.
fn samples(
    integrator: Integrator,
    scene: &Scene,
    ws: &mut Workspace,
    seed: u64,
    n: u64,
) -> Vec<Vec<Contribution>> {
    let mut found = Vec::new();
    let sample = |i| {
        let mut sampler = Sampler::new(seed, 0, i);
        let ray = scene.sensor().ray(sampler.next_2d(), sampler.next_2d());
        found.clear();
        if let Some(nee_training) = &mut ws.nee_training {
            nee_training.begin();
        }
        integrator.sample(scene, ray, 1, &mut sampler, ws, &mut found);
        found.clone()
    };
    (0..n).map(sample).collect()
}

/// The mean does not depend on the rate of connections.
#[test]
fn any_rate_is_unbiased() {
    for (seed, wall) in [Bsdf::Null, glass()].into_iter().enumerate() {
        let parts = shell_of_lights(wall);
        let exact = exact(&parts);
        let scene = Scene::new(parts).unwrap();
        for (area, far) in [(1.0, 1.0), (0.5, 0.03), (0.02, 0.4), (0.01, 0.01)] {
            let mut ws = Workspace::new(scene.tolerance());
            ws.rates = NeeRates::default()
                .with(Class::Area, [area; 2])
                .with(Class::Sky, [far; 2]);
            let m = moments(&values(&scene, &mut ws, seed as u64, 4000));
            let (mean, error) = (m.mean(), m.standard_error());
            println!("{area} {far}: {mean} ± {error}, exact {exact}");
            assert!((mean - exact).abs() < Z * error && error < 0.05);
        }
    }
}

/// A pilot with all connections predicts the variance with few of them.
#[test]
fn a_pilot_foretells_variances() {
    let mut parts = shell_of_lights(Bsdf::Null);
    parts.media[1].index = Constant::new(1.0).into();
    // In a furnace, light found by hits has no variance.
    for emitter in &mut parts.emitters {
        if let Emitter::Area { radiance, .. } = emitter {
            *radiance *= 8.0;
        }
    }
    let scene = Scene::new(parts).unwrap();
    let mut family = Family::new(1e-4);
    for levels in [[0, 0, 0, 0, 6, 6], [0, 0, 6, 6, 0, 0], [0, 0, 2, 2, 3, 3]] {
        let [mut foretold, mut found] = [Vec::new(), Vec::new()];
        for seed in 0..100 {
            let mut ws = Workspace::new(scene.tolerance());
            ws.nee_training = Some(Box::default());
            values(&scene, &mut ws, 100 + seed, 1000);
            foretold.push(
                ws.nee_training
                    .take()
                    .unwrap()
                    .variance(&levels, &[1.0; 500]),
            );
            ws.rates = NeeRates::at(&levels);
            found.push(moments(&values(&scene, &mut ws, 500 + seed, 1000)).variance());
        }
        let ratio = moments(&foretold).mean() / moments(&found).mean();
        println!(
            "{levels:?}: foretold {:?}, found {:?}: {ratio}",
            moments(&foretold),
            moments(&found)
        );
        family.push("variance", welch(&foretold, &found, 1e-9));
    }
    family.check().unwrap();
}

/// The mean does not depend on the rates of strategies.
#[test]
fn any_rate_of_strategies_is_unbiased() {
    for (seed, wall) in [Bsdf::Null, glass()].into_iter().enumerate() {
        let parts = shell_of_lights(wall);
        let exact = exact(&parts);
        let scene = Scene::new(parts).unwrap();
        for [light, direct, sensed, joined] in [
            [1.0, 1.0, 1.0, 1.0],
            [0.5, 0.5, 0.5, 0.5],
            [0.2, 1.0, 1.0, 0.1],
            [1.0, 0.05, 0.3, 1.0],
        ] {
            let mut ws = Workspace::new(scene.tolerance());
            ws.strategies = StrategyRates {
                light,
                direct,
                sensed,
                joined,
            };
            let bdpt = Integrator::Bdpt(Bdpt::default());
            let found = samples(bdpt, &scene, &mut ws, seed as u64, 3000);
            // Leave out contributions beside the image.
            let counts = |c: &&Contribution| {
                c.image
                    .is_none_or(|place| place.iter().all(|x| (0.0..1.0).contains(x)))
            };
            let value = |found: &Vec<Contribution>| {
                found.iter().filter(counts).map(|c| c.weighted()[0]).sum()
            };
            let values: Vec<f64> = found.iter().map(value).collect();
            let m = moments(&values);
            let (mean, error) = (m.mean(), m.standard_error());
            println!("{:?}: {mean} ± {error}, exact {exact}", ws.strategies);
            assert!((mean - exact).abs() < Z * error && error < 0.05);
        }
    }
}

/// Tests straight edges with a light at either end of the fog: equiangular distances around one
/// light say nothing about the other.
#[test]
fn two_points_add_up_in_thick_fog() {
    let point = |side: f64| Emitter::Point {
        position: DVec3::new(0.0, 0.3, 0.6 * side),
        intensity: Spectrum::ONE,
    };
    let scene = |emitters| {
        let objects = vec![container(ball(DVec3::ZERO, 1.0), Bsdf::Null)];
        let media = vec![vacuum(), fog(Constant::new(1.0), 3.0, 0.8, 0.3)];
        parts(
            objects,
            media,
            emitters,
            camera(DVec3::Z * 3.0, DVec3::ZERO),
        )
    };
    let count = crate::common::samples(32768, 12288);
    let together = mean(&shoot(scene(vec![point(1.0), point(-1.0)]), count, 5));
    let [a, b] = [1.0, -1.0].map(|side| mean(&shoot(scene(vec![point(side)]), count, 6)));
    println!("{together:?} {a:?} {b:?}");
    let error = (together.1.powi(2) + a.1.powi(2) + b.1.powi(2)).sqrt();
    assert!((together.0 - a.0 - b.0).abs() < Z * error && error < 0.02 * together.0);
}

/// Tests many point lights in fog: each edge and each vertex chooses one. The reference sums over
/// all lights one by one.
#[test]
fn many_points_add_up() {
    let point = |i: usize| Emitter::Point {
        position: DVec3::new(i as f64 * 0.16 - 0.8, 0.3 - 0.05 * i as f64, 0.1),
        intensity: Spectrum::splat(1.0 + (3 * i % 4) as f64),
    };
    let scene = |emitters| {
        let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
        let objects = vec![container(ball(DVec3::ZERO, 1.0), Bsdf::Null)];
        let media = vec![vacuum(), fog(index, 1.0, 0.8, 0.3)];
        parts(
            objects,
            media,
            emitters,
            camera(DVec3::Z * 3.0, DVec3::ZERO),
        )
    };
    let together = mean(&shoot(scene((0..10).map(point).collect()), 2048, 5));
    let alone = (0..10).map(|i| mean(&shoot(scene(vec![point(i)]), 512, 10 + i as u64)));
    let alone = alone.fold((0.0, 0.0), |(s, v), (m, e)| (s + m, v + e * e));
    println!("{together:?} {alone:?}");
    let error = (together.1 * together.1 + alone.1).sqrt();
    assert!((together.0 - alone.0).abs() < Z * error && error < 0.03 * alone.0);
}
