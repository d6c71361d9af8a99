//! Scenes built from their parts by name: their images equal images of scenes assembled by hand,
//! and invalid scenes are refused.

use crate::common::{self, camera, container, fog, mean, parts, shoot, sky};
use eikonal::field::{Constant, Luneburg};
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber, Projector,
    Slide, Spot,
};
use morgana_transport::film::Filter;
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::RenderOptions;
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::{
    Batch, Camera, Orthographic, Perspective, Sensor, ThinLens, look_at,
};
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::texture::{BitmapFilter, Wrap};
use morgana_transport::{Orientation, Scene, Spectrum};
use std::f64::consts::PI;
use std::sync::Arc;

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

/// Returns the error message of a scene that cannot be built.
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

fn wrong_light(emitter: impl Into<Emitter>) -> String {
    wrong(hazy().emitter(emitter))
}

/// Values that are not valid sizes, with their form in messages.
const NO_SIZES: [(f64, &str); 4] = [
    (-1.0, "-1"),
    (f64::NAN, "NaN"),
    (f64::INFINITY, "inf"),
    (1e300, "1e300"),
];

#[test]
fn spots_have_an_axis_and_a_cone() {
    let spot = |axis, cutoff, width| {
        wrong_light(Spot::new(
            DVec3::Y * 3.0,
            axis,
            Spectrum::ONE,
            cutoff,
            width,
        ))
    };
    for axis in [DVec3::ZERO, DVec3::NAN] {
        let expected = "\
emitter 1: positions and directions must be finite, and directions not zero";
        assert_eq!(spot(axis, 0.4, 0.1), expected);
    }
    for (cutoff, shown) in [(0.0, "0"), (PI + 0.1, "185."), (f64::NAN, "NaN")] {
        let found = spot(DVec3::NEG_Y, cutoff, 0.0);
        let expected = format!(
            "emitter 1: cutoff: must be above 0 and at most 180 degrees, but it is {shown}"
        );
        assert!(found.starts_with(&expected), "{found}");
        assert!(!found.contains("power"), "{found}");
    }
    for (width, shown) in [(-0.1, "-0.1"), (0.5, "0.5"), (f64::NAN, "NaN")] {
        let expected =
            format!("emitter 1: beam_width: must be 0 to the cutoff, 0.4, but it is {shown}");
        assert_eq!(spot(DVec3::NEG_Y, 0.4, width), expected);
    }
}

#[test]
fn beams_and_fibers_have_sizes() {
    let aperture = |profile| Aperture::new(DVec3::Y * 3.0, DVec3::NEG_Y, profile);
    let fiber = |divergence| {
        let aperture = aperture(BeamProfile::Disc { radius: 0.1 });
        Fiber::new(aperture, AngularProfile::Uniform, divergence, Spectrum::ONE)
    };
    for (size, shown) in NO_SIZES {
        let expected =
            |name| format!("emitter 1: {name}: must be 1e-100 to 1e100, but it is {shown}");
        for (name, profile) in [
            ("radius", BeamProfile::Disc { radius: size }),
            ("waist", BeamProfile::Gaussian { waist: size }),
            (
                "width",
                BeamProfile::Rectangle {
                    width: size,
                    height: 1.0,
                },
            ),
        ] {
            let beam = Collimated::through(aperture(profile), Spectrum::ONE);
            assert_eq!(wrong_light(beam), expected(name));
        }
        let numerical = fiber(Divergence::NumericalAperture(size));
        assert_eq!(wrong_light(numerical), expected("numerical_aperture"));
        let half_angle = wrong_light(fiber(Divergence::HalfAngle(size)));
        let expected = "emitter 1: half_angle: must be above 0 and at most 180 degrees";
        assert!(half_angle.starts_with(expected), "{half_angle}");
    }
    let focus = fiber(Divergence::HalfAngle(0.1)).with_focus(0.0);
    assert!(wrong_light(focus).starts_with("emitter 1: focus: must be"));
}

