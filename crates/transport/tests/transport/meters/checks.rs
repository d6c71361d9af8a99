//! Invalid meters are refused, with number, field and value.

use crate::meters::support::*;
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::meter::{
    Acceptance, Coordinates, Cosines, FluenceMeter, IrradianceMeter, Meter, MeterGrid,
    MeterSurface, Patch, Positions,
};
use morgana_transport::render::{
    Handle, MeasureState, MeterDerivativeOptions, ReadingFunctional, meter_derivatives,
};
use morgana_transport::shape::{Shape, Sphere};
use morgana_transport::{Bins, Scene};
use std::ops::ControlFlow;
use std::slice::from_ref;

fn ball() -> Sphere {
    Sphere::around(DVec3::ZERO, 1.0).unwrap()
}

/// A black ball under a sky.
fn scene() -> Scene {
    let mut ball = container(ball(), Bsdf::Null);
    ball.sides = None;
    Scene::new(parts(vec![ball], vec![vacuum()], vec![sky()], nobody())).unwrap()
}

fn plain() -> IrradianceMeter {
    IrradianceMeter::at(0, Positions::new(&Shape::Sphere(ball()), [1, 1], false))
}

fn grid() -> FluenceMeter {
    fluence(Coordinates::Cartesian, [2; 3], DAffine3::IDENTITY)
}

/// Returns the error message for a meter behind a valid one.
fn wrong(meter: Meter) -> String {
    let meters = [Meter::Irradiance(plain()), meter];
    let refused = MeasureState::new(from_ref(&scene()), &meters);
    refused.unwrap_err().to_string()
}

fn wrong_surfaces(objects: &[usize]) -> String {
    let surface = |object: &usize| MeterSurface {
        object: *object,
        inverted: false,
    };
    wrong(Meter::Irradiance(IrradianceMeter {
        surfaces: objects.iter().map(surface).collect(),
        ..plain()
    }))
}

#[test]
fn surfaces_are_of_different_objects_of_the_scene() {
    assert_eq!(
        wrong_surfaces(&[]),
        "meter 1: surfaces: must not be empty: light is measured at a surface"
    );
    assert_eq!(
        wrong_surfaces(&[0, 7]),
        "meter 1: surfaces: must be of objects of the scene, which has 1, but one is of object 7"
    );
    assert_eq!(
        wrong_surfaces(&[0, 0]),
        "meter 1: surfaces: must be of different objects, but two are of object 0"
    );
}

#[test]
fn what_is_accepted_has_positive_extents() {
    let of = |acceptance| {
        wrong(Meter::Irradiance(IrradianceMeter {
            acceptance,
            ..plain()
        }))
    };
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let cone = Acceptance {
            numerical_aperture: Some(value),
            patch: None,
        };
        let expected = "must be positive and finite, but it is";
        let field = "meter 1: acceptance.numerical_aperture";
        assert_eq!(of(cone), format!("{field}: {expected} {value}"));
        let near = |center, radius| Acceptance {
            patch: Some(Patch { center, radius }),
            numerical_aperture: None,
        };
        let field = "meter 1: acceptance.patch.radius";
        let patch = near(DVec3::ZERO, value);
        assert_eq!(of(patch), format!("{field}: {expected} {value}"));
        let lost = of(near(DVec3::NAN, 1.0));
        assert!(lost.starts_with("meter 1: acceptance.patch.center: must be finite"));
    }
}

#[test]
fn bins_hold_values() {
    let cosines = |count, axis| {
        wrong(Meter::Irradiance(IrradianceMeter {
            cosines: Some(Cosines { count, axis }),
            ..plain()
        }))
    };
    assert_eq!(
        cosines(0, None),
        "meter 1: cosines.count: must be at least 1, but it is 0"
    );
    assert_eq!(
        cosines(4, Some(DVec3::Z * 2.0)),
        "meter 1: cosines.axis: must be a unit vector, but it is [0, 0, 2]"
    );
    assert!(cosines(4, Some(DVec3::NAN)).contains("but it is [NaN, NaN, NaN]"));
    let none = Positions::new(&Shape::Sphere(ball()), [0, 1], false);
    assert_eq!(
        wrong(Meter::Irradiance(IrradianceMeter::at(0, none))),
        "meter 1: positions: must have a bin at least, but there is none"
    );
    for (min, max, count) in [
        (0.0, 1.0, 0),
        (2.0, 1.0, 4),
        (1.0, 1.0, 4),
        (f64::NAN, 1.0, 4),
    ] {
        let lengths = Some(Bins { min, max, count });
        let surface = IrradianceMeter {
            optical_length: lengths,
            ..plain()
        };
        let space = FluenceMeter {
            optical_length: lengths,
            ..grid()
        };
        for meter in [Meter::Irradiance(surface), Meter::Fluence(space)] {
            let expected = format!(
                "meter 1: optical_length: must have finite ends, min below max, and a bin at least, but there are \
                 {count} from {min} to {max}"
            );
            assert_eq!(wrong(meter), expected);
        }
    }
    let nowhere = DAffine3::from_translation(DVec3::NAN);
    assert!(MeterGrid::new(Coordinates::Cartesian, [2; 3], nowhere).is_none());
    // Its inverse translates by 1e310.
    let mut far = DAffine3::from_scale(DVec3::splat(1e-10));
    far.translation = DVec3::splat(1e300);
    assert!(MeterGrid::new(Coordinates::Cartesian, [2; 3], far).is_none());
}

/// Derivatives of quantities that are not measured are refused.
#[test]
fn derivatives_are_of_meters_that_can_measure() {
    let meter = Meter::Irradiance(IrradianceMeter {
        surfaces: Vec::new(),
        ..plain()
    });
    let options = MeterDerivativeOptions {
        particles: 100,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
        parameters: &[],
        of: ReadingFunctional::Each {
            meter: 0,
            reading: 0,
        },
    };
    let (scene, meters) = (scene(), [meter]);
    let refused = meter_derivatives(from_ref(&scene), &meters, &options, &Handle::default());
    let expected = "meter 0: surfaces: must not be empty: light is measured at a surface";
    assert_eq!(refused.unwrap_err().to_string(), expected);
}

#[test]
#[should_panic(expected = "the state is not one of a measurement of these scenes")]
fn states_of_other_meters() {
    let (scene, handle) = (scene(), Handle::default());
    let (scenes, others) = (from_ref(&scene), [Meter::Fluence(grid())]);
    let mut state = MeasureState::new(scenes, &[Meter::Irradiance(plain())]).unwrap();
    let on_pass = |_: &MeasureState| ControlFlow::Continue(());
    let _ = state.advance(scenes, &others, &options(64, 0), &handle, on_pass);
}

#[test]
#[should_panic(expected = "there must be a scene for each group of channels")]
fn measurements_without_scenes() {
    let _ = MeasureState::new(&[], &[]);
}
