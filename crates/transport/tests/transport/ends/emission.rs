//! Light emitted by points and surfaces, and properties of every emitter.

use crate::common::samples;
use crate::ends::support::*;
use glam::DVec3;
use morgana_transport::connection_end::{ConnectionEnd, OnSurface};
use morgana_transport::emitter::{
    AngularProfile, Divergence, Emitter, Fiber, Luminaire, LuminaireError, Projector, Slide,
};
use morgana_transport::shape::Site;
use morgana_transport::texture::{BitmapFilter, Wrap};
use morgana_transport::{Orientation, Spectrum};
use std::f64::consts::FRAC_PI_2;
use testkit::{DirectionTable, Family, Mass, Rng, uniform_edges};

/// A point of a surface with the normal `axis()`, or a point in space.
fn end_at(surface: bool) -> ConnectionEnd {
    ConnectionEnd::Point {
        position: DVec3::ZERO,
        surface: surface.then(|| OnSurface {
            object: 0,
            normal: axis(),
            site: Site::default(),
        }),
    }
}

/// Returns the p-value of the directions in which light leaves a point. Bins end at a cosine of
/// `rim`.
fn directions(emitter: &Emitter, shapes: &[morgana_transport::shape::Shape], rim: f64) -> f64 {
    let end = emit(emitter, shapes, [0.5; 4]).unwrap().end;
    let axis = match end {
        ConnectionEnd::Point {
            surface: Some(OnSurface { normal, .. }),
            ..
        } => normal,
        _ => match emitter {
            Emitter::Fiber(fiber) => fiber.direction(),
            _ => axis(),
        },
    };
    let mut edges = uniform_edges(rim, 1.0, 12);
    if rim > -1.0 {
        edges.insert(0, -1.0);
    }
    let table = DirectionTable::new(axis.to_array(), edges, 16);
    let draw = |rng: &mut Rng| {
        let [a, b] = rng.uniform();
        let emission = emit(emitter, shapes, [0.5, 0.5, a, b]);
        // Count directions without light as `None`: nothing leaves along the rim of a spot.
        emission.map(|e| e.direction.to_array())
    };
    let pdf = |d: [f64; 3]| pdf_emit(emitter, &end, DVec3::ZERO, d.into());
    table
        .test(1, samples(100_000, 30_000), Mass::Exactly(1.0), draw, pdf)
        .unwrap()
        .p_value
}

#[test]
fn directions_of_light_from_points_follow_their_density() {
    let shapes = shapes();
    let area = |object| Emitter::Area {
        object,
        radiance: color(),
    };
    let point = Emitter::Point {
        position: DVec3::Y,
        intensity: color(),
    };
    let fibre = |profile| Emitter::Fiber(fiber(profile, color()));
    let wide = |profile, angle| {
        let divergence = Divergence::HalfAngle(angle);
        Emitter::Fiber(Fiber::new(rectangle(None), profile, divergence, color()))
    };
    let tilted = |profile| {
        let direction = along_axis().to_world(DVec3::new(0.3, -0.2, 0.9));
        let divergence = Divergence::HalfAngle(FRAC_PI_2);
        let fibre = Fiber::new(rectangle(None), profile, divergence, color());
        Emitter::Fiber(fibre.with_axis(direction))
    };
    let angles = || {
        let angles = [0.5f64, 0.0, -0.5].map(f64::acos);
        AngularProfile::angles(angles.to_vec(), &[1.0, 3.0]).unwrap()
    };
    let mut family = Family::new(FALSE_ALARM);
    for (name, emitter, rim) in [
        ("point", point, -1.0),
        ("spot", spot(color(), CUTOFF, BEAM_WIDTH), CUTOFF.cos()),
        ("sharp spot", spot(color(), CUTOFF, CUTOFF), CUTOFF.cos()),
        ("narrow spot", spot(color(), 1e-3, 5e-4), 1e-3f64.cos()),
        ("round spot", spot(color(), std::f64::consts::PI, 0.1), -1.0),
        ("slide", slide(color()), CUTOFF.cos()),
        ("projector", projector(color()), -1.0),
        ("ies", light(color()), -1.0),
        ("fibre", fibre(AngularProfile::Uniform), ACCEPTANCE.cos()),
        (
            "Lambertian fibre",
            fibre(AngularProfile::Lambertian),
            ACCEPTANCE.cos(),
        ),
        ("Gaussian fibre", fibre(AngularProfile::Gaussian), 0.0),
        (
            "wide fibre",
            wide(AngularProfile::Uniform, 2.5),
            2.5f64.cos(),
        ),
        ("tilted fibre", tilted(AngularProfile::Lambertian), 0.0),
        ("slopes", wide(AngularProfile::Slopes([0.3, 0.4]), 1.0), 0.0),
        // The angles are edges of bins: the density jumps there.
        ("angles", wide(angles(), 1.0), -1.0),
        ("parallelogram", area(0), 0.0),
        ("ellipsoid", area(1), 0.0),
    ] {
        family.push(name, directions(&emitter, &shapes, rim));
    }
    family.check().unwrap();
}

