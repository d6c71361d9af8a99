//! Orthogonal maps nearest to nearly orthogonal matrices. Exact to rounding: no false alarms.

use glam::{DMat3, DQuat, DVec3};
use morgana_transport::Orientation;

fn turn(angle: f64) -> DMat3 {
    DMat3::from_quat(DQuat::from_axis_angle(
        DVec3::new(1.0, 2.0, 3.0).normalize(),
        angle,
    ))
}

fn rounded(m: DMat3, digits: i32) -> DMat3 {
    let unit = 10f64.powi(digits);
    DMat3::from_cols_array(&m.to_cols_array().map(|v| (v * unit).round() / unit))
}

fn columns(orientation: &Orientation) -> DMat3 {
    let [x, y, z] = DVec3::AXES.map(|axis| orientation.to_world(axis));
    DMat3::from_cols(x, y, z)
}

#[test]
fn a_rounded_rotation_becomes_one() {
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for k in 0..50 {
        let exact = turn(f64::from(k)) * if k % 2 == 0 { DMat3::IDENTITY } else { mirror };
        for digits in [3, 4, 6, 8] {
            let scale = 10f64.powi(k % 7 - 3);
            let (found, error) = Orientation::nearest(rounded(exact, digits) * scale).unwrap();
            // Each entry is off by up to half a unit, and a sum of three by three times as much.
            let most = 1.5 * 10f64.powi(-digits);
            assert!(error < most, "{error} at {digits} digits");
            let m = columns(&found);
            assert!((m.transpose() * m).abs_diff_eq(DMat3::IDENTITY, 1e-15 * 4.0));
            assert!(m.abs_diff_eq(exact, most));
            assert!(m.determinant() * exact.determinant() > 0.0);
        }
    }
}

#[test]
fn directions_have_unit_length_there_and_back() {
    let (orientation, _) = Orientation::nearest(rounded(turn(0.7), 4)).unwrap();
    for k in 0..100 {
        let d = DVec3::new(f64::from(k).sin(), f64::from(2 * k).cos(), 0.3).normalize();
        for image in [orientation.to_world(d), orientation.to_local(d)] {
            assert!(
                (image.length() - 1.0).abs() < 3e-16,
                "{}",
                image.length() - 1.0
            );
        }
        assert!(
            orientation
                .to_local(orientation.to_world(d))
                .abs_diff_eq(d, 1e-15)
        );
    }
}

/// A stretch by 1 + s along one axis has the mean 1 + s/3, and differs from it by 2s/3.
#[test]
fn what_is_no_rotation_says_how_far_it_is_from_one() {
    for s in [1e-3, 0.1, 3.0] {
        let stretched = turn(0.4) * DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.0 + s)) * turn(1.0);
        let (nearest, error) = Orientation::nearest(stretched).unwrap();
        assert!((error - 2.0 * s / (3.0 + s)).abs() < 1e-12, "{error}");
        assert!(columns(&nearest).abs_diff_eq(turn(0.4) * turn(1.0), 1e-12));
    }
    let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
    for bad in [
        DMat3::ZERO,
        flat,
        DMat3::NAN,
        DMat3::IDENTITY * f64::INFINITY,
    ] {
        assert!(Orientation::nearest(bad).is_none());
    }
    for tiny in [1e-200, 1e200] {
        assert_eq!(
            Orientation::nearest(DMat3::IDENTITY * tiny),
            Some((Orientation::IDENTITY, 0.0))
        );
    }
}
