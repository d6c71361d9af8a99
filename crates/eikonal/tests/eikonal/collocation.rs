//! Rays found by collocation, without shooting, compared with rays shot at a tolerance of 1e-10.
//!
//! Allowed errors are twice the requested tolerance for directions, lengths and positions, and five
//! times the tolerance for the Jacobian. A shot that misses by up to ten tolerances counts as
//! having arrived. In grids the Hessian has kinks at every plane of samples, and the quadrature has
//! only a few points between these planes. There the Jacobian is accurate to 2e-4, also for shots.

use glam::DVec3;
use morgana_eikonal::connect::{ConnectingRay, InitialGuess, Pattern, RayFamily, Unbounded};
use morgana_eikonal::field::{Acoustic, AcousticMode, Bspline, Gaussian, Luneburg, Placement, Sum};
use morgana_eikonal::{Aabb, Field, Solver, Tolerance};
use testkit::Rng;

const EXACT: f64 = 1e-10;
const PAIRS: usize = 200;

fn in_ball(rng: &mut Rng, radius: f64) -> DVec3 {
    DVec3::from_array(rng.direction()) * (radius * rng.next_1d().cbrt())
}

/// Fields, each with the smallest error of the Jacobian that can be expected.
fn fields() -> Vec<(&'static str, Field, f64)> {
    let bump = Gaussian::new(1.33, 0.1, DVec3::ZERO, 0.4).unwrap();
    let cube = Aabb::new(-DVec3::ONE, DVec3::ONE);
    let sampled = Field::from(bump);
    let grid = Bspline::from_fn([64; 3], cube, Placement::Nodes, |x| sampled.n(x));
    let mode = AcousticMode::new(0.01, 3, 10.0, 0.3).unwrap();
    let sound = Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]);
    // Chords of many wavelengths, which take relaxation.
    let mode = AcousticMode::new(1e-3, 0, 60.0, 0.3).unwrap();
    let ultrasound = Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]);
    vec![
        ("bump", bump.into(), 0.0),
        ("grid", grid.unwrap().into(), 2e-4),
        ("sound", sound.unwrap().into(), 0.0),
        ("ultrasound", ultrasound.unwrap().into(), 0.0),
        (
            "Luneburg",
            Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(),
            0.0,
        ),
    ]
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

/// Largest distance of points on one ray from another ray.
fn apart(ray: &Solver<()>, exact: &Solver<()>) -> f64 {
    let distance = |x: DVec3| {
        let near = exact.pieces().iter().map(|p| {
            let theta = p.arc.closest_approach(x).min(p.theta_end);
            p.arc.position(theta).distance(x)
        });
        near.fold(f64::INFINITY, f64::min)
    };
    let inside = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
    let points = ray
        .pieces()
        .iter()
        .flat_map(|p| inside.map(|t| p.arc.position(t)));
    points.map(distance).fold(0.0, f64::max)
}

/// Errors divided by the tolerance: the largest of directions, lengths and positions, and the error
/// of the Jacobian.
fn errors(found: &ConnectingRay, exact: &ConnectingRay, apart: f64) -> [f64; 2] {
    let all = [
        found.direction_out.distance(exact.direction_out),
        found.direction_in.distance(exact.direction_in),
        relative(found.arc_length, exact.arc_length),
        relative(found.optical_length, exact.optical_length),
        relative(found.sigma, exact.sigma),
        apart / exact.arc_length,
    ];
    let jacobian = relative(found.jacobian, exact.jacobian);
    [all.into_iter().fold(0.0, f64::max), jacobian]
}

#[test]
fn rays_are_as_good_as_the_tolerance_says() {
    for (name, field, floor) in fields() {
        let world = Unbounded(&field);
        for tolerance in [1e-4, 1e-5, 1e-6] {
            let mut rng = Rng::new(7);
            let mut solver = Solver::new(Tolerance::new(tolerance));
            let mut exact = Solver::new(Tolerance::new(EXACT));
            let mut direct = 0;
            for _ in 0..PAIRS {
                let (x, y) = (in_ball(&mut rng, 0.95), in_ball(&mut rng, 0.95));
                let found = solver.connect(&world, x, (), y).unwrap();
                if found.shots > 0 {
                    continue;
                }
                direct += 1;
                let truth = exact.connect(&world, x, (), y).unwrap();
                let [ray, jacobian] = errors(&found, &truth, apart(&solver, &exact));
                let limits = [2.0 * tolerance, floor.max(5.0 * tolerance)];
                assert!(
                    ray < limits[0] && jacobian < limits[1],
                    "{name} {tolerance:e}: {ray:e} {jacobian:e} {found:?} {truth:?}"
                );
                let ends = [solver.pieces()[0].arc.start(), {
                    let last = solver.pieces().last().unwrap();
                    last.arc.end()
                }];
                assert!(ends[0].distance(x) < 1e-14 && ends[1].distance(y) < 1e-14);
            }
            // Check that collocation found most rays; the comparison would be empty without them.
            assert!(direct > PAIRS / 2, "{name} {tolerance:e}: {direct}");
        }
    }
}

