//! Error of each quantity of a ray at a tolerance: checks the table in
//! docs/theory.md#error-control.
//!
//! Rays of 1.8 scene units through fields of all strengths are compared with rays at a tolerance of
//! 1e-12.

use crate::common::Random;
use glam::DVec3;
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Bspline, Coordinate, Field, Fisheye, Gaussian, IndexProfile, Luneburg,
    Placement, Sum,
};
use morgana_eikonal::ray::{Flow, Node, ShortRay, Tangents, perpendicular_basis};
use morgana_eikonal::{Aabb, PathDifference, Reference, Tolerance, Work};

const LENGTH: f64 = 1.8;
const N_REF: f64 = 1.3;

struct End {
    x: DVec3,
    direction: DVec3,
    optical_length: f64,
    difference: f64,
    jacobian: f64,
}

fn follow(field: &Field, ray: (DVec3, DVec3), tolerance: f64) -> End {
    follow_for(field, ray, LENGTH, tolerance)
}

fn follow_for(field: &Field, (x, d): (DVec3, DVec3), whole: f64, tolerance: f64) -> End {
    let tangents = Tangents::angular(field.n(x), perpendicular_basis(d));
    let node = Node::start(field, x, d, tangents);
    let mut flow = Flow::new(field, node, Tolerance::new(tolerance));
    let (mut work, mut length, mut optical_length) = (Work::default(), 0.0, 0.0);
    let mut difference = PathDifference::new(Reference::Index(N_REF), d);
    loop {
        let step = flow.advance(1.0, &mut work);
        let theta = step.arc.theta_at_length(whole - length);
        difference.add(field, &step.arc, [0.0, theta], &mut work);
        length += step.arc.arc_length(theta);
        optical_length += step.arc.optical_length(theta);
        if theta < 1.0 {
            let (x, v, tangents) = step.at(theta);
            let direction = v.normalize();
            return End {
                x,
                direction,
                optical_length,
                difference: difference.so_far().unwrap(),
                jacobian: tangents.cross_section(v).abs(),
            };
        }
    }
}

fn gaussian(delta: f64) -> Field {
    Gaussian::new(N_REF, delta, DVec3::new(0.1, 0.0, 0.2), 0.3)
        .unwrap()
        .into()
}

/// Two sound waves about an axis, of 3 and 4 wavelengths per unit.
fn sound(delta: f64, axis: DVec3) -> Field {
    let modes = [(0, 25.0), (2, 20.0)].map(|(order, k)| {
        let share = if order == 0 { 0.7 } else { 0.3 };
        AcousticMode::new(share * delta, order, k, 0.4).unwrap()
    });
    let center = DVec3::new(0.1, 0.05, 0.0);
    Acoustic::new(N_REF, center, axis, DVec3::ONE, modes.to_vec())
        .unwrap()
        .into()
}

/// Samples so close along z that rounding hides their fourth differences.
fn fine_grid() -> Field {
    let bounds = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let index = |x: DVec3| N_REF + 0.05 * (6.0 * x.z).cos() * (2.0 * x.x + x.y).sin();
    let grid = Bspline::from_fn([33, 33, 385], bounds, Placement::Nodes, index);
    grid.unwrap().into()
}

/// Fields, each with the largest contrast along the rays.
fn fields() -> Vec<(Field, f64)> {
    let bump = |at: DVec3| Gaussian::new(N_REF, 0.05, at, 0.15).unwrap().into();
    let places = [0.0_f64, 0.3, 0.6, 0.9].map(|z| bump(DVec3::new(0.2 * (7.0 * z).sin(), 0.1, z)));
    let bounds = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let grid = |delta: f64| {
        let field = gaussian(delta);
        let grid = Bspline::from_fn([64; 3], bounds, Placement::Nodes, |x| field.n(x));
        Field::from(grid.unwrap())
    };
    vec![
        (Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(), 0.3),
        (Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into(), 0.7),
        (Sum::new(N_REF, places.to_vec()).unwrap().into(), 0.05),
        (gaussian(0.1), 0.1),
        (gaussian(1e-3), 1e-3),
        (gaussian(1e-6), 1e-6),
        (grid(0.1), 0.1),
        (grid(1e-3), 1e-3),
        (grid(1e-6), 1e-6),
        (fine_grid(), 0.05),
        (sound(0.02, DVec3::Z), 0.02),
        (sound(0.02, DVec3::X), 0.02),
        (sound(1e-3, DVec3::Z), 1e-3),
        (sound(1e-3, DVec3::new(0.5, 0.0, 1.0)), 1e-3),
        (sound(1e-5, DVec3::Z), 1e-5),
    ]
}

