//! Emitters and lenses, compared with closed forms. Two chi-square tests, each at a false-alarm
//! rate of 5e-4.

use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::emitter::{BeamProfile, Collimated, DistantDisc, Environment, Spot};
use morgana_transport::sensor::{Perspective, Sensor, ThinLens};
use morgana_transport::{Orientation, Spectrum};
use std::f64::consts::{PI, TAU};
use testkit::{DirectionTable, Family, Mass, Rng, uniform_edges};

/// Asserts that sampled directions have the reported density, and the density of the environment;
/// false-alarm rate 5e-4.
fn check_sampling(environment: &Environment, table: &DirectionTable, seed: u64) {
    let sample = |rng: &mut Rng| {
        let (direction, pdf) = environment.sample(rng.uniform());
        assert!((environment.pdf(direction) / pdf - 1.0).abs() < 1e-6);
        Some(direction.to_array())
    };
    let pdf = |direction: [f64; 3]| environment.pdf(DVec3::from_array(direction));
    let report = table
        .test(seed, 200_000, Mass::Exactly(1.0), sample, pdf)
        .unwrap();
    let mut family = Family::new(5e-4);
    family.push("environment", report.p_value);
    family.check().unwrap();
}

#[test]
fn environment_images_are_sampled_by_their_density() {
    let (width, height) = (12, 6);
    let pixels = (0..width * height)
        .map(|i| Spectrum::splat(0.2 + ((i * 7) % 5) as f64))
        .collect();
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.8, -0.5).normalize(), 1.1);
    let (turn, _) = Orientation::nearest(turn).unwrap();
    let image = Environment::image(width, height, pixels, turn).unwrap();
    // Align the bins with the image's own axis.
    let axis = turn.to_world(DVec3::Y).to_array();
    let table = DirectionTable::uniform(axis, 18, 24).with_mass_tolerance(2e-3);
    check_sampling(&image, &table, 1);
}

#[test]
fn discs_in_the_sky_are_sampled_by_their_density() {
    let center = DVec3::new(0.3, 0.8, -0.5).normalize();
    let disc = Environment::Disc(DistantDisc::new(center, 0.4, 2.0).unwrap());
    // Bins end at the disc's edge.
    let rim = 0.4f64.cos();
    let mut edges = vec![-1.0];
    edges.extend(uniform_edges(rim, 1.0, 6));
    let table = DirectionTable::new(center.to_array(), edges, 24);
    check_sampling(&disc, &table, 2);
    // A disc as narrow as the sun.
    let sun = Environment::Disc(DistantDisc::new(center, 4.675e-3, 2.0).unwrap());
    for k in 0..100 {
        let (direction, pdf) = sun.sample([0.01 * f64::from(k), 0.3]);
        assert!((sun.pdf(direction) / pdf - 1.0).abs() < 1e-9);
        assert_eq!(sun.radiance(direction), Spectrum::splat(2.0));
    }
    assert_eq!(sun.radiance(DVec3::X), Spectrum::ZERO);
}

/// Compares with Mitsuba 3.9.1: a map of 4 × 3 pixels, 1 to 12, at directions given by u and v, and
/// a map of 2 × 2 pixels, which Mitsuba pads by repeating the last row.
#[test]
fn environment_images_are_interpolated_as_in_mitsuba() {
    let map = |width: usize, height: usize| {
        let pixels = (1..=width * height).map(|i| Spectrum::splat(i as f64));
        Environment::image(width, height, pixels.collect(), Orientation::IDENTITY).unwrap()
    };
    let toward = |u: f64, v: f64| {
        let ((sin_phi, cos_phi), (sin, cos)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
        DVec3::new(sin_phi * sin, cos, -cos_phi * sin)
    };
    let fine = [
        ([0.125, 0.5], 5.0),
        ([0.25, 0.5], 5.5),
        ([0.05, 0.25], 3.9),
        ([0.97, 0.7], 8.459999),
        ([0.6, 0.9], 10.100001),
    ];
    let padded = [([0.4, 0.2], 2.1), ([0.9, 0.4], 3.3), ([0.1, 0.8], 3.3)];
    for (image, table) in [(map(4, 3), &fine[..]), (map(2, 2), &padded[..])] {
        for &([u, v], expected) in table {
            let ours = image.radiance(toward(u, v))[0];
            assert!((ours - expected).abs() < 1e-5, "({u}, {v}): {ours}");
        }
    }
}

/// The solid angle of a pixel vanishes at the poles of an image; densities keep their accuracy
/// there.
#[test]
fn densities_of_images_are_exact_near_the_poles() {
    let image = Environment::image(2, 2, vec![Spectrum::ONE; 4], Orientation::IDENTITY).unwrap();
    for v in [1e-3, 1e-6, 1e-9] {
        let u = [0.3, v];
        for u in [u, [0.3, 1.0 - v]] {
            let (direction, pdf) = image.sample(u);
            let ratio = image.pdf(direction) / pdf;
            assert!((ratio - 1.0).abs() < 1e-6, "{ratio} at {u:?}");
        }
    }
}

#[test]
fn a_beam_carries_its_power() {
    let power = Spectrum::splat(3.0);
    for profile in [
        BeamProfile::Disc { radius: 0.4 },
        BeamProfile::Gaussian { waist: 0.4 },
    ] {
        let beam = Collimated::new(DVec3::X, DVec3::Z, profile, power);
        // ∫ E(r) 2πr dr out to five radii.
        let n = 200_000;
        let h = 2.0 / n as f64;
        let sum: f64 = (0..n)
            .map(|i| (i as f64 + 0.5) * h)
            .map(|r| beam.irradiance(DVec3::X * (1.0 + r))[0] * 2.0 * std::f64::consts::PI * r * h)
            .sum();
        assert!((sum - 3.0).abs() < 1e-4, "{profile:?}: {sum}");
    }
}

#[test]
fn a_spot_fades_between_its_angles() {
    let spot = Spot::new(DVec3::ZERO, DVec3::Z, Spectrum::ONE, 0.4, 0.2);
    let at = |angle: f64| spot.intensity(DVec3::new(angle.sin(), 0.0, angle.cos()))[0];
    assert_eq!((at(0.1), at(0.5)), (1.0, 0.0));
    assert!((at(0.3) - 0.5).abs() < 1e-12);
}

/// A point at the focal distance is sharp: all rays of a pixel meet there, wherever they cross the
/// lens.
#[test]
fn thin_lens_rays_of_a_pixel_meet_in_focus() {
    let pinhole = Perspective::new(DAffine3::IDENTITY, 0.7, 1.5);
    let lens = Sensor::ThinLens(ThinLens::new(pinhole.clone(), 0.2, 3.0));
    let image = [0.3, 0.8];
    let center = Sensor::Perspective(pinhole).ray(image, [0.5, 0.5]);
    let focus = center.direction * (3.0 / center.direction.z);
    for k in 0..20 {
        let u = [(k as f64 * 0.37).fract(), (k as f64 * 0.61).fract()];
        let ray = lens.ray(image, u);
        assert!(ray.origin.truncate().length() <= 0.2 + 1e-12);
        let t = (focus - ray.origin).dot(ray.direction);
        assert!((ray.origin + ray.direction * t).distance(focus) < 1e-12);
    }
}
