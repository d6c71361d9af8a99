//! Derivatives of rays against differences of rays and closed forms (docs/theory.md#derivatives-of-rays).

use crate::common::{Random, ripples};

use crate::interface::world::{Surface, TwoRegions};
use glam::{DAffine3, DVec3};
use morgana_eikonal::adjoint::*;
use morgana_eikonal::connect::{Unbounded, World};
use morgana_eikonal::field::*;
use morgana_eikonal::interface::Rule;
use morgana_eikonal::{Aabb, Field, Tolerance};

const TIGHT: f64 = 1e-10;

fn gaussian(p: &[f64]) -> Field {
    let center = DVec3::new(p[2], p[3], p[4]);
    Gaussian::new(p[0], p[1], center, p[5]).unwrap().into()
}

fn selfoc(p: &[f64]) -> Field {
    Selfoc::new(p[0], p[1], DVec3::ZERO, DVec3::new(0.1, 0.0, 1.0))
        .unwrap()
        .into()
}

fn moved_sum(p: &[f64]) -> Field {
    let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 0.0).normalize(), 0.4);
    let moved = Affine::new(
        gaussian(&p[..6]),
        turned * DAffine3::from_scale(DVec3::new(1.2, 0.8, 1.0)),
    );
    let scaled = Scaled::new(selfoc(&p[6..]), 1.1).unwrap();
    Sum::new(1.3, vec![moved.unwrap().into(), scaled.into()])
        .unwrap()
        .into()
}

/// Fields by their parameters.
#[allow(clippy::type_complexity)]
fn families() -> Vec<(&'static str, Vec<f64>, fn(&[f64]) -> Field)> {
    let bump = vec![1.3, 0.08, 0.1, -0.1, 0.05, 0.6];
    let rod = vec![1.5, 0.4];
    let both = [bump.clone(), rod.clone()].concat();
    vec![
        ("gaussian", bump, gaussian),
        ("selfoc", rod, selfoc),
        ("sum of moved and scaled", both, moved_sum),
    ]
}

/// d/dp by a central difference, extrapolated once.
fn derivative(p: &[f64], i: usize, h: f64, f: impl Fn(&[f64]) -> f64) -> f64 {
    let at = |step: f64| {
        let mut q = p.to_vec();
        q[i] += step;
        f(&q)
    };
    let central = |h: f64| (at(h) - at(-h)) / (2.0 * h);
    (4.0 * central(h / 2.0) - central(h)) / 3.0
}

#[test]
fn fields_by_their_parameters() {
    let by = IndexDerivative {
        n2: 0.7,
        gradient: DVec3::new(0.3, -0.5, 0.2),
    };
    let mut random = Random(3);
    let region = Aabb::new(DVec3::splat(-0.7), DVec3::splat(0.7));
    for (name, p, field) in families() {
        for _ in 0..20 {
            let x = random.point(&region);
            let value = |p: &[f64]| {
                let (n2, gradient) = field(p).gradient(x);
                by.n2 * n2 + by.gradient.dot(gradient)
            };
            let mut found = vec![0.0; p.len()];
            assert_eq!(field(&p).parameter_count(), p.len());
            field(&p).add_parameter_derivative(x, by, &mut found);
            for (i, found) in found.iter().enumerate() {
                let expected = derivative(&p, i, 1e-3, value);
                let error = (found - expected).abs();
                assert!(
                    error < 1e-8 * (1.0 + expected.abs()),
                    "{name} {i}: {error:e}"
                );
            }
        }
    }
}

const PLANE: Receiver = Receiver::Plane {
    point: DVec3::new(0.0, 0.0, 1.2),
    normal: DVec3::Z,
};

/// Weights of a loss that is linear in where and how rays end.
const LOSS: EndDerivative = EndDerivative {
    x: DVec3::new(0.3, -0.8, 0.1),
    v: DVec3::new(-0.6, 0.4, 0.2),
    optical_length: 0.5,
};

