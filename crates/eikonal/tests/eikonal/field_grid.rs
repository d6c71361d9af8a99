//! Tricubic B-spline grids: exact reproduction of cubics, order of convergence, and behaviour at
//! the faces.

use crate::common::{self, Random, assert_jets_agree, max_entry, ripples};
use glam::{DMat3, DVec3};
use morgana_eikonal::field::*;
use morgana_eikonal::{Aabb, Field, Jet};
use std::f64::consts::PI;

const PLACEMENTS: [Placement; 2] = [Placement::Nodes, Placement::Centers];

fn cube(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

fn sampled(dims: [usize; 3], bounds: Aabb, placement: Placement, field: &Field) -> Field {
    let index = |x| field.n(x);
    Bspline::from_fn(dims, bounds, placement, index)
        .unwrap()
        .into()
}

#[test]
fn quadratic_squared_index_is_exact_up_to_the_faces() {
    let mut random = Random(29);
    let bounds = Aabb::new(DVec3::new(-1.0, -0.9, -0.8), DVec3::new(0.9, 1.0, 1.1));
    let lens = Field::from(Luneburg::new(1.0, DVec3::new(0.1, 0.0, -0.1), 1.5).unwrap());
    let rod = Field::from(Selfoc::new(1.5, 0.4, DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)).unwrap());
    for field in [lens, rod] {
        for placement in PLACEMENTS {
            for dims in [[3, 4, 5], [9, 12, 7]] {
                let grid = sampled(dims, bounds, placement, &field);
                for x in (0..300)
                    .map(|_| random.point(&bounds))
                    .chain(bounds.corners())
                {
                    // δ is of order one and accurate to 6e-8. The Hessian multiplies its error by
                    // 4/spacing² < 200, and the continuation past the faces by a few more.
                    assert_jets_agree(grid.jet(x), field.jet(x), 1e-4);
                    assert!((grid.n2(x) - field.n2(x)).abs() < 2e-6);
                }
            }
        }
    }
}

/// n² with all monomials up to degree three in each variable.
fn cubic(x: DVec3) -> f64 {
    let p = |t: f64, a: f64| 1.0 + t * (a + t * (0.3 + 0.2 * t));
    2.0 + 0.02 * p(x.x, 0.5) * p(x.y, -0.7) * p(x.z, 0.1)
}

#[test]
fn cubic_squared_index_is_exact_away_from_the_faces() {
    let mut random = Random(31);
    for placement in PLACEMENTS {
        let grid = Bspline::from_fn([48; 3], cube(1.0), placement, |x| cubic(x).sqrt());
        let grid = Field::from(grid.unwrap());
        for x in (0..500).map(|_| random.point(&cube(0.5))) {
            // Twelve spacings from the faces their effect has decayed to 0.27¹² = 1e-7.
            assert!((grid.n2(x) - cubic(x)).abs() < 1e-8, "{placement:?} {x}");
        }
    }
}

/// Largest errors of n², ∇n² and Hess n² on a grid of `n` samples along each axis.
fn errors(n: usize) -> [f64; 3] {
    let field = Field::from(Gaussian::new(1.4, 0.1, DVec3::new(0.05, -0.1, 0.02), 0.3).unwrap());
    let grid = sampled([n; 3], cube(1.0), Placement::Nodes, &field);
    let mut random = Random(37);
    let mut worst = [0.0_f64; 3];
    for x in (0..4000).map(|_| random.point(&cube(0.6))) {
        let (a, b): (Jet, Jet) = (grid.jet(x), field.jet(x));
        let found = [
            (a.n2 - b.n2).abs(),
            (a.grad - b.grad).length(),
            max_entry(a.hess - b.hess),
        ];
        worst = std::array::from_fn(|i| worst[i].max(found[i]));
    }
    worst
}