/// A connection could have led to the emitted ray, and the ray's parts agree with its reported
/// values.
#[test]
fn an_emission_agrees_with_end_and_emitted() {
    let (shapes, mut rng) = (shapes(), Rng::new(3));
    for (name, emitter) in emitters(color()) {
        for _ in 0..1000 {
            let u: [f64; 4] = rng.uniform();
            let Some(e) = emit(&emitter, &shapes, u) else {
                panic!("{name} does not shine for {u:?}");
            };
            let sampled = emitter.sample_end(&AROUND, |i| &shapes[i], [u[0], u[1]]);
            assert_eq!((sampled.end, sampled.pdf), (e.end, e.end_pdf), "{name}");
            assert_eq!(
                emitter.emitted(&e.end, e.x, e.direction),
                e.emitted,
                "{name}"
            );
            assert_eq!(
                pdf_emit(&emitter, &e.end, e.x, e.direction),
                e.pdf,
                "{name}"
            );
            assert!((e.direction.length() - 1.0).abs() < 1e-12, "{name}");
            match e.end {
                ConnectionEnd::Point { position, .. } => assert_eq!(position, e.x, "{name}"),
                ConnectionEnd::Plane {
                    through, direction, ..
                } => {
                    assert_eq!(direction, e.direction, "{name}");
                    assert!((e.x - through).dot(direction).abs() < 1e-12, "{name}");
                }
            }
        }
    }
}

#[test]
fn black_emitters_send_nothing_out() {
    let (shapes, mut rng) = (shapes(), Rng::new(4));
    for (name, emitter) in emitters(Spectrum::ZERO) {
        let emission = emit(&emitter, &shapes, rng.uniform());
        assert_eq!(emission, None, "{name}");
    }
}

#[test]
fn rays_that_are_never_drawn_have_density_zero() {
    let at =
        |emitter: &Emitter, end: &ConnectionEnd, x, direction| pdf_emit(emitter, end, x, direction);
    let turned = |angle: f64| {
        let across = axis().any_orthonormal_vector();
        axis() * angle.cos() + across * angle.sin()
    };
    let spot = spot(color(), CUTOFF, BEAM_WIDTH);
    let from_spot = |angle| at(&spot, &end_at(false), DVec3::X, turned(angle));
    assert!(from_spot(CUTOFF - 1e-9) > 0.0);
    assert_eq!((from_spot(CUTOFF + 1e-9), from_spot(3.0)), (0.0, 0.0));
    let area = Emitter::Area {
        object: 0,
        radiance: color(),
    };
    let from_area = |direction| at(&area, &end_at(true), DVec3::ZERO, direction);
    assert!(from_area(axis()) > 0.0);
    assert_eq!(from_area(-axis()), 0.0);
    let (_, directional) = emitters(color()).remove(5);
    let offset = turned(std::f64::consts::FRAC_PI_2);
    let parallel = |r: f64| {
        let x = AROUND.center + offset * r - axis() * 7.0;
        at(
            &directional,
            &ConnectionEnd::Point {
                position: x,
                surface: None,
            },
            x,
            axis(),
        )
    };
    assert!(parallel(AROUND.radius * 0.999) > 0.0);
    assert_eq!(parallel(AROUND.radius * 1.001), 0.0);
}

