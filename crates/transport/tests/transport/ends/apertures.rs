//! Light from rectangles, with and without an image, and from the ends of fibres.

use crate::ends::support::*;
use glam::DVec3;
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber, Slide,
};
use morgana_transport::texture::{BitmapFilter, Wrap};
use morgana_transport::{Orientation, Spectrum};
use std::f64::consts::FRAC_PI_2;
use testkit::{Family, Mass, Rng, Table, uniform_edges};

/// Point of the rectangles' plane at local coordinates.
fn place([x, y]: [f64; 2]) -> DVec3 {
    let axes = along_axis();
    ORIGIN + axes.to_world(DVec3::X) * x + axes.to_world(DVec3::Y) * y
}

fn local(point: DVec3) -> [f64; 2] {
    let (axes, offset) = (along_axis(), point - ORIGIN);
    [DVec3::X, DVec3::Y].map(|axis| axes.to_world(axis).dot(offset))
}

/// Starts are confined to the rectangle: edges of bins are the edges of the rectangle.
#[test]
fn starts_on_rectangles_follow_their_density() {
    let [width, height] = SIZE;
    let picture = || rectangle(Some(color()));
    let fibre = |aperture, divergence| {
        Fiber::new(aperture, AngularProfile::Uniform, divergence, color()).into()
    };
    let cone = Divergence::HalfAngle(ACCEPTANCE);
    let beam = |aperture| Emitter::from(Collimated::through(aperture, color()));
    let mut family = Family::new(FALSE_ALARM);
    for (name, emitter) in [
        ("rectangle", beam(rectangle(None))),
        ("picture", beam(picture())),
        ("fibre with a rectangle", fibre(rectangle(None), cone)),
        ("fibre with a picture", fibre(picture(), cone)),
    ] {
        let edges = |length: f64| uniform_edges(-0.5 * length, 0.5 * length, 12);
        let table = Table::new(edges(width), edges(height));
        let draw = |rng: &mut Rng| Some(local(emit(&emitter, &[], rng.uniform())?.x));
        let sampled = |x| match &emitter {
            // A fibre's starts have the density of its ends: emitted light over its power and the
            // density of directions.
            Emitter::Fiber(fiber) => {
                let (all, pdf) = (fiber.emitted(x, axis()).sum(), fiber.power().sum());
                all / pdf / pdf_emit(&emitter, &end(), x, axis())
            }
            _ => pdf_emit(&emitter, &end(), x, axis()),
        };
        let pdf = |p: [f64; 2]| sampled(place(p));
        let report = table.test(13, 100_000, Mass::Exactly(1.0), draw, pdf);
        family.push(name, report.unwrap().p_value);
    }
    family.check().unwrap();
}

/// Starts on a ring have a uniform square of the radius, and on a parallelogram uniform coordinates
/// along its sides; the density of ends is constant there. Irradiance is zero in the middle of the
/// ring and beside the parallelogram.
#[test]
fn starts_on_rings_and_parallelograms() {
    let mut family = Family::new(FALSE_ALARM);
    let [inner, radius, skew] = [0.2, 0.3, 0.5];
    let ring = BeamProfile::Annulus { inner, radius };
    let ring = Collimated::through(Aperture::new(ORIGIN, axis(), ring), color());
    let sheared = Collimated::through(rectangle(Some(color())).with_skew(skew), color());
    let [width, height] = SIZE;
    let area = std::f64::consts::PI * (radius * radius - inner * inner);
    let of_ring = |rng: &mut Rng| {
        let emission = emit(&ring.clone().into(), &[], rng.uniform()).unwrap();
        assert!((emission.pdf * area - 1.0).abs() < 1e-12);
        let [r, turn] = polar(emission.x, ORIGIN, axis());
        Some([
            (r * r - inner * inner) / (radius * radius - inner * inner),
            turn,
        ])
    };
    let turns = std::f64::consts::PI;
    let table = Table::new(uniform_edges(0.0, 1.0, 10), uniform_edges(-turns, turns, 8));
    let report = table.test(5, 50_000, Mass::Exactly(1.0), of_ring, |_| 0.5 / turns);
    family.push("ring", report.unwrap().p_value);
    // Relative irradiance of the sheared image is that of the image at equal coordinates.
    let plain = Collimated::through(rectangle(Some(color())), color());
    for (x, y) in [(0.1, -0.15), (-0.3, 0.19), (0.34, 0.0)] {
        let moved = sheared.irradiance(place([x + skew * y / height, y]));
        assert!((moved[0] - plain.irradiance(place([x, y]))[0]).abs() < 1e-12);
    }
    assert_eq!(
        sheared.irradiance(place([0.5 * width, -0.4 * height])),
        Spectrum::ZERO
    );
    assert_eq!(ring.irradiance(ORIGIN), Spectrum::ZERO);
    assert!((sheared.power()[0] - color()[0]).abs() < 1e-12);
    let of_sheared = |rng: &mut Rng| {
        let [x, y] = local(emit(&sheared.clone().into(), &[], rng.uniform())?.x);
        Some([x - skew * y / height, y])
    };
    let edges = |length: f64| uniform_edges(-0.5 * length, 0.5 * length, 12);
    let table = Table::new(edges(width), edges(height));
    let sheared_end = end();
    let pdf = |p: [f64; 2]| {
        let plain: Emitter = plain.clone().into();
        pdf_emit(&plain, &sheared_end, place(p), axis())
    };
    let report = table.test(7, 50_000, Mass::Exactly(1.0), of_sheared, pdf);
    family.push("parallelogram", report.unwrap().p_value);
    family.check().unwrap();
}