/// Splines whose samples change strongly from one to the next: a table of 13 samples along z, and
/// turbulence of 30³ samples.
fn rough_fields() -> Vec<(Field, f64)> {
    let index = |z: f64| 1.35 + 0.02 * (1.3 * z).sin() + 0.01 * z;
    let table = (0..13).map(|i| 0.5 * f64::from(i) - 3.0);
    let table: Vec<[f64; 2]> = table.map(|z| [z, index(z)]).collect();
    let table = IndexProfile::table(Coordinate::Z, 0.0, &table).unwrap();
    let bounds = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let mut random = Random(30);
    let grid = Bspline::from_fn([30; 3], bounds, Placement::Nodes, |_| {
        N_REF + 5e-3 * random.between(-1.0, 1.0)
    });
    vec![(table.into(), 0.1), (grid.unwrap().into(), 0.01)]
}

/// Starts and directions of eight rays, mostly along z.
fn along_z() -> Vec<[DVec3; 2]> {
    let ray = |i| {
        let t = f64::from(i);
        let start = DVec3::new(0.3 * (2.0 * t).sin(), 0.3 * t.cos(), -0.85);
        let toward = DVec3::new(0.2 * (3.0 * t).cos(), 0.1 * t.sin(), 1.0);
        [start, toward.normalize()]
    };
    (0..8).map(ray).collect()
}

/// Starts and directions of rays on all sides of the origin.
fn everywhere() -> Vec<[DVec3; 2]> {
    let mut random = Random(1);
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    let mut ray = || [0.8 * random.point(&cube), random.point(&cube).normalize()];
    (0..200).map(|_| ray()).collect()
}

/// Returns the largest errors of position, direction, optical length, path difference and J at each
/// tolerance, in fields that are given with their largest contrasts.
fn errors<const N: usize>(
    fields: &[(Field, f64)],
    rays: &[[DVec3; 2]],
    tolerances: [f64; N],
) -> [[f64; 5]; N] {
    let mut most = [[0.0f64; 5]; N];
    for (field, contrast) in fields {
        for &[start, toward] in rays {
            let exact = follow(field, (start, toward), 1e-12);
            for (most, tolerance) in most.iter_mut().zip(tolerances) {
                let found = follow(field, (start, toward), tolerance);
                // Correct the path difference for the displaced end, along which the optical length is
                // not stationary.
                let chord = (exact.x - start).normalize();
                let turned = field.n(exact.x) * exact.direction - N_REF * chord;
                let moved = (found.x - exact.x).dot(turned);
                let errors = [
                    found.x.distance(exact.x) / LENGTH,
                    found.direction.distance(exact.direction),
                    (found.optical_length - exact.optical_length).abs() / LENGTH,
                    (found.difference - exact.difference - moved).abs() / (contrast * LENGTH),
                    (found.jacobian - exact.jacobian).abs() / exact.jacobian.max(LENGTH * LENGTH),
                ];
                for (most, error) in most.iter_mut().zip(errors) {
                    *most = most.max(error);
                }
            }
        }
    }
    most
}

/// Tolerances, and the errors of position, direction, optical length, path difference and J that
/// the manual states.
const MANUAL: [(f64, [f64; 5]); 3] = [
    (1e-4, [1e-4, 3e-4, 5e-4, 5e-6, 3e-4]),
    (1e-6, [1e-6, 1e-6, 1e-6, 1e-7, 1e-5]),
    (1e-8, [1e-8, 5e-8, 1e-7, 1e-7, 3e-6]),
];

