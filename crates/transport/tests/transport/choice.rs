//! The estimator that a pilot chooses: the better one where one is clearly better, with the gain
//! that it states, and identical on any number of threads.
//!
//! False alarms: 1e-3 for variances. Choices are between estimators that differ by factors of three
//! and more.

use crate::common::{self, camera, container, fog, parts, samples, vacuum};
use eikonal::field::{Constant, Gaussian};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer};
use morgana_transport::render::{Choice, Extent, Handle, RenderOptions, choose};
use morgana_transport::sampling::Replicates;
use morgana_transport::scene::{Object, Parts, Sides};
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::{Scene, Spectrum};
use testkit::Family;
use testkit::batches::welch;

const FALSE_ALARM: f64 = 1e-3;
const SIZE: usize = 16;
/// Pilots of a tenth of a second.
const SHORT: Extent = Extent {
    samples: Some(4000),
    seconds: None,
};

fn candidates() -> [Integrator; 3] {
    [
        Integrator::Path(PathTracer::default()),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

fn chosen(scene: &Scene, seed: u64, extent: Extent) -> Choice {
    chosen_by(scene, RenderOptions::new(candidates()[0], 1, seed), extent)
}

fn chosen_by(scene: &Scene, options: RenderOptions, extent: Extent) -> Choice {
    let scenes = std::slice::from_ref(scene);
    choose(scenes, &candidates(), &options, extent, &Handle::default())
}

/// A graded ball of fog above a floor, under a sky: paths from the sensor find the sky easily,
/// while particles come from all directions.
fn under_a_sky() -> Parts {
    let index = Gaussian::new(1.0, 0.05, DVec3::ZERO, 0.4).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 0.8).unwrap(), Bsdf::Null);
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::X * 6.0, -DVec3::Z * 6.0, DVec3::Y),
        translation: -DVec3::Y,
    };
    let floor = Object {
        name: "floor".into(),
        shape: Rectangle::new(to_world).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap()),
        sides: None,
        emitter: None,
    };
    let media = vec![vacuum(), fog(index, 1.0, 0.9, 0.3)];
    let sky = common::sky();
    sized(parts(
        vec![ball, floor],
        media,
        vec![sky],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ))
}

/// A small emitter behind a glass ball makes a caustic in the surrounding fog, which paths from the
/// sensor hardly find.
fn caustic() -> Parts {
    let fogs = container(Sphere::around(DVec3::ZERO, 3.0).unwrap(), Bsdf::Null);
    let glass = Object {
        name: "glass".into(),
        sides: Some(Sides {
            exterior: 1,
            interior: 2,
        }),
        bsdf: Bsdf::Dielectric(Dielectric::default()),
        ..container(Sphere::around(DVec3::ZERO, 0.5).unwrap(), Bsdf::Null)
    };
    let light = Object {
        name: "light".into(),
        shape: Sphere::around(-DVec3::X * 1.6, 0.02).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: Some(Sides {
            exterior: 1,
            interior: 1,
        }),
        emitter: Some(0),
    };
    let emitter = Emitter::Area {
        object: 2,
        radiance: Spectrum::splat(1000.0),
    };
    let media = vec![
        vacuum(),
        fog(Constant::new(1.0), 0.2, 0.9, 0.0),
        fog(Constant::new(1.5), 0.0, 0.0, 0.0),
    ];
    sized(parts(
        vec![fogs, glass, light],
        media,
        vec![emitter],
        camera(DVec3::Z * 6.0, DVec3::ZERO),
    ))
}

fn sized(mut parts: Parts) -> Parts {
    (parts.film.width, parts.film.height) = (SIZE, SIZE);
    parts
}

#[test]
fn the_better_estimator_is_chosen() {
    for (parts, wanted) in [
        (under_a_sky(), &["path"][..]),
        // These two are about equally good.
        (caustic(), &["bdpt", "particle"]),
    ] {
        let scene = Scene::new(parts).unwrap();
        for seed in 0..5 {
            let choice = chosen(&scene, seed, SHORT);
            println!("{wanted:?}: {choice:?}");
            assert!(wanted.contains(&choice.integrator.name()), "seed {seed}");
        }
    }
}

/// The pilot's relative variances of a sample agree with the variances in renders.
#[test]
fn pilots_foretell_variances() {
    let mut family = Family::new(FALSE_ALARM);
    let scene = Scene::new(under_a_sky()).unwrap();
    for replicates in [Replicates::SINGLE, Replicates::new(8).unwrap()] {
        let options = |integrator, samples, seed| RenderOptions {
            replicates,
            ..RenderOptions::new(integrator, samples, seed)
        };
        let runs = samples(10, 5);
        let choices: Vec<Choice> = (0..runs)
            .map(|seed| chosen_by(&scene, options(candidates()[0], 1, seed), SHORT))
            .collect();
        for (i, integrator) in candidates().into_iter().enumerate() {
            let foretold: Vec<f64> = choices
                .iter()
                .map(|c| c.candidates[i].relative_variance)
                .collect();
            let measured: Vec<f64> = (100..100 + runs)
                .map(|seed| measured(&scene, options(integrator, 64, seed)))
                .collect();
            println!(
                "{} {replicates:?}: {foretold:?} {measured:?}",
                integrator.name()
            );
            let mean = |values: &[f64]| -> f64 { values.iter().sum::<f64>() / values.len() as f64 };
            // Pilots treat cells of pixels as alike, which adds the pixels' differences in
            // brightness to the variance.
            let tolerance = 0.15 * mean(&measured);
            family.push(integrator.name(), welch(&foretold, &measured, tolerance));
        }
    }
    family.check().unwrap();
}

/// The relative variance of a sample, from a render.
fn measured(scene: &Scene, options: RenderOptions) -> f64 {
    let film = scene.render(&options).film;
    let mean = film.summary().0;
    let pixels = film.pixels(0);
    let count = pixels.len() as f64;
    let relative = pixels.map(|p| {
        let variance = p.variance_of_mean()[0] * options.samples as f64;
        variance / (p.mean()[0].powi(2) + (0.05 * mean).powi(2))
    });
    relative.sum::<f64>() / count
}

#[test]
fn choices_do_not_depend_on_the_number_of_threads() {
    let scene = Scene::new(caustic()).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| chosen(&scene, 7, SHORT))
    };
    assert_eq!(with(1), with(3));
}

/// A pilot takes at most a tenth of a render. If this is too little, the first candidate is chosen.
#[test]
fn short_renders_have_short_pilots() {
    let scene = Scene::new(under_a_sky()).unwrap();
    let of = |samples| {
        let extent = Extent {
            samples: Some(samples),
            seconds: None,
        };
        chosen(&scene, 1, extent)
    };
    let short = of(2);
    assert!(short.candidates.is_empty());
    assert_eq!(short.integrator, candidates()[0]);
    let work = |choice: &Choice| -> f64 {
        choice
            .candidates
            .iter()
            .map(|c| c.work * c.samples as f64)
            .sum()
    };
    let path = of(1000).candidates[0];
    let whole = 1000.0 * (SIZE * SIZE) as f64 * path.work;
    let share = work(&of(1000)) / whole;
    assert!(share < 0.11, "{share}");
    assert!(work(&of(1000)) < work(&of(4000)));
}
