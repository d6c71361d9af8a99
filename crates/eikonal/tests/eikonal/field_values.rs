//! Fields, compared with their formulas and with one another, and the refusal of invalid
//! parameters.

use crate::common::{CENTER, Random, acoustic, assert_jets_agree, rigid, shear};
use glam::{DAffine3, DMat3, DVec3};
use morgana_eikonal::field::*;
use morgana_eikonal::{Aabb, Field, Jet};
use std::f64::consts::TAU;

fn points(count: usize) -> Vec<DVec3> {
    let mut random = Random(19);
    (0..count).map(|_| random.vector() * 2.0 - 1.0).collect()
}

#[track_caller]
fn assert_index(field: impl Into<Field>, n: impl Fn(DVec3) -> f64) {
    let field = field.into();
    for x in points(200) {
        let (found, expected) = (field.n(x), n(x));
        assert!(
            (found - expected).abs() < 4e-15,
            "{found} for {expected} at {x}"
        );
    }
}

#[test]
fn indices_follow_their_formulas() {
    let slope = DVec3::new(0.05, -0.1, 0.02);
    let r = |x: DVec3| (x - CENTER).length();
    assert_index(LinearIndex::new(1.3, slope, CENTER).unwrap(), |x| {
        1.3 + slope.dot(x - CENTER)
    });
    assert_index(LinearSquare::new(1.3, slope, CENTER).unwrap(), |x| {
        (1.69 + slope.dot(x - CENTER)).sqrt()
    });
    assert_index(Luneburg::new(1.1, CENTER, 2.0).unwrap(), |x| {
        1.1 * (2.0 - r(x) * r(x) / 4.0).sqrt()
    });
    assert_index(Fisheye::new(2.0, CENTER, 0.8).unwrap(), |x| {
        2.0 / (1.0 + r(x) * r(x) / 0.64)
    });
    assert_index(Gaussian::new(1.33, -0.08, CENTER, 0.4).unwrap(), |x| {
        1.33 - 0.08 * (-r(x) * r(x) / 0.32).exp()
    });
    let along = DVec3::new(0.3, -1.0, 2.0);
    assert_index(Selfoc::new(1.6, 0.3, CENTER, along).unwrap(), |x| {
        let d = (x - CENTER).cross(along.normalize()).length();
        1.6 * (1.0 - 0.09 * d * d).sqrt()
    });
}

#[test]
fn acoustic_angle_runs_from_the_reference_around_the_axis() {
    // φ = atan2(y, z) about the x axis is right-handed about −x.
    let (k, phase) = (9.0, 0.7);
    let mode = AcousticMode::new(0.02, 3, k, phase).unwrap();
    let field = Acoustic::new(1.3333, DVec3::ZERO, -DVec3::X, DVec3::Z, vec![mode]).unwrap();
    assert_index(field, |x| {
        let (r, phi) = (x.y.hypot(x.z), x.y.atan2(x.z));
        1.3333 + 0.02 * libm::jn(3, k * r) * (3.0 * phi + phase).cos()
    });
}

#[test]
fn acoustic_modes_solve_the_helmholtz_equation() {
    let (k, m) = (7.0, 4);
    let mode = AcousticMode::new(0.03, m, k, 0.2).unwrap();
    let field = Acoustic::new(1.4, CENTER, DVec3::ONE, DVec3::X, vec![mode]).unwrap();
    let field = Field::from(field);
    for x in points(200) {
        let Jet { n2, grad, hess } = field.jet(x);
        let n = n2.sqrt();
        // Δn² = 2nΔn + 2|∇n|² with ∇n = ∇n²/(2n).
        let trace = hess.x_axis.x + hess.y_axis.y + hess.z_axis.z;
        let laplacian = (0.5 * trace - grad.length_squared() / (4.0 * n2)) / n;
        assert!((laplacian + k * k * (n - 1.4)).abs() < 1e-13);
    }
}

