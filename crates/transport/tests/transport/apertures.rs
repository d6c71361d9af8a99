//! Light sent by apertures made of cells, compared with the Fourier transforms of their shapes.
//! Statistical tests with fixed seeds; all cells of a shape share a false-alarm rate of 1e-3.

use glam::{DAffine3, DVec2};
use morgana_transport::sampling::Sampler;
use morgana_transport::sensor::{
    ApertureError, ApertureShape, ApertureStop, Iris, Perspective, Sensor, Telecentric, ThinLens,
};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};
use testkit::quadrature::{Effort, integrate_cell};
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-3;
const SAMPLES: u64 = 4_000_000;
/// Half-width, in reduced radii, of the square that is divided into cells, and the number of cells
/// along a side.
const REACH: f64 = 20.0;
const CELLS: usize = 20;

/// Samples an aperture. Returns the fractions of light in the cells of the square, row by row, and
/// beyond it.
fn counted(aperture: ApertureShape) -> Vec<f64> {
    // One unit of the image is a reduced radius.
    let pinhole = Perspective::new(DAffine3::IDENTITY, 2.0 * 0.5_f64.atan(), 1.0);
    let lens = ThinLens::new(pinhole, 1.0, 1.0).with_aperture(aperture);
    let sensor = Sensor::ThinLens(lens.with_diffraction(TAU));
    let spread = sensor.point_spread().unwrap();
    let mut counts = vec![0.0; CELLS * CELLS + 1];
    for sample in 0..SAMPLES {
        let mut sampler = Sampler::new(3, 0, sample);
        let at = spread.offset(1.0, || sampler.next_2d());
        let [i, j] = at.map(|v| ((v / REACH + 1.0) * 0.5 * CELLS as f64).floor());
        let inside = [i, j].iter().all(|k| (0.0..CELLS as f64).contains(k));
        let cell = if inside {
            j as usize * CELLS + i as usize
        } else {
            CELLS * CELLS
        };
        counts[cell] += 1.0 / SAMPLES as f64;
    }
    counts
}

/// Returns the fractions for the transform of a shape, ∫exp(−iv·p)dp over its open `area`.
fn integrated(area: f64, transform: impl Fn(DVec2) -> Complex64) -> Vec<f64> {
    let density = |[x, y]: [f64; 2]| transform(DVec2::new(x, y)).norm_sqr() / (TAU * TAU * area);
    let width = 2.0 * REACH / CELLS as f64;
    let effort = Effort {
        tolerance: 1e-7,
        ..Effort::default()
    };
    let mut shares: Vec<f64> = (0..CELLS * CELLS)
        .map(|i| {
            let from = [i % CELLS, i / CELLS].map(|k| k as f64 * width - REACH);
            integrate_cell(&density, from, from.map(|v| v + width), effort)
        })
        .collect();
    shares.push(1.0 - shares.iter().sum::<f64>());
    shares
}

/// Returns the deviations of fractions in standard errors. Cells with few samples are pooled.
fn deviations(found: &[f64], expected: &[f64]) -> Vec<f64> {
    let n = SAMPLES as f64;
    let mut rest = [0.0; 2];
    let mut zs = Vec::new();
    let z = |found: f64, expected: f64| {
        (found - expected) / (expected * (1.0 - expected) / n + 1e-9).sqrt()
    };
    for (found, expected) in found.iter().zip(expected) {
        if expected * n > 100.0 {
            zs.push(z(*found, *expected));
        } else {
            rest = [rest[0] + found, rest[1] + expected];
        }
    }
    if rest[1] * n > 100.0 {
        zs.push(z(rest[0], rest[1]));
    }
    zs
}

/// sin x/x.
fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

/// Fourier transform of a polygon with the given corners, counter-clockwise, as a sum over edges.
fn polygon(corners: &[DVec2], v: DVec2) -> Complex64 {
    // On the axis the transform is the area.
    let v = if v.length() < 1e-6 {
        DVec2::splat(1e-6)
    } else {
        v
    };
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let edge = |(a, b): (&DVec2, &DVec2)| {
        let (along, middle) = (*b - *a, 0.5 * (*a + *b));
        let flux = v.dot(-along.perp()) * sinc(0.5 * v.dot(along));
        Complex64::from_polar(flux, -v.dot(middle))
    };
    Complex64::I * edges.map(edge).sum::<Complex64>() / v.length_squared()
}