/// Light of a fan lies in its plane and has a uniform angle there, whatever the axis of the fibre;
/// its density fills the fan.
#[test]
fn fans_are_flat_and_uniform() {
    let mut family = Family::new(FALSE_ALARM);
    let side = along_axis().to_world(DVec3::X);
    let tilted = along_axis().to_world(DVec3::new(0.0, 0.6, 0.8));
    for (name, half, direction) in [
        ("wedge", 0.5, axis()),
        ("tilted wedge", 1.2, tilted),
        ("all around", std::f64::consts::PI, axis()),
    ] {
        let divergence = Divergence::HalfAngle(half);
        let fan = Fiber::new(rectangle(None), AngularProfile::Fan, divergence, color());
        let fan: Emitter = fan.with_axis(direction).into();
        let up = direction.cross(side);
        let draw = |rng: &mut Rng| {
            let d = emit(&fan, &[], rng.uniform()).unwrap().direction;
            assert!(d.dot(side).abs() < 1.1e-6, "{name}");
            Some([d.dot(up).atan2(d.dot(direction)), rng.next_1d()])
        };
        let table = Table::new(uniform_edges(-half, half, 24), vec![0.0, 1.0]);
        let pdf = |_: [f64; 2]| 0.5 / half;
        let report = table.test(9, 20_000, Mass::Exactly(1.0), draw, pdf);
        family.push(name, report.unwrap().p_value);
        // The solid angle of a fan of sines up to 1e-6 on either side.
        let end = emit(&fan, &[], [0.5; 4]).unwrap().end;
        let inside = pdf_emit(&fan, &end, ORIGIN, direction);
        assert!((inside * 2.0 * half * 2e-6 - 1.0).abs() < 1e-9, "{name}");
        let beside = (direction + 2e-6 * side).normalize();
        assert_eq!(pdf_emit(&fan, &end, ORIGIN, beside), 0.0);
    }
    family.check().unwrap();
}

/// Slopes are independent normal numbers with the given deviations: their squares over the variances
/// have the mean 1 and the variance 2, and their product has the mean 0 and the variance 1.
#[test]
fn slopes_are_normal() {
    let deviations = [0.3, 0.1];
    let aperture = rectangle(None);
    let divergence = Divergence::HalfAngle(FRAC_PI_2);
    let profile = AngularProfile::Slopes(deviations);
    let emitter: Emitter = Fiber::new(aperture, profile, divergence, color()).into();
    let [x, y] = [DVec3::X, DVec3::Y].map(|a| along_axis().to_world(a));
    let mut rng = Rng::new(17);
    let mut sums = [0.0; 3];
    const COUNT: usize = 40_000;
    for _ in 0..COUNT {
        let d = emit(&emitter, &[], rng.uniform()).unwrap().direction;
        let [p, q] = [x, y].map(|a| d.dot(a) / d.dot(axis()));
        let [p, q] = [p / deviations[0], q / deviations[1]];
        sums[0] += p * p - 1.0;
        sums[1] += q * q - 1.0;
        sums[2] += p * q;
    }
    let root = (COUNT as f64).sqrt();
    let zs = [
        sums[0] / root / 2f64.sqrt(),
        sums[1] / root / 2f64.sqrt(),
        sums[2] / root,
    ];
    testkit::z_test::max_abs_z(&zs, FALSE_ALARM).unwrap();
}

