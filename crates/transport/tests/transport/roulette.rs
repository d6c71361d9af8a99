//! Russian roulette by the expected further contribution of paths.
//!
//! False alarms: three means are compared at a family-wise rate of 1e-4.

use crate::common::{camera, container, fog, parts, sky, vacuum};
use eikonal::field::{Constant, Gaussian};
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::path::{AdjointEstimate, AdjointTraining, PathTally, Start, Workspace};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
use testkit::Family;
use testkit::batches::{moments, one_sample};

/// Trains an estimate on paths that continue at `x` with unit throughput, contribute `brought(x)`,
/// and cost unit work each.
fn learn(brought: impl Fn(DVec3) -> f64) -> AdjointEstimate {
    let mut adjoint_training = AdjointTraining::default();
    let tally = |light, work| PathTally { light, work };
    for i in 0..4096 {
        // Points of a lattice in [-1, 1]³.
        let x = DVec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5) * f64::from(i);
        let x = x.fract() * 2.0 - 1.0;
        adjoint_training.record(&start(x), 1.0, tally(0.0, 0.0));
        adjoint_training.end(tally(brought(x), 1.0));
    }
    adjoint_training.estimate(1.0)
}

fn start(x: DVec3) -> Start {
    Start::point(x, DVec3::Y, 0)
}

/// At one unit of variance per unit of work, the survival of paths is proportional to the root of
/// the squared contributions.
#[test]
fn adjoint_estimates_are_worth_what_paths_brought() {
    let adjoint = learn(|x| if x.z < 0.0 { 0.2 } else { 3.0 });
    for (z, exact) in [(-0.6, 0.2), (0.6, 3.0)] {
        for x in [-0.7, 0.7] {
            let found = adjoint.of(&start(DVec3::new(x, 0.3, z))).unwrap();
            println!("{z}: {found}, exact {exact}");
            // The estimate partly counts training samples as samples of the larger surrounding
            // cells.
            assert!((found / exact - 1.0).abs() < 0.01);
        }
    }
    assert_eq!(AdjointEstimate::default().of(&start(DVec3::ZERO)), None);
}

/// A ball of fog without absorption, which bends light, under a sky of radiance 1. Any ray sees n²
/// of the sensor.
fn furnace() -> Scene {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(index, 0.7, 1.0, 0.3)];
    let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
    Scene::new(parts(vec![ball], media, vec![sky()], sensor)).unwrap()
}

/// The mean does not depend on the estimate.
#[test]
fn absurd_adjoint_estimates_keep_the_mean() {
    let scene = furnace();
    let integrator = Integrator::Path(PathTracer::default());
    let absurd = [
        learn(|x| if x.x < 0.0 { 0.25 } else { 100.0 }),
        learn(|x| 0.2 + 0.4 * x.y.abs()),
        learn(|x| if x.z > 0.2 { 0.4 } else { 1.0 }),
    ];
    let mut family = Family::new(1e-4);
    for (seed, adjoint) in absurd.into_iter().enumerate() {
        let mut ws = Workspace::new(scene.tolerance());
        ws.adjoint = adjoint;
        let mut batch = |number: u64| {
            let mut found = Vec::new();
            for sample in 0..2000 {
                let mut sampler = Sampler::new(seed as u64, number, sample);
                let ray = scene.sensor().ray(sampler.next_2d(), sampler.next_2d());
                integrator.sample(&scene, ray, 1, &mut sampler, &mut ws, &mut found);
            }
            found.iter().map(|c| c.weighted()[0]).sum::<f64>() / 2000.0
        };
        let means: Vec<f64> = (0..24).map(&mut batch).collect();
        let m = moments(&means);
        println!("{} ± {}, exact 1", m.mean(), m.standard_error());
        assert!(m.standard_error() < 0.01);
        family.push("path", one_sample(&means, 1.0, 1e-6));
    }
    family.check().unwrap();
}

/// A ball of dense white fog beside an emitter. Light scatters many times, but most of the visible
/// light scattered only a few times.
fn dense() -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(Constant::new(1.0), 20.0, 0.99, 0.0)];
    let light = Emitter::Point {
        position: DVec3::new(0.0, 1.5, 1.5),
        intensity: Spectrum::ONE,
    };
    let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
    parts(vec![ball], media, vec![light], sensor)
}

/// A pilot finds that long paths do not justify their work.
#[test]
fn long_paths_end_before_roulette_by_depth() {
    let scene = Scene::new(dense()).unwrap();
    let tracer = PathTracer {
        rr_depth: u32::MAX,
        ..PathTracer::default()
    };
    let integrator = Integrator::Path(tracer);
    let options = RenderOptions::new(integrator, 64, 1);
    let rendering = render(std::slice::from_ref(&scene), &options, |_| {
        ControlFlow::Continue(())
    });
    let with = rendering.stats.edges as f64 / rendering.stats.paths as f64;
    let mut ws = Workspace::new(scene.tolerance());
    let paths = 1024;
    for sample in 0..paths {
        let mut sampler = Sampler::new(2, 0, sample);
        let ray = scene.sensor().ray(sampler.next_2d(), sampler.next_2d());
        integrator.sample(&scene, ray, 1, &mut sampler, &mut ws, &mut Vec::new());
    }
    let without = ws.stats().edges as f64 / paths as f64;
    println!("{with} edges, {without} without roulette");
    assert!(2.0 * with < without);
}