fn disc(radius: f64, v: DVec2) -> f64 {
    let x = (radius * v.length()).max(1e-9);
    TAU * radius * radius * libm::j1(x) / x
}

#[test]
fn blades_make_the_pattern_of_their_polygon() {
    for (blades, angle) in [(3_u32, 0.4), (6, 0.1)] {
        let iris = Iris {
            blades,
            blade_angle: angle,
            ..Iris::default()
        };
        let corner = |i: u32| DVec2::from_angle(angle + TAU * f64::from(i) / f64::from(blades));
        let corners: Vec<DVec2> = (0..blades).map(corner).collect();
        let area = 0.5 * f64::from(blades) * (TAU / f64::from(blades)).sin();
        let wanted = integrated(area, |v| polygon(&corners, v));
        let found = counted(ApertureShape::new(iris).unwrap());
        max_abs_z(&deviations(&found, &wanted), FAMILY).unwrap();
    }
}

/// Tests the two crossed bars that support a secondary mirror, on a disc and on a ring.
#[test]
fn vanes_make_spikes() {
    let width = 0.1;
    for obscuration in [0.0, 0.4] {
        let iris = Iris {
            obscuration,
            vanes: 4,
            vane_width: width,
            vane_angle: 0.3,
            ..Iris::default()
        };
        let turned = DVec2::from_angle(-0.3);
        let bar = |[a, b]: [f64; 2], w: f64| (b - a) * sinc(0.5 * w * (b - a));
        let transform = |v: DVec2| {
            let v = turned.rotate(v);
            let half = 0.5 * width;
            // Bars run from the rim to the disc in the middle, or across it. Their area equals that
            // of bars with round ends.
            let outer = 1.0 - width * width / 24.0;
            let inner = if obscuration > 0.0 {
                obscuration - width * width / (24.0 * obscuration)
            } else {
                half
            };
            let vane = |along: f64, across: f64| {
                2.0 * (0.5 * (outer + inner) * along).cos()
                    * bar([inner, outer], along)
                    * bar([-half, half], across)
            };
            let crossing = if obscuration > 0.0 {
                0.0
            } else {
                bar([-half, half], v.x) * bar([-half, half], v.y)
            };
            let covered = disc(obscuration, v) + vane(v.x, v.y) + vane(v.y, v.x) + crossing;
            Complex64::from(disc(1.0, v) - covered)
        };
        let area = transform(DVec2::ZERO).re;
        let aperture = ApertureShape::new(iris).unwrap();
        let found = counted(aperture);
        max_abs_z(&deviations(&found, &integrated(area, transform)), FAMILY).unwrap();
    }
}

/// An image aperture with half the power in one of two slits gives fringes of two amplitudes, far
/// beyond the period of a cell.
#[test]
fn pictures_diffract_by_the_roots_of_what_they_let_pass() {
    let row = [0.0, 1.0, 0.0, 0.25];
    let aperture = ApertureShape::picture(4, &row.repeat(4)).unwrap();
    // Cells are half as wide as the radius, from the left, which is +x.
    let slit = |x: f64, amplitude: f64, v: DVec2| {
        let form = 0.5 * sinc(0.25 * v.x) * 2.0 * sinc(v.y);
        Complex64::from_polar(amplitude * form, -v.x * x)
    };
    let wanted = integrated(1.25, |v| slit(0.25, 1.0, v) + slit(-0.75, 0.5, v));
    max_abs_z(&deviations(&counted(aperture), &wanted), FAMILY).unwrap();
}

