//! Images of a spot of light on a wall by diffracting apertures, compared with the light of Airy's
//! pattern in each pixel. Statistical tests with fixed seeds; all pixels of all sensors and
//! estimators share a false-alarm rate of 1e-3.

use crate::common::{parts, path_tracer, samples, shoot_by, vacuum};
use eikonal::field::Constant;
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::medium::Medium;
use morgana_transport::scene::{FilmWindow, Object, Parts};
use morgana_transport::sensor::{
    ApertureShape, ApertureStop, Iris, Perspective, Sensor, Telecentric, ThinLens,
};
use morgana_transport::shape::Rectangle;
use std::f64::consts::PI;
use testkit::quadrature::{Effort, integrate_cell};
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-3;
/// Distance of the plane in focus, where the wall is.
const FOCUS: f64 = 10.0;
/// Half-width of the visible part of that plane, and radius of the spot of light.
const HALF: f64 = 1.0;
const SPOT: f64 = 0.05;
const PIXELS: usize = 8;

/// A scene in which a beam of power π lights a spot on a white wall, at `place` in the plane in
/// focus. The camera looks along +z with +x to its left.
fn scene(sensor: Sensor, place: DVec2) -> Parts {
    let map = DAffine3::from_scale_rotation_translation(
        DVec3::splat(3.0 * HALF),
        DQuat::from_rotation_y(PI),
        DVec3::Z * FOCUS,
    );
    let wall = Object {
        name: "wall".into(),
        shape: Rectangle::new(map).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap()),
        sides: None,
        emitter: None,
    };
    let profile = BeamProfile::Disc { radius: SPOT };
    let start = place.extend(0.5 * FOCUS);
    let beam = Collimated::new(start, DVec3::Z, profile, Spectrum::splat(PI));
    let beam = Emitter::Collimated(beam);
    let mut parts = parts(vec![wall], vec![vacuum()], vec![beam], sensor);
    (parts.film.width, parts.film.height) = (PIXELS, PIXELS);
    parts
}

fn covered(obscuration: f64) -> ApertureShape {
    let iris = Iris {
        obscuration,
        ..Iris::default()
    };
    ApertureShape::new(iris).unwrap()
}

/// A thin lens whose aperture would, if it were a disc, give a first dark ring of radius `ring` in
/// the plane in focus.
fn lens(ring: f64, aperture: ApertureShape) -> ThinLens {
    let radius = 0.05;
    let pinhole = Perspective::new(DAffine3::IDENTITY, 2.0 * (HALF / FOCUS).atan(), 1.0);
    // The ring has the radius r = 3.8317 λ f/(2π a) without an obscuration.
    let wavelength = 2.0 * PI * radius * ring / (3.831_706 * FOCUS);
    ThinLens::new(pinhole, radius, FOCUS)
        .with_aperture(aperture)
        .with_diffraction(wavelength)
}

/// Pattern of a ring aperture over reduced radii.
fn ring_pattern(obscuration: f64) -> impl Fn(DVec2) -> f64 {
    let amplitude = |v: f64| 2.0 * libm::j1(v) / v;
    move |v| {
        let v = v.length().max(1e-9);
        let covered = if obscuration > 0.0 {
            obscuration.powi(2) * amplitude(obscuration * v)
        } else {
            0.0
        };
        (amplitude(v) - covered).powi(2) / (4.0 * PI * (1.0 - obscuration * obscuration))
    }
}

/// Pattern of a slit that is open from −`half` to `half`.
fn slit_pattern(half: f64, v: f64) -> f64 {
    let v = half * v.abs().max(1e-9);
    half * (v.sin() / v).powi(2) / PI
}

/// Expected image of the spot, pixel by pixel. The first dark ring has the radius `ring` if the
/// aperture is a disc.
fn expected(ring: f64, pattern: impl Fn(DVec2) -> f64, place: DVec2) -> Vec<f64> {
    let per_length = 3.831_706 / ring;
    // Power per area of the plane, for a total power of one.
    let point = |from: DVec2| per_length * per_length * pattern(per_length * from);
    // Average over the spot, accurate to the fifth order: its centre and six points on a ring.
    let ring = |i: usize| DVec2::from_angle(PI / 3.0 * i as f64) * SPOT * (2.0_f64 / 3.0).sqrt();
    let spread = |[x, y]: [f64; 2]| {
        let from = DVec2::new(x, y) - place;
        let around: f64 = (0..6).map(|i| point(from - ring(i))).sum();
        0.25 * point(from) + 0.125 * around
    };
    let effort = Effort {
        tolerance: 1e-8,
        ..Effort::default()
    };
    let pixel = 2.0 * HALF / PIXELS as f64;
    let at = |i: usize| {
        // Pixels run from the left, which is +x, and from above.
        let (x, y) = (
            HALF - pixel * (i % PIXELS) as f64,
            HALF - pixel * (i / PIXELS) as f64,
        );
        let share = integrate_cell(&spread, [x - pixel, y - pixel], [x, y], effort);
        // A white wall reflects 1/π of the irradiance as radiance.
        share / (pixel * pixel)
    };
    (0..PIXELS * PIXELS).map(at).collect()
}

