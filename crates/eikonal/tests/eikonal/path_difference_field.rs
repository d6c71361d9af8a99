//! Optical path differences against a reference field: closed forms, first-order integrals, and
//! lengths of rays at tight tolerances.

use glam::DVec3;
use morgana_eikonal::budget::EVALUATIONS_PER_DIFFERENCE;
use morgana_eikonal::connect::{Solver, Unbounded};
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Constant, Field, Gaussian, LinearIndex, Luneburg, Selfoc, Sum,
};
use morgana_eikonal::ray::{Arc, March, StopCondition, march};
use morgana_eikonal::{PathDifference, Reference, Tolerance, Work};

const DEFAULT: f64 = 1e-6;
const X: DVec3 = DVec3::new(0.2, 0.1, -0.9);
const LENGTH: f64 = 1.8;

fn direction() -> DVec3 {
    DVec3::new(0.1, -0.05, 1.0).normalize()
}

/// Returns the optical path difference of the ray from [`X`] of length [`LENGTH`], and the end of
/// the ray.
fn difference(field: &Field, reference: Reference<'_>, tolerance: f64) -> (f64, March) {
    let mut difference = PathDifference::new(reference, direction());
    let mut work = Work::default();
    let end = march(
        field,
        X,
        direction(),
        &StopCondition::ArcLength(LENGTH),
        2.0 * LENGTH,
        Tolerance::new(tolerance),
        |step, theta| difference.add(field, &step.arc, [0.0, theta], &mut work),
    );
    (difference.value(&mut work), end)
}

fn against(field: &Field, reference: &Field, tolerance: f64) -> (f64, March) {
    difference(field, Reference::Field(reference), tolerance)
}

fn rod(gradient: f64) -> Field {
    Selfoc::new(1.5, gradient, DVec3::ZERO, DVec3::Z)
        .unwrap()
        .into()
}

fn lens(peak: f64) -> Field {
    Gaussian::new(1.3, peak, DVec3::new(0.1, 0.0, 0.1), 0.3)
        .unwrap()
        .into()
}

/// Adds a weak bump beside the ray to a field that bends rays.
fn perturbed(base: &Field, delta: f64) -> Field {
    let bump = Gaussian::new(1.0, delta, DVec3::new(0.3, 0.1, 0.0), 0.2).unwrap();
    Sum::new(1.0, vec![base.clone(), bump.into()])
        .unwrap()
        .into()
}

#[test]
fn a_ray_of_the_reference_has_no_difference() {
    let slope = LinearIndex::new(1.4, DVec3::new(0.1, 0.2, -0.1), DVec3::ZERO).unwrap();
    let luneburg = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let fields = [rod(0.6), lens(0.2), slope.into(), luneburg.into()];
    for (i, field) in fields.iter().enumerate() {
        let (value, _) = against(field, field, DEFAULT);
        assert!(value.abs() < 2e-12, "{i}: {value}");
    }
}

/// A reference field of constant index gives the result of this index.
#[test]
fn constant_fields_are_constant_indices() {
    let unit: Field = Constant::new(1.2).into();
    for field in [rod(0.6), lens(0.2), lens(1e-6)] {
        let (value, _) = against(&field, &unit, DEFAULT);
        let (straight, _) = difference(&field, Reference::Index(1.2), DEFAULT);
        assert!((value - straight).abs() < 1e-8, "{value} {straight}");
    }
    let ambient: Field = Constant::new(1.3).into();
    let (value, _) = against(&lens(1e-8), &ambient, DEFAULT);
    let (straight, _) = difference(&lens(1e-8), Reference::Index(1.3), DEFAULT);
    assert!((value / straight - 1.0).abs() < 1e-6, "{value} {straight}");
}

