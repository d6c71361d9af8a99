//! Fractions of the power of sources that pass discs across their axes, by particles and meters.

use crate::common::{parts, vacuum};
use crate::sources::support::*;
use crate::sources::volumes::{centred, uniform};
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber,
};
use morgana_transport::medium::Medium;
use morgana_transport::meter::{IrradianceMeter, Meter, Positions};
use morgana_transport::render::{Handle, MeasureOptions, measure};
use morgana_transport::sensor::Sensor;
use morgana_transport::shape::{Disk, Rectangle, Shape, Sphere};
use morgana_transport::{Orientation, Scene, Spectrum};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

/// A fraction of power and its standard error.
type Share = (f64, f64);

/// Fractions of an emitter's power that pass the parts of a shape, in an index `n`.
fn through(emitter: Emitter, shape: Shape, resolution: [usize; 2], n: f64) -> Vec<Share> {
    let ambient = Medium {
        index: Constant::new(n).into(),
        ..vacuum()
    };
    let sensor = Sensor::Absent(DAffine3::IDENTITY);
    let parts = parts(vec![unseen(shape)], vec![ambient], vec![emitter], sensor);
    let positions = Positions::new(&parts.objects[0].shape, resolution, false);
    let meter = Meter::Irradiance(IrradianceMeter::at(0, positions));
    let options = MeasureOptions {
        first: 0,
        particles: 40_000,
        seed: 3,
        max_depth: None,
        rr_depth: 5,
    };
    let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
    let go_on = |_| ControlFlow::Continue(());
    let found = measure(&[scene], &[meter], &options, &Handle::default(), go_on).unwrap();
    assert!((found.emitted[0] - 1.0).abs() < 1e-12);
    let mut readings = found.readings[0].iter();
    let name = if resolution == [1, 1] {
        "power"
    } else {
        "binned_power"
    };
    let power = readings.find(|r| r.name == name).unwrap();
    power
        .mean
        .iter()
        .copied()
        .zip(power.error.iter().copied())
        .collect()
}

/// Fraction of power that passes a disc across +z around the axis.
fn through_disc(emitter: impl Into<Emitter>, distance: f64, radius: f64, n: f64) -> Share {
    let to_world = facing(DVec3::Z * distance, DVec3::NEG_Z, radius);
    let sides = through(
        emitter.into(),
        Disk::new(to_world).unwrap().into(),
        [1, 1],
        n,
    );
    // All of the power comes from one side.
    let total: f64 = sides.iter().map(|s| s.0).sum();
    sides.into_iter().find(|s| s.0 == total).unwrap()
}

/// The view factor between coaxial parallel discs (J. R. Howell, "A Catalog of Radiation Heat Transfer Configuration Factors",
/// C-41).
fn view_factor(r1: f64, r2: f64, distance: f64) -> f64 {
    let (a, b) = (r1 / distance, r2 / distance);
    let x = 1.0 + (1.0 + b * b) / (a * a);
    0.5 * (x - (x * x - 4.0 * (b / a).powi(2)).sqrt())
}

