//! Light from rectangles, with and without an image, and from the ends of fibres.

use crate::ends::support::*;
use glam::DVec3;
use morgana_transport::emitter::{
    AngularProfile, Aperture, Collimated, Divergence, Emitter, Fiber, Slide,
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
        let fiber = fiber(profile, Spectrum::ONE);
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
