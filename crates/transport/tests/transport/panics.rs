//! Impossible requests panic at once, with a message that gives the reason; merely large ones do
//! not.

use eikonal::field::Constant;
use glam::DVec3;
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, PathTracer};
use morgana_transport::medium::Medium;
use morgana_transport::render::{
    Extent, Handle, Measure, RenderOptions, State, Target, choose, render,
};
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Sphere;
use morgana_transport::trace::branches;
use morgana_transport::{Bins, Scene};
use std::ops::ControlFlow;
use std::slice::from_ref;

/// A ball of haze between two lights.
fn haze() -> SceneBuilder {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    Scene::builder()
        .film(4, 4)
        .channels(1)
        .camera(Camera::perspective([0.0, 0.0, -4.0], [0.0; 3], 40.0))
        .medium(Medium::homogeneous("haze", Constant::new(1.0), 1.0, 0.9))
        .object(Object::builder("ball", ball).interior("haze"))
        .emitter(Emitter::point([0.0, 3.0, 0.0], 10.0))
        .emitter(Emitter::point([0.0, -3.0, 0.0], 10.0))
}

fn options() -> RenderOptions {
    RenderOptions::new(PathTracer::default(), 2, 0)
}

fn separated(decomposition: Decomposition) {
    let options = RenderOptions {
        decomposition,
        ..options()
    };
    haze().build().unwrap().render(&options);
}

fn by_emitters(emitters: usize) {
    separated(Decomposition {
        emitters: Some(emitters),
        ..Decomposition::default()
    });
}

fn by_bounces(bounces: u32) {
    separated(Decomposition {
        bounces: Some(bounces),
        ..Decomposition::default()
    });
}

fn by_length(min: f64, max: f64, count: usize) {
    separated(Decomposition {
        length: Some(Bins { min, max, count }),
        ..Decomposition::default()
    });
}

fn chosen(scenes: &[Scene], several: bool) {
    let candidates = [PathTracer::default().into(), Bdpt::default().into()];
    let candidates = if several { &candidates[..] } else { &[] };
    let (extent, handle) = (Extent::default(), Handle::default());
    choose(scenes, candidates, &options(), extent, &handle);
}

#[test]
fn all_emitters_and_many_bounces_are_told_apart() {
    by_emitters(2);
    by_bounces(Decomposition::MAX_BOUNCES);
}

#[test]
#[should_panic(expected = "the film separates 1 emitters, but the scene has 2")]
fn fewer_emitters_than_there_are() {
    by_emitters(1);
}

#[test]
#[should_panic(expected = "the film separates 0 emitters, but the scene has 2")]
fn no_emitters() {
    by_emitters(0);
}

#[test]
#[should_panic(expected = "a film separates at most 1000 bounces, not 4294967295")]
fn too_many_bounces() {
    by_bounces(u32::MAX);
}

#[test]
#[should_panic(expected = "bins of length need finite ends")]
fn no_bins() {
    by_length(0.0, 1.0, 0);
}

#[test]
#[should_panic(expected = "bins of length need finite ends")]
fn bins_without_an_end() {
    by_length(0.0, f64::NAN, 4);
}

#[test]
#[should_panic(expected = "there must be a scene for each group of channels")]
fn renders_without_scenes() {
    render(&[], &options(), |_| ControlFlow::Continue(()));
}

#[test]
#[should_panic(expected = "there must be a scene for each group of channels")]
fn choices_without_scenes() {
    chosen(&[], true);
}

#[test]
#[should_panic(expected = "there is no estimator to choose")]
fn choices_without_candidates() {
    chosen(&[haze().build().unwrap()], false);
}

#[test]
#[should_panic(expected = "there must be a scene for each group of channels")]
fn branches_without_scenes() {
    branches(&[], DVec3::ZERO, DVec3::ONE, None);
}

#[test]
#[should_panic(expected = "the state is not one of a render of these scenes")]
fn states_of_other_films() {
    let [scene, other] = [haze(), haze().film(8, 8)].map(|b| b.build().unwrap());
    let mut state = State::new(from_ref(&scene), &options());
    let (others, handle) = (from_ref(&other), Handle::default());
    state.advance(others, &options(), &handle, |_| ControlFlow::Continue(()));
}

#[test]
fn errors_that_are_no_numbers_are_never_reached() {
    let options = RenderOptions {
        target: Some(Target {
            error: f64::NAN,
            measure: Measure::Image,
        }),
        ..options()
    };
    let rendering = haze().build().unwrap().render(&options);
    assert_eq!((rendering.samples, rendering.reached), (2, false));
}

#[test]
fn any_number_of_reflections_may_be_followed() {
    let scene = haze().reflections(u32::MAX).build().unwrap();
    assert_eq!(scene.branch_reach().bounces, u32::MAX);
    let [from, to] = [DVec3::NEG_Z * 2.0, DVec3::Z * 2.0];
    let all = branches(from_ref(&haze().build().unwrap()), from, to, Some(u32::MAX));
    assert_eq!(all.list.len(), 1);
}
