//! Regions of a grid in which the index is constant: rays are straight lines there, and take a step
//! or two.

use glam::{DAffine3, DQuat, DVec3};
use morgana_eikonal::field::{Affine, Bspline, Gaussian, Placement, Sum};
use morgana_eikonal::ray::{Flow, Node, Tangents, perpendicular_basis};
use morgana_eikonal::{Aabb, Field, Tolerance, Work};
use testkit::Rng;

/// A bump of radius 0.3, sampled in the cube of half-width 1, where the index is 1.3 elsewhere.
fn bump(center: DVec3, samples: [usize; 3]) -> Field {
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let index = |x: DVec3| {
        let inside = (1.0 - x.distance_squared(center) / 0.09).max(0.0);
        1.3 + 0.02 * inside.powi(4)
    };
    let grid = Bspline::from_fn(samples, cube, Placement::Nodes, index);
    grid.unwrap().into()
}

/// An equal field that does not report where it is constant.
fn unknown(field: &Field) -> Field {
    let nothing = Gaussian::new(1.3, 0.0, DVec3::ZERO, 1.0).unwrap();
    Sum::new(1.3, vec![field.clone(), nothing.into()])
        .unwrap()
        .into()
}

pub fn flow(field: &Field, (x, direction): (DVec3, DVec3), sigma: f64) -> (Node<Tangents>, Work) {
    let tangents = Tangents::angular(field.n(x), perpendicular_basis(direction));
    let node = Node::start(field, x, direction, tangents);
    let mut flow = Flow::new(field, node, Tolerance::new(1e-10));
    let mut work = Work::default();
    let mut left = sigma;
    while left > 1e-14 {
        left -= flow.advance(left, &mut work).arc.h();
    }
    (*flow.node(), work)
}

/// Draws a ray from one point of the cube to another.
fn ray(rng: &mut Rng) -> (DVec3, DVec3) {
    let mut point = || DVec3::from_array([0; 3].map(|_| rng.range(-0.95, 0.95)));
    let (from, to) = (point(), point());
    (from, to - from)
}

/// Rays agree with rays through a field that reports no constant regions. Cases are the bump in a
/// corner, where the reference index, at the middle, is the index of nearly all samples; the bump
/// in the middle, where it is not; a rotated field; and sizes that no block divides.
#[test]
fn rays_are_those_of_a_field_of_which_nothing_is_known() {
    let corner = bump(DVec3::splat(0.6), [65; 3]);
    let middle = bump(DVec3::ZERO, [90, 71, 66]);
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::X * 0.1);
    let turned = Affine::new(middle.clone(), turn).unwrap().into();
    let mut rng = Rng::new(1);
    for field in [corner, middle, turned] {
        let unknown = unknown(&field);
        let (mut fewer, mut bent) = (0, 0);
        for _ in 0..200 {
            let (from, way) = ray(&mut rng);
            let sigma = way.length() / field.n(from);
            let start = (from, way.normalize());
            let (a, work) = flow(&field, start, sigma);
            let (b, other) = flow(&unknown, start, sigma);
            assert!(a.x.distance(b.x) < 2e-8, "{} {}", a.x, b.x);
            let columns = |node: &Node<Tangents>| node.variation.dx;
            for (a, b) in columns(&a).into_iter().zip(columns(&b)) {
                // The limit for tangents is wider: steps are chosen for positions, but kinks of
                // second derivatives affect tangents.
                assert!(a.distance(b) < 1e-5, "{a} {b}");
            }
            fewer += usize::from(2 * work.evaluations < other.evaluations);
            bent += usize::from(work.evaluations > 0);
        }
        assert!(fewer > 80 && bent > 40, "{fewer} {bent}");
    }
}

/// Coefficients that count as equal differ by at most 2⁻⁴⁰ of 0.05, and gradients by this amount
/// over a spacing of 1/64.
#[test]
fn nothing_changes_where_nothing_is_said_to_change() {
    let mut rng = Rng::new(2);
    let mut homogeneous = 0;
    for center in [DVec3::splat(0.6), DVec3::ZERO, DVec3::new(-0.3, 0.5, 0.1)] {
        let field = bump(center, [129, 107, 131]);
        for _ in 0..3000 {
            let (from, way) = ray(&mut rng);
            let span = field.homogeneous_span(from, way);
            homogeneous += usize::from(span > 0.0);
            for i in 0..=40 {
                let x = from + way * (span * f64::from(i) / 40.0);
                let slope = field.gradient(x).1.length();
                assert!(span == 0.0 || slope < 1e-11, "{x}: {slope}");
            }
        }
    }
    assert!(homogeneous > 4000, "{homogeneous}");
}

/// From corner to corner, a ray takes one step for each cube of blocks in the constant region.
#[test]
fn what_does_not_change_is_crossed_in_a_few_steps() {
    let field = bump(DVec3::splat(0.6), [129; 3]);
    for (from, to) in [
        (
            DVec3::new(-0.99, -0.99, -0.99),
            DVec3::new(0.99, -0.9, -0.99),
        ),
        (DVec3::new(-0.9, 0.8, -0.8), DVec3::new(-0.7, -0.9, 0.9)),
    ] {
        let way: DVec3 = to - from;
        let start = (from, way.normalize());
        let (end, work) = flow(&field, start, way.length() / 1.3);
        assert!(end.x.distance(to) < 1e-12);
        assert_eq!((work.evaluations, work.rejected), (0, 0));
        assert!(work.steps <= 4, "{}", work.steps);
        let (_, other) = flow(&unknown(&field), start, way.length() / 1.3);
        assert!(other.steps >= 4 * work.steps, "{}", other.steps);
    }
}