#[test]
fn interpolation_converges_with_orders_four_three_two() {
    let refined = [13, 25, 49].map(errors);
    for pair in refined.windows(2) {
        for (i, order) in [4.0, 3.0, 2.0].into_iter().enumerate() {
            let measured = (pair[0][i] / pair[1][i]).log2();
            // The coarsest spacing, half the width, is not yet in the asymptotic range;
            // higher-order terms reduce the measured order.
            assert!(
                measured > order - 0.25,
                "derivative {i}: order {measured}, errors {refined:?}"
            );
        }
    }
}

#[test]
fn small_contrasts_survive_single_precision() {
    let bump = |delta| Field::from(Gaussian::new(1.33, delta, DVec3::ZERO, 0.4).unwrap());
    let strong = sampled([33; 3], cube(1.0), Placement::Nodes, &bump(1e-2));
    let weak = sampled([33; 3], cube(1.0), Placement::Nodes, &bump(1e-6));
    let mut random = Random(41);
    for x in (0..200).map(|_| random.point(&cube(0.9))) {
        let (a, b) = (strong.jet(x), weak.jet(x));
        // In the strong field the term in Δ² makes Δn² larger by a fraction of 1e-2/(2n).
        assert!((a.grad * 1e-4 - b.grad).length() < 0.01 * 1e-6 / 0.4);
        assert!(max_entry(a.hess * 1e-4 - b.hess) < 0.02 * 1e-6 / 0.16);
    }
}

#[test]
fn samples_run_x_fastest_and_lie_where_placement_says() {
    let dims = [5, 4, 3];
    let bounds = Aabb::new(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.0));
    let value = |i: usize| 1.3 + 0.01 * ((i * 7) % 11) as f64;
    let samples: Vec<f64> = (0..60).map(value).collect();
    for placement in PLACEMENTS {
        let grid = Bspline::from_samples(dims, bounds, placement, &samples).unwrap();
        let grid = Field::from(grid);
        for i in 0..60 {
            let index = DVec3::new((i % 5) as f64, (i / 5 % 4) as f64, (i / 20) as f64);
            let x = match placement {
                Placement::Nodes => index,
                Placement::Centers => (index + 0.5) * bounds.size() / DVec3::new(5.0, 4.0, 3.0),
            };
            assert!((grid.n(x) - value(i)).abs() < 1e-6, "sample {i}");
        }
    }
    let single: Vec<f32> = samples.iter().map(|n| *n as f32).collect();
    assert!(Bspline::from_samples(dims, bounds, Placement::Nodes, &single).is_ok());
}

#[test]
fn few_samples_along_an_axis_give_lower_degrees() {
    let linear = |x: DVec3| (2.0 + 0.1 * x.y).sqrt();
    for placement in PLACEMENTS {
        let grid = Bspline::from_fn([1, 2, 1], cube(1.0), placement, linear).unwrap();
        let grid = Field::from(grid);
        // In a linear field the length scale is the size of the grid.
        assert!((grid.length_scale(DVec3::ZERO) - spacing(2, placement)).abs() < 1e-15);
        for x in [DVec3::splat(0.9), DVec3::new(50.0, -0.7, -1e9)] {
            let expected = Jet {
                n2: 2.0 + 0.1 * x.y,
                grad: DVec3::Y * 0.1,
                hess: DMat3::ZERO,
            };
            assert_jets_agree(grid.jet(x), expected, 1e-6);
            assert_eq!(grid.jet(x).grad.x, 0.0);
        }
    }
}

fn spacing(n: usize, placement: Placement) -> f64 {
    match placement {
        Placement::Nodes => 2.0 / (n - 1) as f64,
        Placement::Centers => 2.0 / n as f64,
    }
}

