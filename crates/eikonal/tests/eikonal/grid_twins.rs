//! Connections through sampled fields against those through the closed forms that were sampled.
//!
//! A tricubic spline through samples a spacing h apart is off by O(h⁴) in n², O(h³) in its gradient
//! and O(h²) in its Hessian; these are the orders to expect of lengths, directions and Jacobians.
//! The errors of the derivatives alternate within every cell, so that most rays, which integrate
//! them over many cells, do better; those that run along a row of cells do not, and they make up the
//! root mean square. Below all that lies the rounding of the coefficients, kept as f32: 6e-8 of
//! the contrast of n² in n², times up to 4/h² in the Hessian.

use glam::DVec3;
use morgana_eikonal::connect::{ConnectingRay, Unbounded};
use morgana_eikonal::field::{Acoustic, AcousticMode, Bspline, Gaussian, Luneburg, Placement};
use morgana_eikonal::{Aabb, Field, Solver, Tolerance};
use testkit::{Rng, fit_order};

/// Rays then contribute less than 1e-9 to lengths and directions, 2e-6 to J, of what is measured.
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

/// Root mean squares over the pairs of the errors of direction (both ends), arc length, optical length and J,
/// all but the first relative.
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

/// Errors at each of `SIZES`.
fn refine(field: &Field) -> [[f64; 4]; 4] {
    let twin = connect(field);
    SIZES.map(|n| errors(&connect(&sampled(field, n)), &twin))
}

/// Fits orders to all sizes and compares them with the least that is expected, and the errors at the
/// finest grid with their bounds, which are some three times what they are.
fn check(field: &Field, finest: [f64; 4]) {
    let table = refine(field);
    let spacings = SIZES.map(|n| 2.0 / (n - 1) as f64);
    // A quarter less than in the limit h → 0, which 16³ is not.
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
        // Rounding of δ, 6e-8 of a contrast of one; J has the Hessian, on average over the cells
        // that a ray passes.
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
    // Of the largest gradient; the spline itself is off by 1e-4 of it.
    let scale = 2.0 * 1.33 * delta / width * (-0.5f64).exp();
    for _ in 0..2000 {
        let x = DVec3::from_array(rng.uniform::<3>()) * 1.8 - 0.9;
        let error = grid.gradient(x).1.distance(field.gradient(x).1);
        assert!(error < 0.01 * scale, "{x}: {error:e} of {scale:e}");
    }
}
