//! Optical path differences, compared with closed forms, quadratures of the contrast, and lengths
//! of rays at tight tolerances.

use glam::{DAffine3, DQuat, DVec3};
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Affine, Bspline, Field, Fisheye, Gaussian, LinearIndex, Luneburg,
    Placement, Scaled, Selfoc, Sum,
};
use morgana_eikonal::ray::{March, StopCondition, march};
use morgana_eikonal::{Aabb, PathDifference, Reference, Tolerance, Work};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Returns the optical path difference of a ray of a given length against a constant index, the end
/// of the ray, and the work.
fn difference(
    field: &Field,
    n_ref: f64,
    (x, direction): (DVec3, DVec3),
    length: f64,
    tolerance: f64,
) -> (f64, March, Work) {
    let mut difference = PathDifference::new(Reference::Index(n_ref), direction);
    let mut work = Work::default();
    let tolerance = Tolerance::new(tolerance);
    let stop = StopCondition::ArcLength(length);
    let end = march(
        field,
        x,
        direction,
        &stop,
        2.0 * length,
        tolerance,
        |step, theta| {
            difference.add(field, &step.arc, [0.0, theta], &mut work);
        },
    );
    (difference.so_far().unwrap(), end, work)
}

/// Width of a column with a Gaussian profile around the y axis, sampled 96 times along x and z of
/// [−1, 1].
const WIDTH: f64 = 0.2;
fn column(delta: f64) -> Field {
    let index = |x: DVec3| 1.0 + delta * bump(x.x.hypot(x.z));
    let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    Bspline::from_fn([96, 1, 96], bounds, Placement::Nodes, index)
        .unwrap()
        .into()
}

fn bump(r: f64) -> f64 {
    (-0.5 * (r / WIDTH).powi(2)).exp()
}

/// Returns ∫ (n − 1) dz over [−1, 1] along a straight line, by a fine quadrature of the field
/// itself.
fn straight(field: &Field, x: f64) -> f64 {
    let n = 9_500;
    let at = |i: i32| DVec3::new(x, 0.0, (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0);
    let contrast = |i| {
        let n2 = field.n2(at(i)) - 1.0;
        n2 / (1.0 + (1.0 + n2).sqrt())
    };
    (0..n).map(contrast).sum::<f64>() * 2.0 / f64::from(n)
}

const DEFAULT: f64 = 1e-6;

/// To first order in the contrast, the path difference is the integral of the contrast along a
/// straight line. This holds at tolerances of positions from the default to the loosest.
#[test]
fn weak_columns_have_the_integral_of_their_contrast() {
    for delta in [1e-6, 1e-7, 1e-8, 1e-10] {
        let field = column(delta);
        let peak = delta * TAU.sqrt() * WIDTH;
        for i in 0..10 {
            let x = f64::from(i) / 12.0;
            let expected = straight(&field, x);
            for tolerance in [DEFAULT, 1e-4, 1e-2] {
                let start = (DVec3::new(x, 0.0, -1.0), DVec3::Z);
                let (value, ..) = difference(&field, 1.0, start, 2.0, tolerance);
                let error = (value - expected).abs();
                assert!(error < 2e-5 * peak, "{delta} {tolerance} {x}: {error}");
                // The spline differs from the Gaussian by its own interpolation error.
                let error = (value - peak * bump(x)).abs();
                assert!(error < 1e-4 * peak, "{delta} {tolerance} {x}: {error}");
            }
        }
    }
}

/// Stronger contrasts: the path difference agrees with a ray at a tight tolerance, for which it is
/// the optical length minus the length of the chord.
#[test]
fn differences_are_those_of_tight_lengths() {
    for delta in [1e-3, 1e-4] {
        let field = column(delta);
        let peak = delta * TAU.sqrt() * WIDTH;
        for i in 0..20 {
            let start = (DVec3::new(f64::from(i) / 25.0, 0.0, -1.0), DVec3::Z);
            let (value, ..) = difference(&field, 1.0, start, 2.0, DEFAULT);
            let (_, end, _) = difference(&field, 1.0, start, 2.0, 1e-12);
            let error = (value - (end.optical_length - end.x.distance(start.0))).abs();
            assert!(error < 1e-5 * peak, "{delta} {i}: {error}");
        }
    }
}

/// Tests S − n_r c in strong fields of all types, against any reference index.
#[test]
fn the_identity_holds_for_every_field() {
    let bump = |at| Gaussian::new(1.3, 0.1, at, 0.3).unwrap();
    let mode = AcousticMode::new(0.05, 2, 9.0, 0.3).unwrap();
    let turned = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 0.7, 1.4),
        DQuat::from_rotation_y(0.4),
        DVec3::new(0.1, 0.0, 0.2),
    );
    let sum = Sum::new(1.3, vec![bump(DVec3::X).into(), bump(DVec3::Y).into()]).unwrap();
    let acoustic = Acoustic::new(1.33, DVec3::ZERO, DVec3::Y, DVec3::X, vec![mode]).unwrap();
    let fields: [Field; 8] = [
        bump(DVec3::ZERO).into(),
        sum.into(),
        acoustic.clone().into(),
        Affine::new(acoustic.into(), turned).unwrap().into(),
        Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into(),
        Selfoc::new(1.5, 0.6, DVec3::ZERO, DVec3::Z).unwrap().into(),
        LinearIndex::new(1.4, DVec3::new(0.1, 0.2, -0.1), DVec3::ZERO)
            .unwrap()
            .into(),
        Scaled::new(column(0.05), 1.2).unwrap().into(),
    ];
    let start = (
        DVec3::new(0.2, 0.1, -0.9),
        DVec3::new(0.1, -0.05, 1.0).normalize(),
    );
    for (i, field) in fields.iter().enumerate() {
        for n_ref in [1.0, 1.33] {
            let (value, end, _) = difference(field, n_ref, start, 1.8, 1e-11);
            let lengths = end.optical_length - n_ref * end.x.distance(start.0);
            assert!(
                (value - lengths).abs() < 1e-9,
                "{i} {n_ref}: {value} {lengths}"
            );
        }
    }
}