#[test]
fn projectors_have_a_field_of_view() {
    let projector = |position, fov| {
        let slide = Slide {
            size: [1, 1],
            pixels: vec![Spectrum::ONE],
            filter: BitmapFilter::Nearest,
            wrap: Wrap::Clamp,
        };
        let projector = Projector::new(position, Orientation::IDENTITY, fov, slide).unwrap();
        Emitter::Projector(Arc::new(projector))
    };
    for (fov, shown) in [(-0.5, "-28.6479"), (0.0, "0"), (f64::NAN, "NaN")] {
        assert_eq!(
            wrong_light(projector(DVec3::Y, fov)),
            format!("emitter 1: fov_x: must be above 0 and below 180 degrees, but it is {shown}")
        );
    }
    let lost = wrong_light(projector(DVec3::NAN, 0.5));
    assert!(lost.starts_with("emitter 1: positions and directions must be finite"));
}

#[test]
fn lights_media_and_filters_are_of_finite_numbers() {
    assert_eq!(
        wrong_light(Emitter::point([0.0, 1e300, 0.0], 1.0)),
        "emitter 1: coordinates must be at most 1e100, but it is at [0, 1e300, 0]"
    );
    let cold = Medium::homogeneous("cold", Constant::new(1.0), 1.0, 0.5).with_emission(-1.0);
    assert_eq!(
        wrong(hazy().medium(cold)),
        "medium \"cold\": emission: must be finite and not negative, but it is -1"
    );
    for (size, shown) in NO_SIZES {
        let expected =
            |name, range| format!("filter: {name}: must be {range} pixels, but it is {shown}");
        let tent = hazy().filter(Filter::Tent { radius: size });
        assert_eq!(wrong(tent), expected("radius", "0.1 to 32"));
        let gaussian = hazy().filter(Filter::Gaussian { stddev: size });
        assert_eq!(wrong(gaussian), expected("stddev", "0.025 to 8"));
    }
}

#[test]
fn sensors_have_finite_numbers_and_the_shape_of_the_film() {
    let view = || look_at(DVec3::NEG_Z * 5.0, DVec3::ZERO, DVec3::Y).unwrap();
    let pinhole = |fov, aspect| Perspective::new(view(), fov, aspect);
    let seen = |sensor| wrong(hazy().sensor(sensor));
    for (fov, shown) in [(-0.5, "-28.6479"), (0.0, "0"), (f64::NAN, "NaN")] {
        assert_eq!(
            seen(Sensor::Perspective(pinhole(fov, 1.0))),
            format!("sensor: fov_x: must be above 0 and below 180 degrees, but it is {shown}")
        );
    }
    for (aspect, shown) in [(2.0, "2"), (-1.0, "-1"), (f64::NAN, "NaN")] {
        let expected = format!("sensor: aspect: must be that of the film, 1, but it is {shown}");
        assert_eq!(seen(Sensor::Perspective(pinhole(0.5, aspect))), expected);
        let parallel = Orthographic::new(view(), aspect);
        assert_eq!(seen(Sensor::Orthographic(parallel)), expected);
    }
    for (size, shown) in NO_SIZES {
        let lens = |radius, focus| {
            let lens = ThinLens::new(pinhole(0.5, 1.0), radius, focus);
            seen(Sensor::ThinLens(lens))
        };
        let expected = |name| format!("sensor: {name}: must be 1e-100 to 1e100, but it is {shown}");
        assert_eq!(lens(size, 5.0), expected("aperture_radius"));
        assert_eq!(lens(0.1, size), expected("focus_distance"));
    }
    for map in [DAffine3::ZERO, DAffine3::from_scale(DVec3::NAN)] {
        let parallel = Sensor::Orthographic(Orthographic::new(map, 1.0));
        assert_eq!(
            seen(parallel),
            "sensor: to_world: must be finite and invertible"
        );
    }
    for aspect in [0.5, 1.0] {
        let halves = [0, 1].map(|_| Sensor::Perspective(pinhole(0.5, aspect)));
        let batch = Sensor::Batch(Batch::new(halves.into()).unwrap().into());
        assert_eq!(hazy().sensor(batch).build().is_ok(), aspect == 0.5);
    }
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
