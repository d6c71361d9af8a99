//! Derivatives of rays through grids in boxes, with respect to their samples.

use super::*;
use crate::common::{Random, ripples};
use morgana_eikonal::Aabb;
use morgana_eikonal::field::{Bspline, Placement};

const DIMS: [usize; 3] = [9, 8, 10];

fn cube() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
}

/// Values of a function of position at the samples of the grid.
fn sampled(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut samples = Vec::new();
    Bspline::from_fn(DIMS, cube(), Placement::Nodes, |x| {
        samples.push(f(x));
        1.0
    })
    .unwrap();
    // The first call is for the reference value; drop it.
    samples.remove(0);
    samples
}

/// Samples of the index n.
fn samples() -> Vec<f64> {
    sampled(ripples)
}

fn grid(samples: &[f64]) -> Bspline {
    Bspline::from_samples(DIMS, cube(), Placement::Nodes, samples).unwrap()
}

const BEGIN: [f64; 6] = [0.3, 0.2, -2.0, -0.1, 0.15, 1.0];

const BEHIND: Receiver = Receiver::Plane {
    point: DVec3::new(0.0, 0.0, 3.0),
    normal: DVec3::Z,
};

/// Derivatives with respect to the samples, for a ray that enters the cube from outside.
fn by_samples(samples: &[f64], tolerance: f64) -> Vec<f64> {
    let bspline = grid(samples);
    let field = bspline.clone().into();
    let world = Embedded::new(&field, cube(), 1.3);
    let mut ray = AdjointRay::new(&world, BEHIND, Tolerance::new(tolerance), 10.0);
    ray.follow(start(&BEGIN, false)).unwrap();
    let mut sum = ParameterDerivative::new(true, &field);
    ray.pull_back(&LOSS, &mut sum).unwrap();
    let by_n2 = bspline.sample_derivative(sum.values);
    by_n2
        .iter()
        .zip(samples)
        .map(|(by, n)| by * 2.0 * n)
        .collect()
}