/// All rays from the plane that touches a Luneburg lens to its far pole have the optical length
/// R(1 + π/2). The error is of second order in the error of the path.
#[test]
fn luneburg_lens() {
    let field: Field = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into();
    let pole = DVec3::Z;
    for b in [0.1f64, 0.5, 0.9] {
        let entry = DVec3::new(b, 0.0, -(1.0 - b * b).sqrt());
        let plane = entry.z + 1.0;
        for (tolerance, allowed) in [(1e-6, 1e-10), (1e-4, 1e-7), (1e-2, 2e-4)] {
            let mut difference = PathDifference::new(Reference::Index(1.0), DVec3::Z);
            let (mut work, mut end) = (Work::default(), entry);
            let to_pole = StopCondition::ClosestApproach(pole);
            let tolerance = Tolerance::new(tolerance);
            march(
                &field,
                entry,
                DVec3::Z,
                &to_pole,
                4.0,
                tolerance,
                |step, theta| {
                    difference.add(&field, &step.arc, [0.0, theta], &mut work);
                    end = step.at(theta).0;
                },
            );
            // Correct for the end of the ray, which is off the pole: the length changes along the
            // direction there.
            let ray = difference.so_far().unwrap() + end.distance(entry);
            let towards = DVec3::new(-b, 0.0, (1.0 - b * b).sqrt());
            let error = ray - (end - pole).dot(towards) - (1.0 + FRAC_PI_2 - plane);
            assert!(error.abs() < allowed, "{b} {tolerance:?}: {error}");
        }
    }
}