/// In n² = 2 + a cos kx the length scale is (2n²/ak⁴)^¼ where the cosine is ±1. Around the node in
/// the middle it is plus or minus one. Fourth differences of the coefficients are off by less than
/// 1 % here.
#[test]
fn the_length_scale_follows_from_fourth_derivatives() {
    let (a, k) = (0.1_f64, PI / 0.5);
    let wave = |x: DVec3| (2.0 + a * (k * x.x).cos()).sqrt();
    let grid = Bspline::from_fn([33, 9, 9], cube(1.0), Placement::Nodes, wave).unwrap();
    let length = Field::from(grid).length_scale(DVec3::ZERO);
    let expected = |n2: f64| (2.0 * n2 / (a * k.powi(4))).sqrt().sqrt();
    assert!(
        length > 0.99 * expected(1.9) && length < 1.01 * expected(2.1),
        "{length}"
    );
}

/// The length scale does not depend on the spacing of the samples. Rounding of coefficients,
/// divided by the fourth power of the spacing, must not count as structure of the field. Close
/// samples are therefore judged on coarser lattices, which smooth the wave a little: the length was
/// measured to change by 1.4 %.
#[test]
fn the_length_scale_does_not_depend_on_the_spacing() {
    let (a, k) = (0.1_f64, PI / 0.5);
    let wave = |x: DVec3| (2.0 + a * (k * x.x).cos()).sqrt();
    let expected = |n2: f64| (2.0 * n2 / (a * k.powi(4))).sqrt().sqrt();
    for samples in [65, 129, 257, 513, 1025, 2049] {
        let grid = Bspline::from_fn([samples, 9, 9], cube(1.0), Placement::Nodes, wave).unwrap();
        // The contrast vanishes in the middle, where nothing is rounded, and is largest halfway to
        // the face.
        for x in [0.0, 0.5] {
            let length = Field::from(grid.clone()).length_scale(DVec3::X * x);
            assert!(
                length > 0.95 * expected(1.9) && length < 1.05 * expected(2.1),
                "{samples}, {x}: {length}"
            );
        }
    }
}

/// A single deviating sample makes steps small around it, and nowhere else.
#[test]
fn a_lone_sample_is_not_stepped_over() {
    let spike = |x: DVec3| if x.length() < 1e-9 { 1.4 } else { 1.3 };
    let grid = Bspline::from_fn([65; 3], cube(1.0), Placement::Nodes, spike).unwrap();
    let grid = Field::from(grid);
    let near = grid.length_scale(DVec3::ZERO);
    assert!(near < 2.0 * spacing(65, Placement::Nodes), "{near}");
    for distance in [0.1, 0.3, 0.6, 0.99] {
        let there = grid.length_scale(DVec3::Y * distance);
        assert!(there <= near + distance, "{there} at {distance}");
        // Length scales refer to blocks of eight cells, and their slopes along the axes are 1/√3.
        assert!(there >= 0.5 * (distance - 0.25), "{there} at {distance}");
    }
}

#[test]
fn constant_samples_make_a_constant_field() {
    let grid = Bspline::from_fn([4, 1, 9], cube(1.0), Placement::Centers, |_| 1.37).unwrap();
    let grid = Field::from(grid);
    assert!(grid.is_constant() && grid.length_scale(DVec3::ZERO).is_infinite());
    assert_eq!(grid.jet(DVec3::splat(0.3)), Jet::constant(1.37 * 1.37));
    assert_eq!(grid.bounds(&cube(3.0)).kappa(), 0.0);
    let varied = Bspline::from_fn([4; 3], cube(1.0), Placement::Nodes, ripples).unwrap();
    assert!(!Field::from(varied).is_constant());
}

/// Jets agree on both sides of every knot, and of the places where the coefficients begin to
/// repeat.
#[test]
fn field_is_twice_continuously_differentiable_everywhere() {
    let grid = Field::from(common::grid(Placement::Nodes));
    let h = 2.0 / 16.0;
    for step in -40..60 {
        let x = DVec3::new(-1.0 + 0.5 * h * f64::from(step), 0.93, -1.1);
        let offset = DVec3::X * 1e-9;
        assert_jets_agree(grid.jet(x - offset), grid.jet(x + offset), 1e-5);
    }
}