/// Derivatives with respect to samples agree with differences. Coefficients are f32: their
/// rounding, 1e-9 of n², over difference steps of 2e-3, limits the differences to 1e-6.
#[test]
fn rays_by_samples_of_a_grid() {
    let mut random = Random(5);
    let samples = samples();
    let found = by_samples(&samples, 1e-11);
    for _ in 0..5 {
        let direction: Vec<f64> = samples.iter().map(|_| random.between(-1.0, 1.0)).collect();
        let of = |p: &[f64]| {
            let moved: Vec<f64> = samples
                .iter()
                .zip(&direction)
                .map(|(n, d)| n + p[0] * d)
                .collect();
            let field = grid(&moved).into();
            let world = Embedded::new(&field, cube(), 1.3);
            loss(&follow(&world, BEHIND, 1e-11, start(&BEGIN, false)))
        };
        let expected = derivative(&[0.0], 0, 4e-3, of);
        let terms = found.iter().zip(&direction).map(|(by, d)| by * d);
        let error = (terms.sum::<f64>() - expected).abs() / norm(&found);
        assert!(error < 1e-5, "{error:e}");
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The derivatives leave out that step sizes depend on the field. For changes of the index over
/// lengths of many steps this costs at most 3e-5. The division of a derivative among neighbouring
/// samples is known to a few per cent, because a step evaluates the field six times within three
/// cells.
#[test]
fn fixed_steps_cost_what_the_tolerance_allows() {
    let samples = samples();
    let smooth = sampled(|x| 0.1 * (1.5 * x.x - x.y + 0.7 * x.z).cos());
    let along = |by: &[f64]| by.iter().zip(&smooth).map(|(by, d)| by * d).sum::<f64>();
    let exact = by_samples(&samples, 1e-11);
    let limits = [
        (1e-8, 1e-6, 3e-3),
        (1e-7, 3e-6, 3e-3),
        (1e-6, 3e-5, 0.03),
        (1e-5, 3e-5, 0.1),
        (1e-4, 3e-5, 0.1),
    ];
    for (tolerance, limit, per_sample) in limits {
        let found = by_samples(&samples, tolerance);
        let difference: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let error = along(&difference).abs() / along(&exact).abs();
        assert!(error < limit, "{tolerance:e}: {error:e}");
        let error = norm(&difference) / norm(&exact);
        assert!(error < per_sample, "{tolerance:e}: {error:e}");
    }
}

/// Rays leave a box even if a step ends on a face to within round-off. The test sends rays at many
/// angles through a grid whose cells divide its edges.
#[test]
fn rays_leave_boxes_in_which_steps_end_on_faces() {
    let bump = |x: DVec3| {
        let width = 0.16 + 0.1 * (x.z + 1.0);
        let center = DVec3::new(0.12 * (4.0 * x.z + 0.5).sin(), 0.1 * (5.0 * x.z).cos(), x.z);
        let core = (-(x - center).length_squared() / (width * width)).exp();
        1.0 + 0.03 * core * (1.5 * (1.0 - x.z * x.z)).clamp(0.0, 1.0).powi(2)
    };
    let field: Field = Bspline::from_fn([36; 3], cube(), Placement::Nodes, bump)
        .unwrap()
        .into();
    let world = Embedded::new(&field, cube(), 1.0);
    let mut ray = AdjointRay::new(
        &world,
        Receiver::Leaving(cube()),
        Tolerance::new(1e-6),
        30.0,
    );
    for i in 0..16 * 24 * 24 {
        let angle = std::f64::consts::PI * f64::from(i / 576) / 16.0;
        let (along, side) = (
            DVec3::new(angle.cos(), angle.sin(), 0.0),
            DVec3::new(-angle.sin(), angle.cos(), 0.0),
        );
        let across = |k: i32| -0.95 + 1.9 * f64::from(k) / 23.0;
        let x = side * across(i % 24) + DVec3::Z * across(i / 24 % 24) - 2.0 * along;
        let start = RayStart {
            x,
            direction: along,
            region: false,
        };
        let end = ray
            .follow(start)
            .unwrap_or_else(|error| panic!("{x} {along}: {error}"));
        let outermost = end.x.abs().max_element();
        assert!((outermost - 1.0).abs() < 1e-9, "{x} {along}: {}", end.x);
    }
}

/// In a cube of constant index the optical length is n times the length. The derivatives with
/// respect to the samples add up to the length: they exist although nothing bends the ray.
#[test]
fn uniform_grids_and_surroundings() {
    let n = 1.3;
    let bspline = grid(&sampled(|_| n));
    let field: Field = bspline.clone().into();
    let world = Embedded::new(&field, cube(), 1.0);
    let mut ray = AdjointRay::new(&world, BEHIND, Tolerance::default(), 10.0);
    let direction = DVec3::new(0.3, -0.2, 1.0).normalize();
    let begin = RayStart {
        x: -2.0 * direction,
        direction,
        region: false,
    };
    let end = ray.follow(begin).unwrap();
    let (inside, whole) = (2.0 / direction.z, 2.0 + 3.0 / direction.z);
    let expected = whole + (n - 1.0) * inside;
    assert!((end.optical_length - expected).abs() < 1e-10);
    assert!(end.x.distance(direction * (3.0 / direction.z)) < 1e-10);
    let mut sum = ParameterDerivative::new(true, &field);
    let length = EndDerivative {
        optical_length: 1.0,
        ..EndDerivative::default()
    };
    ray.pull_back(&length, &mut sum).unwrap();
    let by_n2 = bspline.sample_derivative(sum.values);
    let total: f64 = by_n2.iter().map(|by| 2.0 * n * by).sum();
    assert!((total / inside - 1.0).abs() < 1e-10, "{total} {inside}");
}
