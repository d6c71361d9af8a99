//! Renders in parts: merged, resumed, and on any number of threads, they equal the render in one
//! piece, bit for bit.

use crate::common::{camera, container, fog, in_passes, parts, path_tracer, sky, vacuum};
use eikonal::field::Gaussian;
use glam::{DAffine3, DVec3};
use morgana_transport::aov::{Aov, AovTracer};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PhotonMapping, Vcm};
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter, MeterGrid};
use morgana_transport::render::{
    Handle, Measure, MeasureOptions, MeasureState, MergeError, Progress, RenderOptions, Rendering,
};
use morgana_transport::render::{State, Target, measure, render};
use morgana_transport::scene::Parts;
use morgana_transport::sensor::Sensor;
use morgana_transport::shape::Sphere;
use morgana_transport::{Bins, Scene, Spectrum};
use std::ops::{ControlFlow, Range};

const SAMPLES: u64 = 11;

/// Fog of varying index around an opaque ball, under a sky and a point light.
fn scene() -> Parts {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
    let fogs = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let half = Spectrum([0.5, 0.4, 0.3, 0.0]);
    let mut ball = container(
        Sphere::around(DVec3::NEG_Y * 0.3, 0.3).unwrap(),
        Bsdf::Diffuse(Diffuse::new(half).unwrap()),
    );
    ball.sides = None;
    let light = Emitter::Point {
        position: DVec3::new(0.5, 1.5, 0.5),
        intensity: Spectrum([1.0, 2.0, 0.7, 0.0]),
    };
    let media = vec![vacuum(), fog(index, 1.0, 0.9, 0.3)];
    let sensor = camera(DVec3::new(0.0, -0.4, 3.0), DVec3::ZERO);
    let mut parts = parts(vec![fogs, ball], media, vec![sky(), light], sensor);
    (parts.film.width, parts.film.height, parts.film.channels) = (9, 7, 3);
    parts
}

/// Options for everything that a film can keep.
fn options(integrator: Integrator) -> RenderOptions {
    let decomposition = Decomposition {
        length: Some(Bins {
            min: 3.0,
            max: 6.0,
            count: 4,
        }),
        bounces: Some(2),
        emitters: None,
        parts: None,
    };
    RenderOptions {
        strategies: integrator.separates_strategies(),
        decomposition,
        reweight: true,
        quantities: Some(AovTracer::new(&Aov::ALL)),
        ..RenderOptions::new(integrator, SAMPLES, 5)
    }
}

fn estimators() -> [RenderOptions; 6] {
    [
        options(path_tracer()),
        options(Integrator::Particle(ParticleTracer::default())),
        options(Integrator::Bdpt(Bdpt::default())),
        options(Integrator::Vcm(Vcm::default())),
        options(Integrator::Photon(PhotonMapping::default())),
        RenderOptions::new(AovTracer::default(), SAMPLES, 5),
    ]
}

fn state(scene: &Scene, options: &RenderOptions, range: Range<u64>) -> State {
    let scenes = std::slice::from_ref(scene);
    let options = RenderOptions {
        first: range.start,
        samples: range.end - range.start,
        ..*options
    };
    let mut state = State::new(scenes, &options);
    let handle = Handle::default();
    state.advance(scenes, &options, &handle, |_| ControlFlow::Continue(()));
    assert!(state.fits(scenes, &options));
    state
}

fn same(found: &Rendering, whole: &Rendering, what: &str) {
    assert_eq!(found.samples, whole.samples, "{what}");
    assert_eq!(found.film, whole.film, "{what}");
    assert_eq!(found.stats, whole.stats, "{what}");
    assert_eq!(found.debiased, whole.debiased, "{what}");
    assert_eq!(found.balance, whole.balance, "{what}");
    let quantities = [found, whole].map(|r| r.quantities.as_ref().map(|q| (&q.film, &q.stats)));
    assert_eq!(quantities[0], quantities[1], "{what}");
    assert_eq!(found.strategies.len(), whole.strategies.len(), "{what}");
    for (a, b) in found.strategies.iter().zip(&whole.strategies) {
        assert_eq!((a.s, a.t), (b.s, b.t), "{what}");
        assert_eq!(a.weighted, b.weighted, "{what}");
        assert_eq!(a.unweighted, b.unweighted, "{what}");
    }
}