#[test]
fn wave_number_follows_from_frequency() {
    let by_frequency = AcousticMode::from_frequency(0.01, 2, 832e3, 1500e3, 0.1);
    let direct = AcousticMode::new(0.01, 2, TAU * 832e3 / 1500e3, 0.1);
    let [by_frequency, direct] = [by_frequency, direct].map(|mode| {
        let modes = vec![mode.unwrap()];
        Field::from(Acoustic::new(1.4, CENTER, DVec3::ONE, DVec3::X, modes).unwrap())
    });
    for x in points(50) {
        assert_eq!(by_frequency.n2(x), direct.n2(x));
    }
}

#[test]
fn sum_is_linear_in_squared_index() {
    let bump = Field::from(Gaussian::new(1.33, 0.08, CENTER, 0.4).unwrap());
    let waves = Field::from(acoustic());
    let sum = Field::from(Sum::new(1.33, vec![bump.clone(), waves.clone()]).unwrap());
    let region = Aabb::new(DVec3::splat(-0.2), DVec3::splat(0.1));
    for x in points(100) {
        let (a, b) = (bump.jet(x), waves.jet(x));
        let expected = Jet {
            n2: a.n2 + b.n2 - 1.33 * 1.33,
            grad: a.grad + b.grad,
            hess: a.hess + b.hess,
        };
        assert_jets_agree(sum.jet(x), expected, 1e-14);
    }
    let (a, b, both) = (
        bump.bounds(&region),
        waves.bounds(&region),
        sum.bounds(&region),
    );
    assert!((both.n2_max - (a.n2_max + b.n2_max - 1.33 * 1.33)).abs() < 1e-14);
    assert!((both.grad_max - (a.grad_max + b.grad_max)).abs() < 1e-14);
    let l = sum.length_scale(CENTER);
    assert_eq!(l, bump.length_scale(CENTER).min(waves.length_scale(CENTER)));

    let empty = Field::from(Sum::new(1.2, vec![]).unwrap());
    assert!(empty.is_constant() && empty.length_scale(CENTER).is_infinite());
    assert_eq!(empty.jet(CENTER), Jet::constant(1.2 * 1.2));
}

#[track_caller]
fn assert_same_field(moved: impl Into<Field>, to_world: DAffine3, direct: impl Into<Field>) {
    let moved = Field::from(Affine::new(moved.into(), to_world).unwrap());
    let direct = direct.into();
    for x in points(200) {
        assert_jets_agree(moved.jet(x), direct.jet(x), 1e-12);
        let (a, b) = (moved.length_scale(x), direct.length_scale(x));
        assert!((a - b).abs() < 1e-12 * b, "length scales {a} and {b}");
    }
}

#[test]
fn moved_fields_are_those_with_moved_parameters() {
    let to_world = rigid();
    let s = to_world.matrix3.x_axis.length();
    let place = |x| to_world.transform_point3(x);
    let turn = |d| to_world.transform_vector3(d);
    assert_same_field(
        Gaussian::new(1.33, 0.08, CENTER, 0.4).unwrap(),
        to_world,
        Gaussian::new(1.33, 0.08, place(CENTER), 0.4 * s).unwrap(),
    );
    assert_same_field(
        Fisheye::new(2.0, CENTER, 0.8).unwrap(),
        to_world,
        Fisheye::new(2.0, place(CENTER), 0.8 * s).unwrap(),
    );
    assert_same_field(
        Selfoc::new(1.6, 0.5, CENTER, DVec3::Z).unwrap(),
        to_world,
        Selfoc::new(1.6, 0.5 / s, place(CENTER), turn(DVec3::Z)).unwrap(),
    );
    let waves = |k, origin, axis, reference| {
        let mode = AcousticMode::new(0.02, 3, k, 0.4).unwrap();
        Acoustic::new(1.33, origin, axis, reference, vec![mode]).unwrap()
    };
    assert_same_field(
        waves(6.0, CENTER, DVec3::X, DVec3::Z),
        to_world,
        waves(6.0 / s, place(CENTER), turn(DVec3::X), turn(DVec3::Z)),
    );
}

