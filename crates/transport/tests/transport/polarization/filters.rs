//! Polarisers and retarders, seen along a line and along connections.

use crate::polarization::field::Coherency;
use crate::polarization::haze::assert_scattered_once;
use crate::polarization::{assert_alike, polarized, stokes};
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{Bsdf, FilterElement, PolarizingFilter};
use morgana_transport::emitter::Emitter;
use morgana_transport::scene::{Object, ObjectBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Rectangle;
use morgana_transport::{Scene, Spectrum};

pub fn polarizer(theta: f64) -> FilterElement {
    FilterElement::Polarizer {
        theta: theta.into(),
    }
}

fn retarder(theta: f64, delta: f64) -> FilterElement {
    FilterElement::Retarder {
        theta: theta.into(),
        delta: delta.into(),
    }
}

/// A rotated square of half-width 3 around a point.
pub fn square(name: &str, center: DVec3, turn: DQuat, element: FilterElement) -> ObjectBuilder {
    let to_world = DAffine3::from_scale_rotation_translation(DVec3::splat(3.0), turn, center);
    let filter = PolarizingFilter::new(element, Spectrum::ONE).unwrap();
    Object::builder(name, Rectangle::new(to_world).unwrap()).bsdf(Bsdf::Filter(Box::new(filter)))
}

/// Stokes parameters of unit light behind filters in sequence, the last one nearest to the sensor.
pub fn behind(filters: Vec<(FilterElement, DQuat)>) -> [f64; 4] {
    let camera = Camera::orthographic(DVec3::Z * 9.0, DVec3::ZERO, 1e-3).with_up(DVec3::Y);
    let mut scene = Scene::builder().film(1, 1).channels(1).camera(camera);
    for (i, (element, turn)) in filters.into_iter().enumerate() {
        let center = DVec3::Z * (4.0 * i as f64 - 6.0);
        scene = scene.object(square(&format!("filter {i}"), center, turn, element));
    }
    let scene = scene.emitter(Emitter::constant(1.0)).build().unwrap();
    stokes(&polarized(&scene, None, 4, 1))
}

/// Compares Stokes parameters with Mitsuba 3.9.1 (scalar_spectral_polarized): unpolarised light
/// that filters transmit to a camera, divided by its intensity, to Mitsuba's four digits. Mitsuba
/// rotates the axes of polarisers in the opposite sense to axes of retarders.
#[test]
fn filters_do_what_those_of_mitsuba_do() {
    let plain = DQuat::IDENTITY;
    let flipped = DQuat::from_rotation_y(180f64.to_radians());
    let tilted = DQuat::from_axis_angle(DVec3::new(0.48, 0.64, 0.6), 50f64.to_radians());
    let circular = |left_handed| FilterElement::CircularPolarizer { left_handed };
    let first = || (polarizer(0.0), plain);
    for (filters, expected) in [
        (
            vec![(polarizer(30.0), plain)],
            [0.4738, 0.2369, -0.4103, 0.0],
        ),
        (
            vec![(polarizer(30.0), flipped)],
            [0.4738, 0.2369, 0.4103, 0.0],
        ),
        (
            vec![(polarizer(30.0), tilted)],
            [0.4738, 0.4702, -0.0579, 0.0],
        ),
        (
            vec![first(), (retarder(30.0, 40.0), plain)],
            [0.4742, 0.3910, 0.0480, 0.2639],
        ),
        (
            vec![first(), (retarder(30.0, 40.0), flipped)],
            [0.4742, 0.3910, -0.0480, -0.2639],
        ),
        (
            vec![first(), (retarder(45.0, 90.0), plain)],
            [0.4742, 0.0003, 0.0, 0.4741],
        ),
        (vec![(circular(false), plain)], [0.4738, 0.0, 0.0, 0.4738]),
        (vec![(circular(true), flipped)], [0.4738, 0.0, 0.0, -0.4738]),
        (
            vec![(FilterElement::Neutral, plain)],
            [0.4738, 0.0, 0.0, 0.0],
        ),
    ] {
        let found = behind(filters);
        assert!((found[0] - 0.5).abs() < 1e-6, "{found:?}");
        assert_alike(found, expected, 1e-3);
    }
}

/// Tests Malus's law, and light that a quarter-wave plate between crossed polarisers transmits.
#[test]
fn polarisers_pass_the_square_of_the_cosine() {
    let plain = DQuat::IDENTITY;
    for degrees in [0.0, 25.0, 60.0, 90.0f64] {
        let filters = vec![(polarizer(10.0), plain), (polarizer(10.0 + degrees), plain)];
        let found = behind(filters);
        let expected = 0.5 * degrees.to_radians().cos().powi(2);
        assert!((found[0] - expected).abs() < 1e-6, "{degrees}: {found:?}");
    }
    let crossed = [polarizer(0.0), retarder(45.0, 90.0), polarizer(90.0)];
    let found = behind(crossed.map(|element| (element, plain)).into());
    assert!((found[0] - 0.25).abs() < 1e-6, "{found:?}");
}

/// The sun and a bulb light a slab through a tilted polariser and a retarder behind it. Light
/// scattered once has the polarisation of dipoles in this field.
#[test]
fn connections_pass_filters() {
    let travels = DVec3::new(0.6, 0.0, -0.8);
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 35f64.to_radians());
    let axis = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        turn * DVec3::new(cos, sin, 0.0)
    };
    // The polariser absorbs along the projection of its axis at −(20° − 90°).
    let passes = axis(70.0).cross(travels).normalize();
    let fast = axis(15.0).reject_from_normalized(travels).normalize();
    let slow = travels.cross(fast);
    let delay = num_complex::Complex64::cis(65f64.to_radians());
    let field = Coherency::linear(passes).retarded([fast, slow], delay);
    let objects = [
        square("polariser", travels * -12.0, turn, polarizer(20.0)),
        square("retarder", travels * -8.0, turn, retarder(15.0, 65.0)),
    ];
    assert_scattered_once(travels, &objects, |view, horizontal| {
        field.scattered(-view).stokes(-view, horizontal)
    });
}
