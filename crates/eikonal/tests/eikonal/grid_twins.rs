//! Connections through sampled fields, compared with connections through the closed forms that were
//! sampled.
//!
//! A tricubic spline through samples at spacing h is off by O(h⁴) in n², O(h³) in its gradient and
//! O(h²) in its Hessian. Lengths, directions and Jacobians should converge at these orders. Errors
//! of the derivatives alternate within every cell, so that most rays, which integrate them over
//! many cells, have smaller errors. Rays that run along a row of cells do not, and dominate the
//! root mean square.
//!
//! Rounding of the coefficients to f32 limits all errors from below: 6e-8 of the contrast in n²,
//! and up to 4/h² times as much in the Hessian.

use glam::DVec3;
use morgana_eikonal::connect::{ConnectingRay, Unbounded};
use morgana_eikonal::field::{Acoustic, AcousticMode, Bspline, Gaussian, Luneburg, Placement};
use morgana_eikonal::{Aabb, Field, Solver, Tolerance};
use testkit::{Rng, fit_order};

/// Tolerance of rays. They then contribute less than 1e-9 to the measured errors of lengths and
/// directions, and 2e-6 to the error of J.
const TOLERANCE: f64 = 1e-9;
const PAIRS: usize = 100;
const SIZES: [usize; 4] = [16, 32, 64, 96];

fn cube() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
}

fn sampled(field: &Field, n: usize) -> Field {
    let grid = Bspline::from_fn([n; 3], cube(), Placement::Nodes, |x| field.n(x));
    grid.unwrap().into()
}

/// Pairs on opposite sides of the middle, away from the faces.
fn pairs() -> Vec<[DVec3; 2]> {
    let mut rng = Rng::new(21);
    (0..PAIRS)
        .map(|_| {
            let a = DVec3::from_array(rng.direction());
            let b = (DVec3::from_array(rng.direction()) * 0.6 - a).normalize();
            [a * rng.range(0.4, 0.7), b * rng.range(0.4, 0.7)]
        })
        .collect()
}

fn connect(field: &Field) -> Vec<ConnectingRay> {
    let mut solver = Solver::new(Tolerance::new(TOLERANCE));
    let mut ray = |[x, y]: [DVec3; 2]| solver.connect(&Unbounded(field), x, (), y).unwrap();
    pairs().into_iter().map(&mut ray).collect()
}

/// Returns root mean squares over the pairs of the errors of direction (at both ends), arc length,
/// optical length and J. All except the first are relative.
fn errors(grid: &[ConnectingRay], twin: &[ConnectingRay]) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (a, b) in grid.iter().zip(twin) {
        let turned = a.direction_out.distance_squared(b.direction_out)
            + a.direction_in.distance_squared(b.direction_in);
        let relative = |a: f64, b: f64| (a / b - 1.0).powi(2);
        sums[0] += 0.5 * turned;
        sums[1] += relative(a.arc_length, b.arc_length);
        sums[2] += relative(a.optical_length, b.optical_length);
        sums[3] += relative(a.jacobian, b.jacobian);
    }
    sums.map(|s| (s / grid.len() as f64).sqrt())
}

/// Returns the errors at each of `SIZES`.
fn refine(field: &Field) -> [[f64; 4]; 4] {
    let twin = connect(field);
    SIZES.map(|n| errors(&connect(&sampled(field, n)), &twin))
}

/// Fits orders of convergence to all sizes and compares them with the smallest expected ones.
/// Compares the errors on the finest grid with their bounds, which are about three times the
/// measured errors.
fn check(field: &Field, finest: [f64; 4]) {
    let table = refine(field);
    let spacings = SIZES.map(|n| 2.0 / (n - 1) as f64);
    // Allow a quarter less than the asymptotic order, because 16³ samples are not yet in the limit
    // h → 0.
    for (i, least) in [2.75, 3.75, 3.75, 1.75].into_iter().enumerate() {
        let order = fit_order(&spacings, &table.map(|row| row[i])).order;
        let last = table[SIZES.len() - 1][i];
        println!("{i}: order {order:.2}, {last:.2e}");
        assert!(order > least, "{i}: order {order}, errors {table:?}");
        assert!(last < finest[i], "{i}: errors {table:?}");
    }
}

#[test]
fn a_bump_converges() {
    let field = Gaussian::new(1.33, 0.1, DVec3::new(0.05, -0.1, 0.02), 0.3).unwrap();
    check(&field.into(), [3e-7, 3e-9, 3e-8, 3e-5]);
}

#[test]
fn a_sound_wave_converges() {
    let mode = AcousticMode::new(0.02, 1, 9.0, 0.3).unwrap();
    let field = Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Y, vec![mode]).unwrap();
    check(&field.into(), [3e-7, 3e-9, 3e-8, 3e-5]);
}

#[test]
fn a_quadratic_field_is_exact_but_for_rounding() {
    let field = Luneburg::new(1.0, DVec3::ZERO, 1.5).unwrap();
    for (row, n) in refine(&field.into()).iter().zip(SIZES) {
        // Rounding of δ is 6e-8 of a contrast of one. J depends on the Hessian, averaged over the
        // cells that a ray passes.
        let per_spacing = (n - 1) as f64 / 2.0;
        assert!(
            row[0] < 3e-8 && row[1] < 1e-9 && row[2] < 3e-9,
            "{n}: {row:?}"
        );
        assert!(row[3] < 3e-10 * per_spacing.powi(2) + 1e-8, "{n}: {row:?}");
    }
}

#[test]
fn a_contrast_of_a_millionth_keeps_its_gradient_to_a_percent() {
    let (delta, width) = (1e-6, 0.3);
    let field = Field::from(Gaussian::new(1.33, delta, DVec3::ZERO, width).unwrap());
    let grid = sampled(&field, 64);
    let mut rng = Rng::new(22);
    // Errors are relative to the largest gradient; the spline itself is off by 1e-4 of it.
    let scale = 2.0 * 1.33 * delta / width * (-0.5f64).exp();
    for _ in 0..2000 {
        let x = DVec3::from_array(rng.uniform::<3>()) * 1.8 - 0.9;
        let error = grid.gradient(x).1.distance(field.gradient(x).1);
        assert!(error < 0.01 * scale, "{x}: {error:e} of {scale:e}");
    }
}