#[test]
fn parts_in_any_order_are_the_whole() {
    let scene = Scene::new(scene()).unwrap();
    for options in estimators() {
        let name = options.renderer.name();
        let whole = render(std::slice::from_ref(&scene), &options, |_| {
            ControlFlow::Continue(())
        });
        assert!(whole.film.summary().0 != 0.0, "{name}");
        for cuts in [&[0, 4, 5, 11][..], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]] {
            let mut states: Vec<State> = cuts
                .windows(2)
                .map(|cut| state(&scene, &options, cut[0]..cut[1]))
                .collect();
            states.rotate_left(2);
            let mut merged = states.pop().unwrap();
            states.iter().for_each(|s| merged.merge(s).unwrap());
            let merged = merged.into_rendering(std::slice::from_ref(&scene));
            same(&merged, &whole, name);
        }
    }
}

#[test]
fn a_render_that_goes_on_is_the_whole_on_any_number_of_threads() {
    let scenes = [Scene::new(scene()).unwrap()];
    for options in estimators() {
        let name = options.renderer.name();
        let whole = render(&scenes, &options, |_| ControlFlow::Continue(()));
        let state = in_passes(&scenes, &options);
        same(&state.into_rendering(&scenes), &whole, name);
    }
}

/// A render can be given up before the first sample, in the pilot, or after some samples.
#[test]
fn a_pass_that_is_given_up_leaves_no_trace() {
    let scenes = [Scene::new(scene()).unwrap()];
    let given_up = Handle::default();
    given_up.end_now();
    let never = |_: &Progress| -> ControlFlow<()> { panic!("a pass was completed") };
    for options in estimators() {
        let name = options.renderer.name();
        let whole = render(&scenes, &options, |_| ControlFlow::Continue(()));
        let mut state = State::new(&scenes, &options);
        state.advance(&scenes, &options, &given_up, never);
        assert!(state.fits(&scenes, &options), "{name}");
        let nothing = state.clone().into_rendering(&scenes);
        assert_eq!((nothing.samples, nothing.film.samples()), (0, 0), "{name}");
        let some = RenderOptions {
            samples: 3,
            ..options
        };
        let go_on = |_: &Progress| ControlFlow::Continue(());
        state.advance(&scenes, &some, &Handle::default(), go_on);
        let before = state.clone();
        state.advance(&scenes, &options, &given_up, never);
        let [before, after] = [before, state.clone()].map(|s| s.into_rendering(&scenes));
        same(&after, &before, name);
        state.advance(&scenes, &options, &Handle::default(), go_on);
        same(&state.into_rendering(&scenes), &whole, name);
    }
}

/// Renders with a target error test their error at fixed numbers of samples, wherever they were
/// interrupted.
#[test]
fn a_render_that_goes_on_ends_at_its_target() {
    let scenes = [Scene::new(scene()).unwrap()];
    let options = RenderOptions {
        target: Some(Target {
            error: 0.02,
            measure: Measure::Image,
        }),
        ..RenderOptions::new(path_tracer(), 100_000, 8)
    };
    let whole = render(&scenes, &options, |_| ControlFlow::Continue(()));
    assert!(whole.reached && whole.samples > 32, "{}", whole.samples);
    let mut state = State::new(&scenes, &options);
    let handle = Handle::default();
    while !state.reached() {
        state.advance(&scenes, &options, &handle, |_| ControlFlow::Break(()));
    }
    same(&state.into_rendering(&scenes), &whole, "target");
}

#[test]
fn samples_never_count_twice() {
    let scene = Scene::new(scene()).unwrap();
    let options = options(path_tracer());
    let mut first = state(&scene, &options, 0..6);
    let second = state(&scene, &options, 5..8);
    assert_eq!(first.merge(&second), Err(MergeError::Overlap(5..6)));
    assert_eq!(first.done().count(), 6);
    // Samples that exist are not taken again.
    let scenes = [scene];
    let handle = Handle::default();
    first.advance(&scenes, &options, &handle, |_| ControlFlow::Continue(()));
    let whole = render(&scenes, &options, |_| ControlFlow::Continue(()));
    same(&first.into_rendering(&scenes), &whole, "gaps");
}