/// Returns the deviations of pixels in standard errors. Pixels with more than 1/150 of the light
/// count singly; the others have too few samples for a normal mean and are summed.
fn deviations(by: Integrator, parts: Parts, samples: u64, expected: &[f64]) -> Vec<f64> {
    let rendering = shoot_by(by, parts, samples, 5);
    let total: f64 = expected.iter().sum();
    let (sum, error) = rendering.film.summary();
    assert!(error * 40.0 < sum, "{sum} ± {error} says nothing");
    let (mut zs, mut rest) = (Vec::new(), [0.0; 2]);
    for (pixel, expected) in rendering.film.pixels(0).zip(expected) {
        let found = [pixel.mean()[0] - expected, pixel.variance_of_mean()[0]];
        if *expected > total / 150.0 {
            // Allow for cosines: of the beam's light, at up to six degrees, and of the lens.
            zs.push(found[0] / (found[1].sqrt() + 1e-5 * total));
        } else {
            rest = [rest[0] + found[0], rest[1] + found[1]];
        }
    }
    zs.push(rest[0] / (rest[1].sqrt() + 1e-4 * total));
    zs
}

fn particle() -> Integrator {
    Integrator::Particle(ParticleTracer::default())
}

#[test]
fn a_point_becomes_the_pattern_of_the_aperture() {
    let place = DVec2::new(0.2, -0.1);
    let telecentric = |aperture: ApertureShape| {
        let map = DAffine3::from_scale(DVec3::new(HALF, HALF, 1.0));
        let angle = 5e-3_f64;
        let stop = ApertureStop::new(angle.tan(), aperture);
        let wavelength = 2.0 * PI * 0.4 * angle.sin() / 3.831_706;
        let sensor = Telecentric::new(map, 1.0, FOCUS, stop).with_diffraction(wavelength);
        Sensor::Telecentric(sensor.unwrap())
    };
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let few = samples(2_000, 1_000);
    let mut zs = Vec::new();
    // An upright window of half the width.
    let window = ApertureShape::picture(4, &[0.0, 1.0, 1.0, 0.0].repeat(4)).unwrap();
    let window_pattern = |v: DVec2| slit_pattern(0.5, v.x) * slit_pattern(1.0, v.y);
    for (aperture, wanted) in [
        (covered(0.0), expected(0.4, ring_pattern(0.0), place)),
        (covered(0.5), expected(0.4, ring_pattern(0.5), place)),
        (window, expected(0.4, window_pattern, place)),
    ] {
        let lens = || Sensor::ThinLens(lens(0.4, aperture.clone()));
        let telecentric = || telecentric(aperture.clone());
        for (by, sensor, number) in [
            (path_tracer(), lens(), samples(40_000, 20_000)),
            (particle(), lens(), few),
            (particle(), telecentric(), few),
            (bdpt, telecentric(), few),
        ] {
            zs.extend(deviations(by, scene(sensor, place), number, &wanted));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// In water the pattern is smaller by a factor of the index. A crop shows its part of the image.
#[test]
fn the_pattern_shrinks_in_a_medium_and_stays_in_place_in_a_crop() {
    let place = DVec2::new(-0.3, 0.4);
    let n = 1.5;
    let wanted = expected(0.6 / n, ring_pattern(0.0), place);
    let mut parts = scene(Sensor::ThinLens(lens(0.6, ApertureShape::default())), place);
    parts.media = vec![Medium::transparent("water", Constant::new(n))];
    let cropped = {
        let mut crop = scene(parts.sensor.clone(), place);
        crop.media = parts.media.clone();
        (crop.film.width, crop.film.height) = (4, 3);
        crop.film.window = Some(FilmWindow {
            image: [PIXELS; 2],
            corner: [2.0, 1.0],
        });
        crop
    };
    let mut zs = deviations(particle(), parts, 2_000, &wanted);
    let window = |i: usize| wanted[(i / 4 + 1) * PIXELS + i % 4 + 2];
    let part: Vec<f64> = (0..12).map(window).collect();
    zs.extend(deviations(particle(), cropped, 4_000, &part));
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A transform that stretches the lens along x narrows the pattern there, in world units.
#[test]
fn offsets_follow_the_axes_of_the_aperture() {
    let at = |scale: DVec3| {
        let map = DAffine3::from_mat3(DMat3::from_diagonal(scale));
        let pinhole = Perspective::new(map, 1.0, 2.0);
        let lens = ThinLens::new(pinhole, 0.1, 1.0).with_diffraction(1e-3);
        let sensor = Sensor::ThinLens(lens);
        let point_spread = sensor.point_spread().unwrap().clone();
        let aim = |u: [f64; 2]| {
            // At the centre the lens is a pinhole, whose ray has the slope of the world.
            let [s, t] = point_spread.offset(1.0, || u);
            let d = sensor.ray([0.5 - s, 0.5 - t], [0.5; 2]).direction;
            [d.x / d.z, d.y / d.z]
        };
        [aim([0.5, 0.0])[0], aim([0.5, 0.25])[1]]
    };
    let [x, y] = at(DVec3::ONE);
    assert!((x - y).abs() < 1e-12, "a disc: {x} {y}");
    // Half of the light is within v = 1.680225 (Rayleigh's energy), at a slope of v λ/(2π a).
    assert!((x - 1.680_225 * 1e-3 / (2.0 * PI * 0.1)).abs() < 1e-4 * x);
    let [wide, high] = at(DVec3::new(2.0, 1.0, 1.0));
    assert!((wide - 0.5 * x).abs() < 1e-12 && (high - y).abs() < 1e-12);
    let [wide, high] = at(DVec3::splat(3.0));
    assert!((wide - x / 3.0).abs() < 1e-12 && (high - y / 3.0).abs() < 1e-12);
}

#[test]
fn a_knife_edge_has_no_pattern() {
    let stop = ApertureStop::with_knife(0.1, DVec2::X, 0.0);
    let sensor = Telecentric::new(DAffine3::IDENTITY, 1.0, 0.0, stop);
    assert!(sensor.with_diffraction(1e-6).is_none());
}