/// Compares intensities with Mitsuba 3.9.1 for one projector: nearest pixels, and bilinear between
/// pixels of an image that repeats or is clamped.
#[test]
fn a_projector_throws_what_mitsubas_does() {
    let place = DVec3::new(1.0, 2.0, 3.0);
    let pixels: Vec<Spectrum> = (0..8)
        .map(|i| Spectrum::splat(0.2 * f64::from(i + 1)))
        .collect();
    let table = [
        ([1.0, 2.0], [4.398_229_6, 2.827_433_3, 2.827_433_3]),
        ([1.5, 2.2], [1.395_744_3, 1.569_049_3, 1.569_049_3]),
        ([0.5, 2.2], [2.093_616_4, 2.777_799_5, 2.777_799_5]),
        ([1.8, 1.7], [4.039_723_2, 4.068_727_3, 4.132_119_6]),
        ([0.3, 1.6], [6.300_271_7, 5.466_394_5, 6.073_805_2]),
        ([2.2, 2.0], [0.0; 3]),
        ([1.0, 2.55], [2.102_773_4, 3.021_343_2, 1.752_311_4]),
        ([1.0, 2.6], [0.0; 3]),
        ([2.15, 2.0], [4.822_069_0, 4.316_307_6, 2.893_241_6]),
    ];
    let ways = [
        (BitmapFilter::Nearest, Wrap::Repeat),
        (BitmapFilter::Bilinear, Wrap::Repeat),
        (BitmapFilter::Bilinear, Wrap::Clamp),
    ];
    for (k, (filter, wrap)) in ways.into_iter().enumerate() {
        let slide = Slide {
            size: [4, 2],
            pixels: pixels.clone(),
            filter,
            wrap,
        };
        // Looking along +z with +y up, the image has the right orientation seen from behind the
        // projector.
        let fov = 60f64.to_radians();
        let projector = Projector::new(place, Orientation::IDENTITY, fov, slide).unwrap();
        for ([x, y], expected) in table {
            let direction = (DVec3::new(x, y, 5.0) - place).normalize();
            let ours = projector.intensity(direction)[0];
            assert!(
                (ours - expected[k]).abs() < 2e-6 * (1.0 + expected[k]),
                "{filter:?} {wrap:?} ({x}, {y}): {ours}"
            );
        }
    }
}

#[test]
fn lights_that_are_refused() {
    let make = |polar: &[f64], azimuths: &[f64], values: &[f64]| {
        let angles = [polar.to_vec(), azimuths.to_vec()];
        Luminaire::new(
            DVec3::ZERO,
            Orientation::IDENTITY,
            color(),
            angles,
            values.to_vec(),
        )
        .unwrap_err()
    };
    let (polar, one) = ([0.0, 90.0], [0.0]);
    assert_eq!(make(&[0.0], &one, &[1.0]), LuminaireError::Polar);
    assert_eq!(make(&[0.0, 181.0], &one, &[1.0; 2]), LuminaireError::Polar);
    assert_eq!(
        make(&[0.0, f64::NAN], &one, &[1.0; 2]),
        LuminaireError::Polar
    );
    assert_eq!(
        make(&polar, &[0.0, 180.0], &[1.0; 4]),
        LuminaireError::Azimuths
    );
    let error = LuminaireError::Count {
        expected: 2,
        found: 3,
    };
    assert_eq!(make(&polar, &one, &[1.0; 3]), error);
    assert_eq!(make(&polar, &one, &[-1.0, 1.0]), LuminaireError::Intensity);
    assert_eq!(make(&polar, &one, &[0.0; 2]), LuminaireError::Intensity);
}