/// Turbulence: a grid of independent samples, which no few nodes resolve.
fn rough() -> Field {
    let mut rng = Rng::new(3);
    let bounds = Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1));
    let sample = |_| 1.33 + 1e-3 * (2.0 * rng.next_1d() - 1.0);
    let grid = Bspline::from_fn([64; 3], bounds, Placement::Nodes, sample);
    grid.unwrap().into()
}

/// Rays through rough samples are found by relaxation, without tracing. Jacobians of traced rays
/// are not as accurate as the tolerance there, and Jacobians of relaxation are compared with them.
#[test]
fn rays_through_rough_samples_are_as_good_as_traced_rays() {
    let field = rough();
    let world = Unbounded(&field);
    for tolerance in [1e-4, 1e-6] {
        let mut rng = Rng::new(8);
        let [mut relaxing, mut tracing, mut exact] =
            [tolerance, tolerance, EXACT].map(|tolerance| Solver::new(Tolerance::new(tolerance)));
        let (mut relaxed, mut squares) = (0, [0.0; 2]);
        for _ in 0..PAIRS {
            let (x, y) = (in_ball(&mut rng, 0.95), in_ball(&mut rng, 0.95));
            let guess = InitialGuess {
                family: RayFamily::Point {
                    x,
                    direction: (y - x).normalize(),
                },
                region: (),
                optical_length: field.n(x) * x.distance(y),
                pattern: Pattern::REFRACT,
            };
            let found = relaxing.connect(&world, x, (), y).unwrap();
            if found.shots > 0 {
                continue;
            }
            relaxed += 1;
            let truth = exact.solve(&world, &guess, y).unwrap();
            let [ray, jacobian] = errors(&found, &truth, apart(&relaxing, &exact));
            assert!(
                ray < 2.0 * tolerance,
                "{tolerance:e}: {ray:e} {found:?} {truth:?}"
            );
            let traced = tracing.solve(&world, &guess, y).unwrap();
            squares[0] += jacobian.powi(2);
            squares[1] += relative(traced.jacobian, truth.jacobian).powi(2);
        }
        let [relaxed_error, traced_error] = squares.map(f64::sqrt);
        println!(
            "{tolerance:e}: {relaxed} {relaxed_error:e} {traced_error:e} {:?}",
            relaxing.work
        );
        assert!(relaxed > PAIRS * 9 / 10, "{tolerance:e}: {relaxed}");
        assert!(
            relaxed_error < 1.5 * traced_error,
            "{relaxed_error:e} {traced_error:e}"
        );
    }
}

/// Collocation leaves a bump a tenth as wide as the chord to the shooting method, wherever it lies
/// along the chord. The Jacobian of shots is accurate to 3e-3 if they miss by up to ten tolerances
/// of 1e-4.
#[test]
fn features_between_the_nodes_are_seen() {
    let (x, y) = (DVec3::new(-1.0, 0.01, 0.0), DVec3::new(1.0, 0.0, 0.02));
    for i in 0..=100 {
        let center = x.lerp(y, f64::from(i) / 100.0) + DVec3::Y * 0.05;
        let wide = Gaussian::new(1.4, 0.02, DVec3::ZERO, 1.5).unwrap();
        let narrow = Gaussian::new(1.4, 0.02, center, 0.1).unwrap();
        let field: Field = Sum::new(1.4, vec![wide.into(), narrow.into()])
            .unwrap()
            .into();
        let world = Unbounded(&field);
        let [found, truth] = [1e-4, EXACT].map(|tolerance| {
            let mut solver = Solver::new(Tolerance::new(tolerance));
            solver.connect(&world, x, (), y).unwrap()
        });
        let off = found.direction_out.distance(truth.direction_out);
        let jacobian = relative(found.jacobian, truth.jacobian);
        assert!(off < 1e-4 && jacobian < 3e-3, "{i}: {off:e} {jacobian:e}");
    }
}