fn loss(end: &RayEnd) -> f64 {
    LOSS.x.dot(end.x) + LOSS.v.dot(end.v) + LOSS.optical_length * end.optical_length
}

fn start<R>(p: &[f64], region: R) -> RayStart<R> {
    let [x, d] = [&p[..3], &p[3..]].map(DVec3::from_slice);
    RayStart {
        x,
        direction: d.normalize(),
        region,
    }
}

fn follow<W: World>(
    world: &W,
    receiver: Receiver,
    tolerance: f64,
    start: RayStart<W::Region>,
) -> RayEnd {
    let mut ray = AdjointRay::new(world, receiver, Tolerance::new(tolerance), 10.0);
    ray.follow(start).unwrap()
}

#[test]
fn rays_by_parameters_and_starts() {
    let begin = [0.15, 0.1, -1.2, 0.1, 0.05, 1.0];
    for (name, p, field) in families() {
        let index = field(&p);
        let world = Unbounded(&index);
        let mut ray = AdjointRay::new(&world, PLANE, Tolerance::new(TIGHT), 10.0);
        ray.follow(start(&begin, ())).unwrap();
        let mut sum = ParameterDerivative::new((), &index);
        let back = ray.pull_back(&LOSS, &mut sum).unwrap();
        for i in 0..p.len() {
            let of = |p: &[f64]| {
                loss(&follow(
                    &Unbounded(&field(p)),
                    PLANE,
                    TIGHT,
                    start(&begin, ()),
                ))
            };
            let expected = derivative(&p, i, 2e-3, of);
            let error = (sum.values[i] - expected).abs() / (0.1 + expected.abs());
            assert!(error < 3e-7, "{name} {i}: {error:e}, {expected}");
        }
        // begin[3..] is not of unit length: derivatives by it are those by the direction over its length.
        let length = DVec3::from_slice(&begin[3..]).length();
        let found = [back.x, back.direction / length]
            .map(|d| d.to_array())
            .concat();
        for (i, found) in found.iter().enumerate() {
            let expected = derivative(&begin, i, 1e-3, |b| {
                loss(&follow(&world, PLANE, TIGHT, start(b, ())))
            });
            let error = (found - expected).abs() / (0.1 + expected.abs());
            assert!(error < 3e-7, "{name}, start {i}: {error:e}, {expected}");
        }
    }
}

#[test]
fn rays_through_balls_and_planes() {
    let begin = [0.1, -0.05, -0.8, 0.1, 0.15, 1.0];
    let tilted = DVec3::new(0.2, -0.3, -1.0).normalize();
    let surfaces = [
        Surface::Plane(DVec3::ZERO, tilted),
        Surface::Ball(DVec3::Z * 0.7, 0.8),
    ];
    let p = [1.5, 0.1, 0.1, 0.0, 0.6, 0.5];
    for surface in surfaces {
        for (rule, z) in [
            (Rule::Refract, 2.0),
            (Rule::Pass, 2.0),
            (Rule::Reflect, -1.5),
        ] {
            let receiver = Receiver::Plane {
                point: DVec3::Z * z,
                normal: DVec3::Z,
            };
            let world = |p: &[f64]| {
                let slope = DVec3::new(0.05, -0.1, 0.08);
                let around = LinearIndex::new(1.2, slope, DVec3::ZERO).unwrap().into();
                TwoRegions {
                    surface,
                    fields: [gaussian(p), around],
                    rule,
                }
            };
            let here = world(&p);
            let mut ray = AdjointRay::new(&here, receiver, Tolerance::new(TIGHT), 10.0);
            ray.follow(start(&begin, 1)).unwrap();
            let mut sum = ParameterDerivative::new(0, &here.fields[0]);
            let back = ray.pull_back(&LOSS, &mut sum).unwrap();
            for i in 0..p.len() {
                let of = |p: &[f64]| loss(&follow(&world(p), receiver, TIGHT, start(&begin, 1)));
                let expected = derivative(&p, i, 1e-3, of);
                let error = (sum.values[i] - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} {i}: {error:e}, {expected}");
            }
            let length = DVec3::from_slice(&begin[3..]).length();
            let found = [back.x, back.direction / length]
                .map(|d| d.to_array())
                .concat();
            for (i, found) in found.iter().enumerate() {
                let of = |b: &[f64]| loss(&follow(&here, receiver, TIGHT, start(b, 1)));
                let expected = derivative(&begin, i, 1e-3, of);
                let error = (found - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} start {i}: {error:e}, {expected}");
            }
        }
    }
}

