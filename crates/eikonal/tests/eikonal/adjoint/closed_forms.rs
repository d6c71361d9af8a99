//! Derivatives of rays against closed forms.

use super::*;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::field::Selfoc;

/// Derivatives of one component of a ray's end with respect to the parameters of a field.
fn by_parameters(
    field: &Field,
    receiver: Receiver,
    start: RayStart<()>,
    loss: impl Fn(&RayEnd) -> EndDerivative,
) -> Vec<f64> {
    let world = Unbounded(field);
    let mut ray = AdjointRay::new(&world, receiver, Tolerance::new(TIGHT_TOLERANCE), 100.0);
    let end = ray.follow(start).unwrap();
    let mut sum = ParameterDerivative::new((), field);
    ray.pull_back(&loss(&end), &mut sum).unwrap();
    sum.values
}

/// A weak bump Δ exp(−r²/2w²) deflects a ray at distance b from its centre by −√(2π) Δ (b/w)
/// exp(−b²/2w²), to first order in Δ.
#[test]
fn deflection_by_a_weak_gaussian() {
    let (b, w) = (0.4, 0.5);
    let field = gaussian(&[1.0, 1e-7, 0.0, 0.0, 0.0, w]);
    let start = RayStart {
        x: DVec3::new(b, 0.0, -10.0 * w),
        direction: DVec3::Z,
        region: (),
    };
    let receiver = Receiver::Plane {
        point: DVec3::Z * 10.0 * w,
        normal: DVec3::Z,
    };
    let along_x = |end: &RayEnd| EndDerivative::of_direction(DVec3::ZERO, DVec3::X, 0.0, end.v);
    let found = by_parameters(&field, receiver, start, along_x);
    let expected = -(2.0 * std::f64::consts::PI).sqrt() * b / w * (-0.5 * b * b / (w * w)).exp();
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-6,
        "{} {expected}",
        found[1]
    );
    // The optical length changes by ∫exp(−r²/2w²) ds per Δ. The limit is wider here: steps are
    // chosen for positions, on which a weak bump has little effect.
    let length = |_: &RayEnd| EndDerivative {
        optical_length: 1.0,
        ..EndDerivative::default()
    };
    let found = by_parameters(&field, receiver, start, length);
    let expected = (2.0 * std::f64::consts::PI).sqrt() * w * (-0.5 * b * b / (w * w)).exp();
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-5,
        "{} {expected}",
        found[1]
    );
}

/// A meridional ray that starts parallel to the axis of a graded rod, at x₀: x = x₀ cos gz with g =
/// α/√(1 − α²x₀²).
#[test]
fn pitch_of_a_graded_rod() {
    let (alpha, x0, z) = (0.7, 0.3, 3.0);
    let field: Field = Selfoc::new(1.5, alpha, DVec3::ZERO, DVec3::Z)
        .unwrap()
        .into();
    let start = RayStart {
        x: DVec3::X * x0,
        direction: DVec3::Z,
        region: (),
    };
    let receiver = Receiver::Plane {
        point: DVec3::Z * z,
        normal: DVec3::Z,
    };
    let along_x = |_: &RayEnd| EndDerivative {
        x: DVec3::X,
        ..EndDerivative::default()
    };
    let found = by_parameters(&field, receiver, start, along_x);
    let root = (1.0 - alpha * alpha * x0 * x0).sqrt();
    let expected = -x0 * z * (alpha / root * z).sin() / root.powi(3);
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-7,
        "{} {expected}",
        found[1]
    );
    // The index on the axis has no effect.
    assert!(found[0].abs() < 1e-9, "{}", found[0]);
}