#[test]
fn far_outside_the_field_is_finite_and_flat() {
    for placement in PLACEMENTS {
        let grid = Field::from(common::grid(placement));
        for far in [30.0, 1e10, 1e300, f64::MAX, f64::INFINITY] {
            for x in [DVec3::splat(far), DVec3::splat(-far), DVec3::X * far] {
                let jet = grid.jet(x);
                assert!(jet.n2 > 1.0 && jet.n2 < 3.0, "{x}: {jet:?}");
                assert!(jet.grad.x.abs() < 1e-15);
            }
        }
    }
}

#[test]
fn bad_grids_are_refused() {
    let (dims, nodes) = ([2, 3, 4], Placement::Nodes);
    let mut samples = [1.3_f32; 24];
    let of = |dims, bounds, samples: &[f32]| {
        let grid = Bspline::from_samples(dims, bounds, nodes, samples);
        grid.map(|_| ()).unwrap_err()
    };
    let empty = of([2, 0, 4], cube(1.0), &samples);
    assert_eq!(empty, FieldError::EmptyGrid { dims: [2, 0, 4] });
    assert!(matches!(
        of([usize::MAX, 2, 2], cube(1.0), &samples),
        FieldError::GridTooLarge { .. }
    ));
    // This size exceeds the memory of any machine, but does not overflow.
    let huge = Bspline::from_fn([1 << 19; 3], cube(1.0), nodes, |_| 1.3);
    assert!(matches!(huge, Err(FieldError::GridTooLarge { .. })));
    for bounds in [cube(0.0), cube(f64::INFINITY), cube(f64::NAN), Aabb::EMPTY] {
        assert!(matches!(
            of(dims, bounds, &samples),
            FieldError::BadBox { .. }
        ));
    }
    let few = of(dims, cube(1.0), &samples[1..]).to_string();
    assert_eq!(
        few,
        "a grid of [2, 3, 4] needs 24 samples, but 23 are given"
    );
    for bad in [f32::NAN, 0.0, -1.3, f32::INFINITY] {
        samples[11] = bad;
        let error = of(dims, cube(1.0), &samples);
        let FieldError::BadSample { index, .. } = error else {
            panic!("{error}");
        };
        assert_eq!(index, [1, 2, 1]);
    }
}

/// Samples take four bytes each. Each axis has two more samples at either end.
#[test]
fn grids_are_no_larger_than_their_samples() {
    let field: Field = Bspline::from_fn([128; 3], cube(1.0), Placement::Nodes, |_| 1.3)
        .unwrap()
        .into();
    assert!(field.memory() as f64 <= 4.5 * 128f64.powi(3));
}

/// Bounds over large boxes of long grids use coarser blocks. They hold, and are only a little too
/// wide.
#[test]
fn bounds_of_long_grids() {
    let index = |x: DVec3| 1.3 + 0.05 * (9.0 * x.x).sin() * (2.0 * x.y).cos();
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let grid = Bspline::from_fn([600, 9, 7], cube, Placement::Nodes, index).unwrap();
    let field: Field = grid.into();
    for [low, high] in [[-1.0, 1.0], [-0.9, -0.2], [0.1, 0.35]] {
        let region = Aabb::new(DVec3::new(low, -1.0, -1.0), DVec3::new(high, 1.0, 1.0));
        let bounds = field.bounds(&region);
        let at = |i: i32, j: i32| {
            let t = f64::from(i) / 400.0;
            field.n2(DVec3::new(
                low + t * (high - low),
                f64::from(j) / 5.0 - 1.0,
                0.3,
            ))
        };
        let values: Vec<f64> = (0..=400)
            .flat_map(|i| (0..=10).map(move |j| at(i, j)))
            .collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        assert!(bounds.n2_min <= least && most <= bounds.n2_max);
        assert!(
            bounds.n2_max - bounds.n2_min < 1.5 * (most - least),
            "{low}"
        );
    }
}