const DIMS: [usize; 3] = [9, 8, 10];

fn cube() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
}

/// A function of position at the samples of the grid.
fn sampled(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut samples = Vec::new();
    Bspline::from_fn(DIMS, cube(), Placement::Nodes, |x| {
        samples.push(f(x));
        1.0
    })
    .unwrap();
    // The first is asked for beforehand, as the reference.
    samples.remove(0);
    samples
}

/// Samples of n.
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

/// Derivatives by the samples, of a ray through the cube from outside.
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

/// Coefficients are f32, whose rounding, 1e-9 of n², over steps of 2e-3 limits differences to 1e-6.
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

/// Step sizes depend on the field; their derivatives are left out. For changes of the index over lengths of many steps this
/// costs 3e-5 at most; how much falls to which of neighbouring samples is known to a few per cent, as steps take six looks at three cells.
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

/// Derivatives of one component of a ray's end by the parameters of a field.
fn by_parameters(
    field: &Field,
    receiver: Receiver,
    start: RayStart<()>,
    loss: impl Fn(&RayEnd) -> EndDerivative,
) -> Vec<f64> {
    let world = Unbounded(field);
    let mut ray = AdjointRay::new(&world, receiver, Tolerance::new(TIGHT), 100.0);
    let end = ray.follow(start).unwrap();
    let mut sum = ParameterDerivative::new((), field);
    ray.pull_back(&loss(&end), &mut sum).unwrap();
    sum.values
}

/// A weak bump Δ exp(−r²/2w²) turns a ray at the distance b from its centre by −√(2π) Δ (b/w) exp(−b²/2w²), to first order in Δ.
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
    // By the optical length: ∫exp(−r²/2w²) ds. Steps are chosen for positions, to which a weak bump matters little.
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

/// A meridional ray that starts parallel to the axis of a graded rod, at x₀: x = x₀ cos gz with g = α/√(1 − α²x₀²).
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
    // The index on the axis does not matter.
    assert!(found[0].abs() < 1e-9, "{}", found[0]);
}

/// What rays that have no end are told, and that they give no derivative.
#[test]
fn rays_without_an_end() {
    let field: Field = Constant::new(1.0).into();
    let away = RayStart {
        x: DVec3::Z * 2.0,
        direction: DVec3::Z,
        region: (),
    };
    let world = Unbounded(&field);
    let mut ray = AdjointRay::new(&world, PLANE, Tolerance::default(), 10.0);
    assert_eq!(ray.follow(away), Err(RayFailure::Missed));
    assert_eq!(ray.pull_back(&LOSS, &mut ()), None);
    let rod: Field = Selfoc::new(1.5, 1.0, DVec3::ZERO, DVec3::Z).unwrap().into();
    let world = Unbounded(&rod);
    let mut ray = AdjointRay::new(&world, PLANE, Tolerance::default(), 10.0);
    let outside = RayStart {
        x: DVec3::X * 1.5,
        direction: DVec3::Z,
        region: (),
    };
    assert_eq!(ray.follow(outside), Err(RayFailure::Lost));
}

/// Through a cube of one index the optical length is n times the length, and the derivatives by the samples add up to the length: they
/// are there although nothing bends the ray.
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