#[test]
fn discs_get_their_shares() {
    let angle = 0.4;
    let cone = Divergence::HalfAngle(angle);
    let point = 1e-9;
    let at = |share: f64| move |(mean, error): Share| (mean - share) / error;
    let mut zs = Vec::new();
    // A disc that radiates by Lambert's law.
    let wide = fiber(
        0.5,
        AngularProfile::Lambertian,
        Divergence::HalfAngle(FRAC_PI_2),
    );
    for (radius, distance) in [(0.5, 0.3), (1.0, 1.0)] {
        let share = view_factor(0.5, radius, distance);
        zs.push(at(share)(through_disc(wide.clone(), distance, radius, 1.0)));
    }
    // Half-angle of fibres that are nearly points.
    let half = 2.0 * (0.5 * angle).tan();
    let gaussian = |theta: f64| -(-2.0 * (theta.sin() / angle.sin()).powi(2)).exp_m1();
    for (profile, share) in [
        (
            AngularProfile::Uniform,
            (1.0 - (0.5 * angle).cos()) / (1.0 - angle.cos()),
        ),
        (
            AngularProfile::Lambertian,
            ((0.5 * angle).sin() / angle.sin()).powi(2),
        ),
        (
            AngularProfile::Gaussian,
            gaussian(0.5 * angle) / gaussian(FRAC_PI_2),
        ),
    ] {
        let found = through_disc(fiber(point, profile, cone), 2.0, half, 1.0);
        zs.push(at(share)(found));
    }
    // A volume that is nearly a point, and one whose light a sphere receives completely.
    let glow = |half: f64| {
        let volume = 8.0 * half.powi(3);
        uniform(centred(DVec3::splat(half)), 1.0 / (4.0 * PI * volume))
    };
    let cap = 0.5 * (1.0 - 0.7f64.cos());
    zs.push(at(cap)(through_disc(glow(1e-6), 1.0, 0.7f64.tan(), 1.0)));
    let sphere = Sphere::around(DVec3::ZERO, 2.0).unwrap();
    let all = through(glow(0.5), sphere.into(), [1, 1], 1.3);
    let all: f64 = all.iter().map(|share| share.0).sum();
    assert!((all - 1.0).abs() < 1e-12, "{all}");
    // With a focus at twice the distance, the beam has half its radius; a disc of half that radius
    // has a quarter of its area.
    let narrow = || fiber(1.0, AngularProfile::Uniform, Divergence::HalfAngle(1e-6));
    let converging = narrow().with_focus(2.0);
    zs.push(at(0.25)(through_disc(converging, 1.0, 0.25, 1.0)));
    let diverging = narrow().with_focus(-2.0);
    zs.push(at(0.25)(through_disc(diverging, 2.0, 1.0, 1.0)));
    // A Gaussian beam from its waist on has w² = w₀² + z² tan²θ₀ for small angles, and the fraction
    // 1 − e⁻² within w.
    let waist = BeamProfile::Gaussian { waist: 0.05 };
    let laser = Fiber::new(
        Aperture::new(DVec3::ZERO, DVec3::Z, waist),
        AngularProfile::Gaussian,
        Divergence::HalfAngle(0.01),
        Spectrum::ONE,
    );
    let within = through_disc(laser, 10.0, 0.05f64.hypot(0.1), 1.0);
    zs.push(at(1.0 - (-2.0f64).exp())(within));
    max_abs_z(&zs, FAMILY).unwrap();
}

/// All of the light lies within the cone, whose size depends on the index, and within the spot of a
/// focus.
#[test]
fn nothing_is_beside_the_cone() {
    let aperture = Divergence::NumericalAperture(0.5);
    for n in [1.0f64, 1.4] {
        let (radius, distance) = (0.1, 2.0);
        let tan = (0.5 / n) / (1.0f64 - (0.5 / n).powi(2)).sqrt();
        let edge = radius + distance * tan;
        let fibre = || fiber(radius, AngularProfile::Lambertian, aperture);
        let (all, _) = through_disc(fibre(), distance, 1.000_001 * edge, n);
        assert!((all - 1.0).abs() < 1e-9, "{all}");
        let (less, _) = through_disc(fibre(), distance, 0.95 * edge, n);
        assert!((0.9..0.9999).contains(&less), "{less}");
    }
    let spread = Divergence::HalfAngle(1e-4);
    let focused = fiber(1.0, AngularProfile::Uniform, spread).with_focus(2.0);
    // Rays from the edge meet the focal plane at an angle whose tangent is ½.
    let (all, _) = through_disc(focused, 2.0, 2.0 * 1.26e-4 * 5f64.sqrt() / 2.0, 1.0);
    assert!((all - 1.0).abs() < 1e-9, "{all}");
}

/// Quarters of a screen receive the pixels of an image.
#[test]
fn a_beam_throws_its_picture() {
    let size = [2.0, 2.0];
    let aperture = Aperture::picture(DVec3::ZERO, Orientation::IDENTITY, size, picture()).unwrap();
    let beam = Collimated::through(aperture, Spectrum::ONE);
    let to_world = DAffine3::from_translation(DVec3::Z);
    let screen = Rectangle::new(to_world).unwrap().into();
    let found = through(beam.into(), screen, [2, 2], 1.0);
    // Order: by side, from local −x −y on. x points to the left of the image, y up.
    let quarters: Vec<Share> = found.into_iter().filter(|share| share.0 > 0.0).collect();
    let shares = [1.0, 2.0, 3.0, 0.5].map(|pixel| pixel / 6.5);
    assert_eq!(quarters.len(), 4);
    let zs = quarters
        .iter()
        .zip(shares)
        .map(|(q, share)| (q.0 - share) / q.1);
    max_abs_z(&zs.collect::<Vec<f64>>(), FAMILY).unwrap();
}