fn end() -> morgana_transport::connection_end::ConnectionEnd {
    emit(
        &Collimated::through(rectangle(None), color()).into(),
        &[],
        [0.5; 4],
    )
    .unwrap()
    .end
}

/// Looking along the light with local +y up, local +x is to the left.
#[test]
fn a_picture_is_the_right_way_round() {
    let slide = Slide {
        size: [2, 2],
        pixels: [1.0, 2.0, 3.0, 4.0].map(Spectrum::splat).to_vec(),
        filter: BitmapFilter::Nearest,
        wrap: Wrap::Clamp,
    };
    let of = |slide| Aperture::picture(DVec3::ZERO, Orientation::IDENTITY, [2.0, 2.0], slide);
    let aperture = of(slide.clone()).unwrap();
    // 10 W over four pixels of unit area.
    let beam = Collimated::through(aperture.clone(), Spectrum::splat(10.0));
    for (x, y, expected) in [
        (0.5, 0.5, 1.0),
        (-0.5, 0.5, 2.0),
        (0.5, -0.5, 3.0),
        (-0.5, -0.5, 4.0),
        (1.1, 0.0, 0.0),
    ] {
        let irradiance = beam.irradiance(DVec3::new(x, y, 0.0))[0];
        assert!((irradiance - expected).abs() < 1e-12, "({x}, {y})");
    }
    let given = Collimated::with_irradiance(aperture, Spectrum::splat(2.0));
    assert_eq!(given.power(), Spectrum::splat(20.0));
    let black = vec![Spectrum::ZERO; 4];
    assert!(
        of(Slide {
            pixels: black,
            ..slide.clone()
        })
        .is_err()
    );
    let few = vec![Spectrum::ONE; 3];
    assert!(
        of(Slide {
            pixels: few,
            ..slide
        })
        .is_err()
    );
}

/// The fraction of light within an angle, in closed form for each profile, equals an integral over
/// the emission. The integral is a midpoint rule of 20000 points, with errors below 1e-7.
#[test]
fn cones_of_fibres_have_their_profiles() {
    let sin2 = ACCEPTANCE.sin().powi(2);
    let uniform = |theta: f64| (1.0 - theta.cos()) / (1.0 - ACCEPTANCE.cos());
    let lambertian = |theta: f64| theta.sin().powi(2) / sin2;
    let gaussian = |theta: f64| {
        let within = |sin: f64| -(-2.0 * sin * sin / sin2).exp_m1();
        within(theta.sin()) / within(1.0)
    };
    type Share<'a> = &'a dyn Fn(f64) -> f64;
    let cases: [(AngularProfile, Share, f64); 3] = [
        (AngularProfile::Uniform, &uniform, ACCEPTANCE),
        (AngularProfile::Lambertian, &lambertian, ACCEPTANCE),
        (AngularProfile::Gaussian, &gaussian, FRAC_PI_2),
    ];
    for (profile, share, all) in cases {
        let fiber = fiber(profile.clone(), Spectrum::ONE);
        let across = axis().any_orthonormal_vector();
        let toward = |theta: f64| axis() * theta.cos() + across * theta.sin();
        // Multiply the disc's irradiance by the intensity per area.
        let intensity =
            |theta: f64| fiber.emitted(ORIGIN, toward(theta))[0] * std::f64::consts::PI * 0.09;
        for limit in [0.3 * all, 0.8 * all, all] {
            let step = limit / 20_000.0;
            let ring = |k: u32| {
                let theta = (f64::from(k) + 0.5) * step;
                std::f64::consts::TAU * theta.sin() * step * intensity(theta)
            };
            let found: f64 = (0..20_000).map(ring).sum();
            let error = found - share(limit);
            assert!(error.abs() < 1e-7, "{profile:?} {limit}: {error}");
        }
    }
}