/// The path difference of a radial profile is its Abel transform. It has a closed form for (1 +
/// r²/a²)⁻² within a ball of radius 1.
#[test]
fn a_radial_profile_has_its_abel_transform() {
    let (delta, a2) = (1e-7, 0.09);
    let index = |x: DVec3| 1.0 + delta * (1.0 + x.length_squared() / a2).powi(-2);
    let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let grid = Bspline::from_fn([96; 3], bounds, Placement::Nodes, index).unwrap();
    let field = grid.into();
    for (x, y) in [(0.0f64, 0.0f64), (0.21, 0.1), (0.4, -0.5), (0.1, 0.8)] {
        let start = (DVec3::new(x, y, -1.0), DVec3::Z);
        let (value, ..) = difference(&field, 1.0, start, 2.0, DEFAULT);
        // ∫ (q² + z²)⁻² dz = z/(2q²(q² + z²)) + atan(z/q)/(2q³)
        let q2 = a2 + x * x + y * y;
        let abel = a2 * a2 * (1.0 / (q2 * (q2 + 1.0)) + (1.0 / q2.sqrt()).atan() / q2.powf(1.5));
        let peak = delta * a2.sqrt() * FRAC_PI_2;
        assert!((value - delta * abel).abs() < 1e-4 * peak, "{x} {y}");
    }
}

/// Features of a few samples are not missed, wherever they lie within the steps of a ray, which are
/// as long as the grid.
#[test]
fn nothing_is_narrower_than_a_sample() {
    let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let delta = 1e-10;
    for (width, middle) in [0.0f64, 2.5]
        .iter()
        .flat_map(|w| (1..15).map(|i| (*w, 6.3 * f64::from(i))))
    {
        let sample = |i: i32| {
            let away = f64::from(i) - middle;
            let bump = match width {
                0.0 if away.abs() < 0.5 => 1.0,
                0.0 => 0.0,
                w => (-0.5 * (away / w).powi(2)).exp(),
            };
            // Add a slope, so that no region is skipped as constant.
            1.0 + delta * (bump + 1e-3 * f64::from(i))
        };
        let samples: Vec<f64> = (0..96).map(sample).collect();
        let grid = Bspline::from_samples([1, 1, 96], bounds, Placement::Nodes, &samples);
        let field = grid.unwrap().into();
        let start = (DVec3::NEG_Z, DVec3::Z);
        let (value, ..) = difference(&field, 1.0, start, 2.0, 1e-2);
        let expected = straight(&field, 0.0);
        assert!(
            (value - expected).abs() < 2e-6 * expected,
            "{width} {middle}"
        );
    }
}

/// The work is proportional to the number of samples that the ray passes, and pieces of arcs add
/// up.
#[test]
fn work_and_pieces() {
    let field = column(1e-6);
    let (x, direction) = (DVec3::new(0.1, 0.0, -1.0), DVec3::Z);
    let (whole, _, work) = difference(&field, 1.0, (x, direction), 2.0, DEFAULT);
    assert!(work.evaluations < 40 * 96, "{}", work.evaluations);
    let mut pieces = PathDifference::new(Reference::Index(1.0), DVec3::Z);
    let stop = StopCondition::ArcLength(2.0);
    march(
        &field,
        x,
        direction,
        &stop,
        4.0,
        Tolerance::default(),
        |step, theta| {
            for i in 0..7 {
                let range = [i, i + 1].map(|i| theta * f64::from(i) / 7.0);
                pieces.add(&field, &step.arc, range, &mut Work::default());
            }
        },
    );
    assert!((pieces.so_far().unwrap() - whole).abs() < 1e-6 * whole);
}

/// Two passes with a mirror between them double the difference, because the reference is reflected,
/// too.
#[test]
fn reflection() {
    let field = column(1e-6);
    let start = DVec3::new(0.15, 0.0, -1.0);
    let (once, ..) = difference(&field, 1.0, (start, DVec3::Z), 2.0, DEFAULT);
    let mut twice = PathDifference::new(Reference::Index(1.0), DVec3::Z);
    let mut x = start;
    for toward in [DVec3::Z, -DVec3::Z] {
        if toward.z < 0.0 {
            twice.reflect(toward, &mut Work::default());
        }
        let stop = StopCondition::ArcLength(2.0);
        let tolerance = Tolerance::default();
        x = march(&field, x, toward, &stop, 4.0, tolerance, |step, theta| {
            twice.add(&field, &step.arc, [0.0, theta], &mut Work::default());
        })
        .x;
    }
    assert!((twice.so_far().unwrap() - 2.0 * once).abs() < 1e-4 * once);
}