#[test]
fn other_renders_do_not_fit() {
    let scenes = [Scene::new(scene()).unwrap()];
    let mine = options(path_tracer());
    let mut kept = state(&scenes[0], &mine, 0..1);
    let others = [
        RenderOptions {
            reweight: false,
            ..mine
        },
        RenderOptions {
            decomposition: Decomposition::default(),
            ..mine
        },
        options(Integrator::Photon(PhotonMapping::default())),
        options(Integrator::Bdpt(Bdpt::default())),
        options(Integrator::Vcm(Vcm::default())),
        RenderOptions::new(AovTracer::default(), 1, 1),
    ];
    for other in others {
        let name = other.renderer.name();
        assert!(!kept.fits(&scenes, &other), "{name}");
        let other = state(&scenes[0], &other, 1..2);
        assert_eq!(kept.merge(&other), Err(MergeError::Different), "{name}");
    }
    let mut larger = scene();
    larger.film.width = 10;
    assert!(!kept.fits(&[Scene::new(larger).unwrap()], &mine));
}

#[test]
fn measurements_in_parts_are_the_whole() {
    let mut lit = scene();
    lit.emitters.remove(0);
    lit.sensor = Sensor::Absent(DAffine3::IDENTITY);
    let scenes = [Scene::new(lit).unwrap()];
    let to_world =
        DAffine3::from_scale(DVec3::splat(2.0)) * DAffine3::from_translation(DVec3::splat(-0.5));
    let meters = [Meter::Fluence(FluenceMeter {
        grid: MeterGrid::new(Coordinates::Cartesian, [3, 4, 5], to_world).unwrap(),
        estimator: Estimator::TrackLength,
        optical_length: None,
        weight_windows: false,
        sidebands: None,
        frequency_domain: None,
    })];
    let options = |first, particles| MeasureOptions {
        first,
        particles,
        seed: 3,
        max_depth: None,
        rr_depth: 5,
    };
    let handle = Handle::default();
    let all = options(0, 1000);
    let whole = measure(&scenes, &meters, &all, &handle, |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    // Tasks are complete.
    assert_eq!(whole.particles, 1024);
    let part = |first, particles| {
        let mut state = MeasureState::new(&scenes, &meters).unwrap();
        let options = options(first, particles);
        let go_on = |_: &_| ControlFlow::Continue(());
        state
            .advance(&scenes, &meters, &options, &handle, go_on)
            .unwrap();
        assert!(state.fits(&scenes, &meters));
        state
    };
    let mut state = part(300, 333);
    assert_eq!(
        state.merge(&part(500, 100)),
        Err(MergeError::Overlap(512..640))
    );
    state.merge(&part(0, 300)).unwrap();
    let stop = |_: &_| ControlFlow::Break(());
    while state.done().count() < 1024 {
        state
            .advance(&scenes, &meters, &all, &handle, stop)
            .unwrap();
    }
    let found = state.into_measurement(&scenes, &meters).unwrap();
    assert_eq!(found.readings, whole.readings);
    assert_eq!(found.balance, whole.balance);
    assert_eq!(found.stats, whole.stats);
    assert!(whole.readings[0][0].mean.iter().sum::<f64>() > 0.0);
}

/// Quantities besides light do not change the light, bit for bit, and equal quantities of the rays
/// rendered alone.
#[test]
fn quantities_beside_light_are_those_alone() {
    let scene = Scene::new(scene()).unwrap();
    let scenes = std::slice::from_ref(&scene);
    let tracer = AovTracer::new(&Aov::ALL);
    let go_on = |_: &Progress| ControlFlow::Continue(());
    let alone = render(scenes, &RenderOptions::new(tracer, SAMPLES, 5), go_on);
    for with in estimators().into_iter().filter(|o| o.renderer.is_light()) {
        let name = with.renderer.name();
        let without = RenderOptions {
            quantities: None,
            ..with
        };
        let [both, light] = [with, without].map(|options| render(scenes, &options, go_on));
        assert_eq!(both.film, light.film, "{name}");
        assert_eq!(both.stats, light.stats, "{name}");
        let quantities = both.quantities.unwrap();
        assert_eq!(quantities.film, alone.film, "{name}");
        assert_eq!(quantities.stats.paths, alone.stats.paths, "{name}");
        let state = State::new(scenes, &with);
        assert!(!state.fits(scenes, &without), "{name}");
    }
}