/// Rays pass an aperture in proportion to its transmission, and its image has the right
/// orientation.
#[test]
fn rays_pass_where_an_aperture_is_open() {
    let picture = ApertureShape::picture(2, &[1.0, 0.5, 0.0, 0.0]).unwrap();
    let pinhole = Perspective::new(DAffine3::IDENTITY, 1.0, 1.0);
    let lens = ThinLens::new(pinhole, 2.0, 5.0);
    let starts = |aperture: &ApertureShape| {
        let sensor = Sensor::ThinLens(lens.clone().with_aperture(aperture.clone()));
        let at = |sample: u64| {
            let u = Sampler::new(9, 0, sample).next_2d();
            sensor.ray([0.5; 2], u).origin.truncate() / 2.0
        };
        (
            (0..10_000).map(at).collect::<Vec<_>>(),
            sensor.sample_end([0.5; 2]).pdf,
        )
    };
    let (points, pdf) = starts(&picture);
    assert!((pdf - 1.0 / (4.0 * 1.5)).abs() < 1e-12);
    assert!(points.iter().all(|p| p.y > 0.0), "the upper half is open");
    let left = points.iter().filter(|p| p.x > 0.0).count() as f64;
    // Two thirds, within five standard errors.
    assert!((left - 6_666.7).abs() < 5.0 * 47.2, "{left}");

    // Behind a lens the stop sees slopes of rays mirrored.
    let stop = ApertureStop::new(0.1, picture);
    let telecentric = Telecentric::new(DAffine3::IDENTITY, 1.0, 1.0, stop);
    let telecentric = Sensor::Telecentric(telecentric);
    for sample in 0..1000 {
        let u = Sampler::new(9, 1, sample).next_2d();
        let d = telecentric.ray([0.5; 2], u).direction;
        assert!(d.y < 0.0, "rays from above the axis go down");
    }

    let hexagon = Iris {
        blades: 6,
        obscuration: 0.3,
        ..Iris::default()
    };
    let (points, pdf) = starts(&ApertureShape::new(hexagon).unwrap());
    let area = 1.5 * 3.0_f64.sqrt() - PI * 0.09;
    assert!((pdf * 4.0 * area - 1.0).abs() < 3e-3, "{pdf}");
    // Partially open cells reach beyond the edge by their diagonal.
    let cell = 2.0_f64.sqrt() * 2.0 / 256.0;
    for p in points {
        let towards = |i: u32| p.dot(DVec2::from_angle(PI / 6.0 + PI / 3.0 * f64::from(i)));
        let outermost = (0..6).map(towards).fold(0.0, f64::max);
        assert!(
            outermost < 0.75_f64.sqrt() + cell && p.length() > 0.3 - cell,
            "{p}"
        );
    }
}

#[test]
fn apertures_that_make_no_sense_are_refused() {
    let refused = |iris: Iris| ApertureShape::new(iris).unwrap_err();
    let open = Iris::default();
    for (iris, error) in [
        (Iris { blades: 2, ..open }, ApertureError::Blades(2)),
        (Iris { vanes: 101, ..open }, ApertureError::Vanes(101)),
        (Iris { vanes: 1, ..open }, ApertureError::VaneWidth(0.0)),
        (
            Iris {
                obscuration: 1.0,
                ..open
            },
            ApertureError::Obscuration(1.0),
        ),
        (
            Iris {
                blade_angle: f64::INFINITY,
                ..open
            },
            ApertureError::Angle(f64::INFINITY),
        ),
        (
            Iris {
                vanes: 100,
                vane_width: 1.0,
                ..open
            },
            ApertureError::Closed,
        ),
    ] {
        assert_eq!(refused(iris), error);
    }
    assert_eq!(
        ApertureShape::picture(0, &[]).unwrap_err(),
        ApertureError::Cells(0)
    );
    assert_eq!(
        ApertureShape::picture(1, &[1.5]).unwrap_err(),
        ApertureError::Transmittance(1.5)
    );
    assert_eq!(
        ApertureShape::picture(1, &[0.0]).unwrap_err(),
        ApertureError::Closed
    );
    let length = ApertureError::Length {
        expected: 4,
        found: 1,
    };
    assert_eq!(ApertureShape::picture(2, &[1.0]).unwrap_err(), length);
}
