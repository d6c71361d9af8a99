//! Scenes built from their parts by name: the same pictures as those put together by hand, and what is wrong with others.

use crate::common::{self, camera, container, fog, mean, parts, shoot, sky};
use eikonal::field::{Constant, Luneburg};
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::RenderOptions;
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::{Camera, Sensor};
use morgana_transport::shape::{Rectangle, Sphere};

fn ball() -> Sphere {
    Sphere::around(DVec3::ZERO, 1.0).unwrap()
}

fn lens() -> Luneburg {
    Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap()
}

/// A ball of haze with a graded index, seen by a camera.
fn hazy() -> SceneBuilder {
    let haze = Medium::homogeneous("haze", lens(), 0.5, 0.9);
    Scene::builder()
        .film(4, 4)
        .channels(1)
        .camera(Camera::perspective([1.0, 0.5, -4.0], [0.0; 3], 40.0))
        .medium(haze.with_phase(Phase::henyey_greenstein(0.3).unwrap()))
        .object(Object::builder("container", ball()).interior("haze"))
        .emitter(Emitter::constant(1.0))
}

#[test]
fn pictures_are_those_of_the_same_scene_put_together_by_hand() {
    let built = hazy().build().unwrap();
    let built = built.render(&RenderOptions::new(PathTracer::default(), 16, 7));
    let view = camera(DVec3::new(1.0, 0.5, -4.0), DVec3::ZERO);
    let media = vec![common::vacuum(), fog(lens(), 0.5, 0.9, 0.3)];
    let objects = vec![container(ball(), Bsdf::Null)];
    let by_hand = shoot(parts(objects, media, vec![sky()], view), 16, 7);
    assert_eq!(built.film, by_hand.film);
    assert!(mean(&built).0 > 0.5);
}

#[test]
fn surfaces_have_defaults() {
    let light = Object::builder("light", Rectangle::new(Default::default()).unwrap()).emission(2.0);
    let scene = hazy().object(light).build().unwrap();
    let surfaces: Vec<_> = scene.objects().iter().map(|o| &o.bsdf).collect();
    assert!(matches!(surfaces[..], [Bsdf::Null, Bsdf::Diffuse(_)]));
    assert_eq!(scene.objects()[1].emitter, Some(1));
    assert!(matches!(
        scene.emitters()[1],
        Emitter::Area { object: 1, .. }
    ));
    let scene = Scene::builder().emitter(Emitter::constant(1.0)).build();
    assert!(matches!(scene.unwrap().sensor(), Sensor::Absent(_)));
}

/// What is said of a scene that cannot be built.
fn wrong(builder: SceneBuilder) -> String {
    builder.build().unwrap_err().to_string()
}

#[test]
fn everything_that_is_wrong_is_said_with_its_part_and_parameter() {
    let many = hazy()
        .film(0, 4)
        .channels(9)
        .camera(Camera::perspective([0.0; 3], [0.0; 3], 40.0))
        .medium(Medium::homogeneous("haze", Constant::new(1.0), 0.1, 0.1))
        .medium(Medium::homogeneous("ink", Constant::new(1.0), -1.0, 1.5))
        .object(
            Object::builder("jar", ball())
                .interior("inc")
                .exterior("hase"),
        )
        .object(Object::builder("bulb", ball()).emission(f64::NAN))
        .emitter(Emitter::point([f64::NAN, 0.0, 0.0], -1.0));
    let expected = "\
film: width: must be 1 to 65536 pixels, but it is 0
film: channels: must be 1 to 4, but it is 9
medium \"haze\": name: another medium has the same name; give each its own
medium \"ink\": sigma_t: must be finite and not negative, but it is -1
medium \"ink\": albedo: must be in [0, 1], but it is 1.5
emitter 1: positions and directions must be finite, and directions not zero
emitter 1: power: must be finite and not negative, but it is -12.566370614359172
camera: origin and target must be finite and differ, and up must not be parallel to the view
object \"jar\": interior: there is no medium \"inc\"; there are \"ambient\", \"haze\", \"haze\", \"ink\"
object \"jar\": exterior: there is no medium \"hase\"; there are \"ambient\", \"haze\", \"haze\", \"ink\"
object \"bulb\": emission: must be finite and not negative, but it is NaN";
    assert_eq!(wrong(many), expected);
    let fov = wrong(hazy().camera(Camera::perspective([0.0; 3], [1.0; 3], 180.0)));
    assert_eq!(
        fov,
        "camera: the field of view must be above 0 and at most 179 degrees, but it is 180"
    );
    let width = wrong(hazy().camera(Camera::orthographic([0.0; 3], [1.0; 3], 0.0)));
    assert_eq!(
        width,
        "camera: the width of the image must be positive and finite, but it is 0"
    );
}

#[test]
fn checks_of_the_whole_scene_name_its_parts() {
    for (n, squared) in [(0.0, "0"), (-1.5, "-2.25"), (f64::NAN, "NaN")] {
        let none = hazy()
            .medium(Medium::transparent("none", Constant::new(n)))
            .object(Object::builder("hole", ball()).interior("none"));
        let expected =
            format!("medium \"none\": the squared refractive index of medium 'none' is {squared}");
        assert!(wrong(none).starts_with(&expected), "{expected}");
    }
    let opaque = hazy().object(Object::builder(
        "wall",
        Sphere::around(DVec3::new(0.0, 0.0, -4.0), 9.0).unwrap(),
    ));
    assert!(wrong(opaque).starts_with("sensor: the sensor is inside 'wall'"));
}

#[test]
fn cameras_along_y_and_orthographic_ones_see_what_they_look_at() {
    for camera in [
        Camera::perspective([0.0, -4.0, 0.0], [0.0; 3], 40.0),
        Camera::orthographic([0.0, -4.0, 0.0], [0.0; 3], 1.0),
        Camera::orthographic([4.0, 0.0, 0.0], [0.0; 3], 1.0).with_up([0.0, 0.0, 1.0]),
    ] {
        let black = Object::builder("ball", ball()).emission(3.0);
        let scene = Scene::builder()
            .film(3, 3)
            .camera(camera)
            .object(black)
            .build()
            .unwrap();
        let rendering = scene.render(&RenderOptions::new(PathTracer::default(), 1, 0));
        assert_eq!(rendering.film.mean_at(None, 0, 4), 3.0);
    }
}