#[test]
fn sheared_fields_obey_the_chain_rule() {
    let to_world = shear();
    let slope = DVec3::new(0.05, -0.1, 0.02);
    let field = Field::from(LinearIndex::new(1.3, slope, CENTER).unwrap());
    let moved = Field::from(Affine::new(field, to_world).unwrap());
    let slope = to_world.matrix3.inverse().transpose() * slope;
    let origin = to_world.transform_point3(CENTER);
    let direct = Field::from(LinearIndex::new(1.3, slope, origin).unwrap());
    for x in points(100) {
        assert_jets_agree(moved.jet(x), direct.jet(x), 1e-14);
    }
}

#[test]
fn bad_parameters_are_refused() {
    let (nan, inf, o) = (f64::NAN, f64::INFINITY, DVec3::ZERO);
    let bad = DVec3::new(0.0, nan, 0.0);
    let message = |e: FieldError| e.to_string();
    let error = Luneburg::new(1.0, o, -2.0).map_err(message).unwrap_err();
    assert_eq!(error, "radius must be positive and finite, but is -2");

    assert!(LinearIndex::new(0.0, o, o).is_err());
    assert!(LinearIndex::new(1.0, bad, o).is_err());
    assert!(LinearSquare::new(1.0, o, bad).is_err());
    assert!(LinearSquare::new(nan, o, o).is_err());
    assert!(Luneburg::new(inf, o, 1.0).is_err());
    assert!(Fisheye::new(1.0, o, 0.0).is_err());
    assert!(Fisheye::new(1.0, bad, 1.0).is_err());
    assert!(Gaussian::new(1.3, -1.3, o, 1.0).is_err());
    assert!(Gaussian::new(1.3, nan, o, 1.0).is_err());
    assert!(Gaussian::new(1.3, 0.1, o, 0.0).is_err());
    assert!(Selfoc::new(1.5, -0.1, o, DVec3::Z).is_err());
    assert!(matches!(
        Selfoc::new(1.5, 0.1, o, o),
        Err(FieldError::ZeroVector { .. })
    ));
    assert!(Sum::new(-1.0, vec![]).is_err());

    assert!(AcousticMode::new(nan, 1, 1.0, 0.0).is_err());
    assert!(AcousticMode::new(0.1, 1, 0.0, 0.0).is_err());
    assert!(AcousticMode::from_frequency(0.1, 1, 1e6, 0.0, 0.0).is_err());
    let loud = AcousticMode::new(-2.0, 0, 1.0, 0.0).unwrap();
    assert!(Acoustic::new(1.3, o, DVec3::X, DVec3::Z, vec![loud]).is_err());
    assert!(matches!(
        Acoustic::new(1.3, o, DVec3::X, DVec3::X * 3.0, vec![]),
        Err(FieldError::ParallelReference { .. })
    ));

    let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y);
    for linear in [flat, DMat3::ZERO, DMat3::from_diagonal(DVec3::splat(nan))] {
        let transform = DAffine3::from_mat3(linear);
        assert!(matches!(
            Affine::new(Constant::new(1.0).into(), transform),
            Err(FieldError::SingularTransform { .. })
        ));
    }
    let moved = |linear, by| {
        let transform = DAffine3::from_mat3_translation(linear, by);
        Affine::new(Constant::new(1.0).into(), transform)
            .map_err(message)
            .unwrap_err()
    };
    let expected = "translation of the transform must have finite components, but is [0, NaN, 0]";
    assert_eq!(moved(DMat3::IDENTITY, bad), expected);
    let tiny = moved(
        DMat3::from_diagonal(DVec3::splat(1e-10)),
        DVec3::splat(1e300),
    );
    assert!(tiny.starts_with("translation of the inverse transform must have finite"));
}

#[test]
fn directions_may_have_any_length() {
    for length in [1e-200, 1e200] {
        let rod = Selfoc::new(1.5, 0.1, DVec3::ZERO, DVec3::Z * length).unwrap();
        let expected = Selfoc::new(1.5, 0.1, DVec3::ZERO, DVec3::Z).unwrap();
        let x = DVec3::new(0.3, 0.2, 0.7);
        assert_eq!(Field::from(rod).n2(x), Field::from(expected).n2(x));
    }
}