/// Optical length between points of a rod n² = n0²(1 − g²r²), a harmonic oscillator. It is the
/// action ½n0²σ + d²/(2σ) + a/(2 sin aσ) [(x² + y²) cos aσ − 2x·y], a = n0 g, at the σ where it is
/// stationary.
fn rod_length(gradient: f64, x: DVec3, y: DVec3) -> f64 {
    let (n0, a) = (1.5, 1.5 * gradient);
    let d = y.z - x.z;
    let squares = x.truncate().length_squared() + y.truncate().length_squared();
    let product = x.truncate().dot(y.truncate());
    let slope = |s: f64| {
        let (sin, cos) = (a * s).sin_cos();
        0.5 * n0 * n0 - 0.5 * d * d / (s * s)
            + 0.5 * a * a * (2.0 * product * cos - squares) / (sin * sin)
    };
    let (mut low, mut high) = (0.5 * d / n0, 1.5 * d / n0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if slope(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (sin, cos) = (a * low).sin_cos();
    0.5 * n0 * n0 * low + 0.5 * d * d / low + 0.5 * a * (squares * cos - 2.0 * product) / sin
}

/// Contrasts range from 0.1 down to where the difference of the two closed forms is rounding. The
/// test holds at any tolerance.
#[test]
fn rods_of_other_strength_have_a_closed_form() {
    for change in [0.2, 1e-2, 1e-3, 1e-5] {
        let (field, reference) = (rod(0.6 + change), rod(0.6));
        for (tolerance, allowed) in [(1e-8, 1e-6), (DEFAULT, 1e-6), (1e-4, 1e-4)] {
            let (value, end) = against(&field, &reference, tolerance);
            let lengths = [0.6 + change, 0.6].map(|g| rod_length(g, X, end.x));
            let expected = lengths[0] - lengths[1];
            let error = (value - expected).abs();
            assert!(
                error < allowed * expected.abs() + 1e-14 / change.min(1.0),
                "{change} {tolerance}: {value} {expected}"
            );
        }
    }
}

/// To first order, the difference is the integral of the contrast along a ray of either field,
/// however strongly that field bends it.
#[test]
fn weak_bumps_have_the_integral_of_their_contrast() {
    for base in [rod(0.6), lens(0.2)] {
        for delta in [1e-5, 1e-7, 1e-9] {
            let field = perturbed(&base, delta);
            let (value, _) = against(&field, &base, DEFAULT);
            let middle = DVec3::new(0.3, 0.1, 0.0);
            let bump = |x: DVec3| delta * (-x.distance_squared(middle) / 0.08).exp();
            let mut expected = 0.0;
            let stop = StopCondition::ArcLength(LENGTH);
            march(
                &base,
                X,
                direction(),
                &stop,
                4.0,
                Tolerance::new(1e-10),
                |step, end| {
                    let n = 400;
                    for i in 0..n {
                        let theta = end * (f64::from(i) + 0.5) / f64::from(n);
                        // Squares of indices add, so that the contrast is the bump over n, and ds =
                        // n dσ.
                        expected +=
                            bump(step.arc.position(theta)) * step.arc.h() * end / f64::from(n);
                    }
                },
            );
            // The error of the ray, its tolerance, enters squared, times the length.
            let allowed = (1e-5 + 2.0 * delta) * expected + DEFAULT * DEFAULT;
            let error = (value - expected).abs();
            assert!(error < allowed, "{delta}: {value} {expected}");
        }
    }
}

/// For a reference whose rays take another path, the result agrees with the difference of two
/// lengths at tight tolerances.
#[test]
fn strong_contrasts_have_the_difference_of_tight_lengths() {
    let pairs = [
        (lens(0.1), lens(0.05)),
        (lens(0.05), rod(0.4)),
        (rod(0.3), lens(-0.05)),
    ];
    for (i, (field, reference)) in pairs.iter().enumerate() {
        let (value, end) = against(field, reference, 1e-11);
        let mut solver = Solver::new(Tolerance::new(1e-11));
        let ray = solver.connect(&Unbounded(reference), X, (), end.x).unwrap();
        let expected = end.optical_length - ray.optical_length;
        assert!((value - expected).abs() < 1e-9, "{i}: {value} {expected}");
    }
}

/// Features of the reference are detected although the ray itself is straight and has one step.
#[test]
fn features_of_the_reference_are_not_missed() {
    let unit: Field = Constant::new(1.0).into();
    let delta = 1e-7;
    for at in [-0.7, -0.2, 0.33] {
        let middle = X + direction() * (0.9 + at);
        let reference = Gaussian::new(1.0, delta, middle, 0.01).unwrap().into();
        let (value, _) = against(&unit, &reference, 1e-2);
        let expected = -delta * 0.01 * std::f64::consts::TAU.sqrt();
        assert!(
            (value / expected - 1.0).abs() < 1e-5,
            "{at}: {value} {expected}"
        );
    }
}

/// Integration does not refine further once the contrast falls below rounding.
#[test]
fn rounding_takes_no_work() {
    for base in [rod(0.6), lens(0.2)] {
        let field = perturbed(&base, 1e-5);
        // Start a few widths from the bump.
        let (x, toward) = (DVec3::new(-0.8, 1.2, -0.9), DVec3::Z);
        let mut difference = PathDifference::new(Reference::Field(&base), toward);
        let mut work = Work::default();
        let stop = StopCondition::ArcLength(LENGTH);
        let tolerance = Tolerance::default();
        march(&field, x, toward, &stop, 4.0, tolerance, |step, theta| {
            difference.add(&field, &step.arc, [0.0, theta], &mut work);
        });
        assert!(difference.value(&mut work).is_finite());
        assert!(work.evaluations < 5000, "{}", work.evaluations);
    }
}

/// Integration gives up structure that exceeds the budget of work, and reports it.
#[test]
fn work_is_bounded() {
    let unit: Field = Constant::new(1.0).into();
    let fine = AcousticMode::new(1e-6, 0, 1e6, 0.0).unwrap();
    let sound = Acoustic::new(1.0, DVec3::ZERO, DVec3::Y, DVec3::X, vec![fine]).unwrap();
    let sound: Field = sound.into();
    let mut difference = PathDifference::new(Reference::Field(&sound), direction());
    let mut work = Work::default();
    let arc = Arc::line(X, direction(), LENGTH);
    difference.add(&unit, &arc, [0.0, 1.0], &mut work);
    assert!(difference.value(&mut work).is_nan() && difference.is_over_budget());
    assert!(work.evaluations < 2 * EVALUATIONS_PER_DIFFERENCE);
}

/// If no ray of the reference reaches the end, the difference is not a number.
#[test]
fn without_a_reference_ray_it_is_not_a_number() {
    let unit: Field = Constant::new(1.0).into();
    let x2 = LinearIndex::new(1.0, DVec3::new(0.0, 0.0, 0.0), DVec3::ZERO).unwrap();
    let (value, _) = against(&unit, &x2.into(), DEFAULT);
    assert!(value.abs() < 1e-12);
    // A mirage bends rays that start horizontally upwards; none comes back below.
    let steep = LinearIndex::new(1.0, DVec3::new(0.0, 0.0, -0.9), X).unwrap();
    let (value, _) = against(&unit, &steep.into(), DEFAULT);
    assert!(value.is_nan(), "{value}");
}