/// Tolerances, and the errors that the manual states for splines of rough samples; it states none
/// for the Jacobian.
const ROUGH: [(f64, [f64; 4]); 2] = [
    (1e-6, [5e-6, 1e-5, 2e-5, 1e-7]),
    (1e-8, [2e-7, 3e-7, 5e-7, 1e-7]),
];

#[test]
fn quantities_are_as_good_as_the_manual_says() {
    let fields = fields();
    let found = errors(&fields, &along_z(), MANUAL.map(|(tolerance, _)| tolerance));
    for (found, (_, manual)) in found.into_iter().zip(MANUAL) {
        assert_below(found, &manual);
    }
}

#[test]
fn rough_samples_cost_what_the_manual_says() {
    let fields = rough_fields();
    // In any direction rays stay within the table; along z they stay within the grid.
    for (field, rays) in fields.chunks(1).zip([everywhere(), along_z()]) {
        let found = errors(field, &rays, ROUGH.map(|(tolerance, _)| tolerance));
        for (found, (tolerance, manual)) in found.into_iter().zip(ROUGH) {
            println!("{tolerance:e}: {found:?}");
            assert_below(found, &manual);
        }
    }
}

/// Follows a ray for a length by at most eight short steps. Returns its end and its optical length.
fn follow_shortly(
    field: &Field,
    mut ray: ShortRay,
    length: f64,
    tolerance: Tolerance,
) -> Option<(Node<()>, f64)> {
    let (mut left, mut optical_length) = (length, 0.0);
    for _ in 0..8 {
        let step = ray.advance(field, left, tolerance, &mut Work::default())?;
        let [gone, optical] = step.lengths.map(|l| l.at(step.theta_end));
        optical_length += optical;
        left -= gone;
        if step.is_last {
            return Some((ray.node, optical_length));
        }
    }
    None
}

/// Flights of a few short steps, one after the other along rays. The errors of position, direction
/// and optical length are those that the manual states for longer steps.
#[test]
fn short_steps_are_as_good_as_the_manual_says() {
    let mut random = Random(8);
    for (tolerance, manual) in MANUAL {
        let (mut most, mut flights, mut others) = ([0.0f64; 3], 0, 0);
        for (field, _) in fields() {
            for [start, toward] in along_z() {
                let mut ray = ShortRay::new(&field, start, toward);
                while ray.node.x.z < 0.9 {
                    let length = 0.2 * -random.between(0.0, 1.0).ln();
                    let from = (ray.node.x, ray.node.v.normalize());
                    let exact = follow_for(&field, from, length, 1e-12);
                    let found = follow_shortly(&field, ray, length, Tolerance::new(tolerance));
                    ray = ShortRay::new(&field, exact.x, exact.direction);
                    let Some((end, optical_length)) = found else {
                        others += 1;
                        continue;
                    };
                    flights += 1;
                    let errors = [
                        end.x.distance(exact.x) / length,
                        end.v.normalize().distance(exact.direction),
                        (optical_length - exact.optical_length).abs() / length,
                    ];
                    most = std::array::from_fn(|i| errors[i].max(most[i]));
                    // The values at the end are those of the field.
                    let there = Node::start(&field, end.x, toward, ());
                    let [n2, a] = [(end.n2 - there.n2).abs(), end.a.distance(there.a)];
                    assert!(n2 < 0.1 * tolerance && a < 1e2 * tolerance, "{n2} {a}");
                }
            }
        }
        println!("{tolerance:e}: {most:?}, {flights} flights, {others} are longer");
        let good = most.iter().zip(manual).all(|(found, most)| *found < most);
        assert!(good && flights > 300, "{tolerance:e}: {most:?} {manual:?}");
    }
}

fn assert_below(found: [f64; 5], stated: &[f64]) {
    let good = found.iter().zip(stated).all(|(found, most)| found < most);
    assert!(good, "{found:?} {stated:?}");
}
