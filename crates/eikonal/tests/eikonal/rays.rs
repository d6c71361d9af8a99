//! Rays, compared with closed forms and with invariants that every ray must keep
//! (docs/theory.md#rays).

use glam::DVec3;
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Constant, Fisheye, Gaussian, LinearSquare, Luneburg, Selfoc,
};
use morgana_eikonal::ray::{Flow, Node, Step, StopCondition, Tangents, march, perpendicular_basis};
use morgana_eikonal::{Field, Tolerance, Work};
use std::f64::consts::PI;

const TIGHT_TOLERANCE: f64 = 1e-10;

fn gaussian() -> Field {
    Gaussian::new(1.33, 0.15, DVec3::ZERO, 0.25).unwrap().into()
}

fn acoustic() -> Field {
    let mode = AcousticMode::new(0.2, 1, 10.0, 0.3).unwrap();
    Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Y, vec![mode])
        .unwrap()
        .into()
}

fn start_node(field: &Field, x: DVec3, direction: DVec3) -> Node<Tangents> {
    let d = direction.normalize();
    let tangents = Tangents::angular(field.n(x), perpendicular_basis(d));
    Node::start(field, x, d, tangents)
}

/// Advances by `n` equal steps.
fn steps(field: &Field, mut node: Node<Tangents>, h: f64, n: usize) -> Node<Tangents> {
    for _ in 0..n {
        node = Step::new(field, &node, h).end;
    }
    node
}

/// Traces a ray over a span of σ with error control.
fn flow(field: &Field, node: Node<Tangents>, sigma: f64, tolerance: f64) -> Node<Tangents> {
    let mut flow = Flow::new(field, node, Tolerance::new(tolerance));
    let mut work = Work::default();
    let mut left = sigma;
    while left > 1e-14 {
        left -= flow.advance(left, &mut work).arc.h();
    }
    *flow.node()
}

#[test]
fn luneburg_focuses_a_parallel_beam_at_the_far_pole() {
    let field = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into();
    for impact in [0.0, 0.1, 0.4, 0.7, 0.95] {
        let x = DVec3::new(impact, 0.0, -(1.0f64 - impact * impact).sqrt());
        let node = start_node(&field, x, DVec3::Z);
        // x(σ) = x₀ cos σ + v₀ sin σ: after a quarter period the ray is at v₀.
        let end = flow(&field, node, PI / 2.0, TIGHT_TOLERANCE);
        let exact = node.v;
        assert!(
            end.x.distance(exact) < 1e-9,
            "impact {impact}: {}",
            end.x.distance(exact)
        );
        // Every ray passes the far pole.
        let far = march(
            &field,
            x,
            DVec3::Z,
            &StopCondition::ClosestApproach(DVec3::Z),
            4.0,
            Tolerance::new(TIGHT_TOLERANCE),
            |_, _| {},
        );
        assert!(
            far.x.distance(DVec3::Z) < 1e-9,
            "impact {impact}: {}",
            far.x
        );
    }
}

#[test]
fn a_linear_square_field_gives_exact_parabolas_in_one_step() {
    let slope = DVec3::new(0.1, -0.3, 0.2);
    let field: Field = LinearSquare::new(1.4, slope, DVec3::ZERO).unwrap().into();
    let node = start_node(
        &field,
        DVec3::new(0.1, 0.2, -0.1),
        DVec3::new(1.0, 0.5, 0.2),
    );
    let sigma = 0.8;
    let end = steps(&field, node, sigma, 1);
    let grad = field.gradient(DVec3::ZERO).1;
    let exact = node.x + node.v * sigma + grad * (0.25 * sigma * sigma);
    assert!(end.x.distance(exact) < 1e-14);
    assert!((end.v - (node.v + grad * (0.5 * sigma))).length() < 1e-14);
}

#[test]
fn selfoc_rays_return_after_one_pitch() {
    let (n0, alpha) = (1.5, 0.4f64.sqrt());
    let field: Field = Selfoc::new(n0, alpha, DVec3::ZERO, DVec3::Z)
        .unwrap()
        .into();
    let x = DVec3::new(0.6, 0.0, 0.0);
    let period = 2.0 * PI / (n0 * alpha);
    let end = flow(
        &field,
        start_node(&field, x, DVec3::Z),
        period,
        TIGHT_TOLERANCE,
    );
    assert!((end.x.x - 0.6).abs() < 1e-8 && end.x.y.abs() < 1e-12);
    // Reference: 9.191508 for a start at 0.6, in closed form n(x₀)·2π/√0.9.
    assert!((end.x.z - field.n(x) * period).abs() < 1e-8);
    assert!((end.x.z - 9.19150769315485).abs() < 1e-8);
}

#[test]
fn fisheye_rays_meet_at_the_conjugate_point() {
    let field: Field = Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into();
    let x = DVec3::new(0.3, -0.2, 0.4);
    let image = -x / x.length_squared();
    for k in 0..20 {
        let phi = k as f64 * 2.4;
        let z = (k as f64 - 9.5) / 10.0;
        let r = (1.0 - z * z).sqrt();
        let direction = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        let (mut optical, mut farthest) = (0.0, 0f64);
        let mut flow = Flow::new(
            &field,
            start_node(&field, x, direction),
            Tolerance::new(TIGHT_TOLERANCE),
        );
        let mut work = Work::default();
        let end = loop {
            let step = flow.advance(10.0, &mut work);
            let length = step.arc.optical_length(1.0);
            if optical + length >= PI {
                // ∫n² dσ is monotone in θ.
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..60 {
                    let mid = 0.5 * (low + high);
                    if optical + step.arc.optical_length(mid) < PI {
                        low = mid
                    } else {
                        high = mid
                    }
                }
                break step.at(low);
            }
            optical += length;
            farthest = farthest.max(step.end.x.length());
        };
        // Rays are circles no wider than 1 + r. Their error is TIGHT_TOLERANCE per unit length.
        // Some rays pass distant points where n is small, from which errors grow by up to 1 + r².
        let allowed = TIGHT_TOLERANCE * PI * (1.0 + farthest) * (1.0 + farthest * farthest);
        assert!(
            end.0.distance(image) < allowed,
            "{k}: {} {farthest}",
            end.0.distance(image)
        );
        // The conjugate point is a caustic: J vanishes.
        assert!(end.2.cross_section(end.1).abs() < 1e3 * allowed);
    }
}

#[test]
fn the_scheme_converges_at_fourth_order() {
    for field in [gaussian(), acoustic()] {
        let node = start_node(
            &field,
            DVec3::new(-0.5, 0.1, 0.07),
            DVec3::new(1.0, 0.05, 0.0),
        );
        let exact = steps(&field, node, 0.7 / 4096.0, 4096);
        let (sizes, errors): (Vec<f64>, Vec<f64>) = [16usize, 24, 32, 48]
            .iter()
            .map(|&n| {
                let h = 0.7 / n as f64;
                (h, steps(&field, node, h, n).x.distance(exact.x))
            })
            .unzip();
        let order = testkit::fit_order(&sizes, &errors).order;
        assert!(
            (3.7..4.8).contains(&order),
            "order {order}, errors {errors:?}"
        );
    }
}

#[test]
fn the_error_control_keeps_the_tolerance() {
    // Position error per unit length, times the growth of the tangents along the ray. It is within
    // a factor of ten of the tolerance, and scales with it.
    for field in [gaussian(), acoustic()] {
        let node = start_node(
            &field,
            DVec3::new(-0.5, 0.1, 0.07),
            DVec3::new(1.0, 0.05, 0.0),
        );
        let exact = steps(&field, node, 0.7 / 4096.0, 4096);
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let error = flow(&field, node, 0.7, tolerance).x.distance(exact.x);
            assert!(error < 10.0 * tolerance, "{error} at {tolerance}");
        }
    }
}

#[test]
fn steps_are_reversible() {
    let field = gaussian();
    let start = start_node(
        &field,
        DVec3::new(-0.5, 0.1, 0.07),
        DVec3::new(1.0, 0.05, 0.0),
    );
    let mut end = steps(&field, start, 0.07, 10);
    end.v = -end.v;
    let back = steps(&field, end, 0.07, 10);
    assert!(back.x.distance(start.x) < 1e-13);
    assert!((back.v + start.v).length() < 1e-13);
}

#[test]
fn tangents_are_the_derivative_of_the_discrete_map() {
    for field in [gaussian(), acoustic()] {
        let x = DVec3::new(-0.5, 0.1, 0.07);
        let direction = DVec3::new(1.0, 0.05, 0.0).normalize();
        let basis = perpendicular_basis(direction);
        let end = steps(&field, start_node(&field, x, direction), 0.11, 7);
        let eps = 1e-5;
        for (k, t) in basis.into_iter().enumerate() {
            let shot = |sign: f64| {
                let mut node = start_node(&field, x, direction);
                node.v = (direction + t * (sign * eps)) * field.n(x);
                steps(&field, node, 0.11, 7)
            };
            let (plus, minus) = (shot(1.0), shot(-1.0));
            let dx = (plus.x - minus.x) / (2.0 * eps);
            let dv = (plus.v - minus.v) / (2.0 * eps);
            assert!(dx.distance(end.variation.dx[k]) < 1e-8);
            assert!(dv.distance(end.variation.dv[k]) < 1e-8);
        }
    }
}

#[test]
fn the_tangent_map_is_symplectic() {
    let field = acoustic();
    let x = DVec3::new(-0.5, 0.3, 0.2);
    let start = start_node(&field, x, DVec3::new(1.0, 0.2, -0.3));
    let mut with_positions = start;
    with_positions.variation.dx = [DVec3::new(0.2, -0.1, 0.5), DVec3::new(0.4, 0.3, 0.1)];
    let form = |t: &Tangents| t.dx[0].dot(t.dv[1]) - t.dx[1].dot(t.dv[0]);
    let before = form(&with_positions.variation);
    let after = form(&steps(&field, with_positions, 0.1, 12).variation);
    assert!((before - after).abs() < 1e-13, "{before} {after}");
}

#[test]
fn the_index_is_kept_as_the_length_of_the_velocity() {
    let field = gaussian();
    let node = start_node(&field, DVec3::new(-1.0, 0.1, 0.0), DVec3::X);
    let end = flow(&field, node, 1.5, 1e-8);
    assert!((end.v.length() - field.n(end.x)).abs() < 1e-7);
}

#[test]
fn the_ray_tube_is_reciprocal() {
    // J(x→y)/n(x)² = J(y→x)/n(y)², docs/theory.md#tangents.
    for field in [gaussian(), acoustic()] {
        let start = start_node(
            &field,
            DVec3::new(-0.6, 0.12, 0.07),
            DVec3::new(1.0, -0.1, 0.05),
        );
        let end = flow(&field, start, 0.9, TIGHT_TOLERANCE);
        let forward = end.variation.cross_section(end.v).abs() / start.n2;
        let back = flow(
            &field,
            start_node(&field, end.x, -end.v),
            0.9,
            TIGHT_TOLERANCE,
        );
        let backward = back.variation.cross_section(back.v).abs() / end.n2;
        assert!(
            (forward / backward - 1.0).abs() < 1e-8,
            "{forward} {backward}"
        );
    }
}

#[test]
fn a_constant_field_costs_one_straight_step() {
    let field: Field = morgana_eikonal::field::Constant::new(1.33).into();
    let mut work = Work::default();
    let node = start_node(&field, DVec3::ZERO, DVec3::X);
    let step = Flow::new(&field, node, Tolerance::default()).advance(10.0, &mut work);
    assert!(step.arc.is_straight());
    assert_eq!((work.steps, work.evaluations), (1, 0));
    assert!((step.end.x.x - 13.3).abs() < 1e-12);
}

/// A march through an invalid index, which no scene has checked, does not report that it stopped
/// where it should.
#[test]
fn there_are_no_rays_where_the_index_is_none() {
    let stop = StopCondition::ArcLength(1.0);
    for n in [-1.5, 0.0, f64::NAN, f64::INFINITY] {
        let field: Field = Constant::new(n).into();
        let tolerance = Tolerance::default();
        let end = march(
            &field,
            DVec3::ZERO,
            DVec3::X,
            &stop,
            50.0,
            tolerance,
            |_, _| {},
        );
        assert!(
            !end.stopped && !end.v.is_finite() || !end.x.is_finite(),
            "{n}: {end:?}"
        );
    }
}

#[test]
fn marches_stop_where_they_should() {
    let field = gaussian();
    let (x, direction) = (DVec3::new(-1.0, 0.05, 0.0), DVec3::X);
    let tolerance = Tolerance::new(1e-9);
    let run = |stop: &StopCondition| march(&field, x, direction, stop, 50.0, tolerance, |_, _| {});

    let by_length = run(&StopCondition::ArcLength(1.7));
    assert!(by_length.stopped && (by_length.arc_length - 1.7).abs() < 1e-12);

    // τ = ∫(1 + x²) ds along the ray, inverted: the length reached reproduces the depth.
    let extinction = |x: DVec3| 1.0 + x.x * x.x;
    let by_depth = run(&StopCondition::OpticalDepth {
        depth: 1.1,
        extinction: &extinction,
        spacing: 0.01,
    });
    let mut depth = 0.0;
    march(
        &field,
        x,
        direction,
        &StopCondition::ArcLength(by_depth.arc_length),
        50.0,
        tolerance,
        |step, end| {
            let profile = morgana_eikonal::ray::Profile::new(&step.arc, [0.0, end], 1e-3, |x| {
                [extinction(x)]
            });
            depth += profile.total()[0];
        },
    );
    assert!((depth - 1.1).abs() < 1e-6, "{depth}");

    // Find a plane on the arc.
    let plane = |arc: &morgana_eikonal::ray::Arc| {
        let (a, b) = (arc.start().x - 0.3, arc.end().x - 0.3);
        (a < 0.0 && b >= 0.0).then(|| {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let mid = 0.5 * (low + high);
                if arc.position(mid).x < 0.3 {
                    low = mid
                } else {
                    high = mid
                }
            }
            high
        })
    };
    let by_surface = run(&StopCondition::Surface(&plane));
    assert!((by_surface.x.x - 0.3).abs() < 1e-12);

    let y = DVec3::new(0.5, 0.2, 0.1);
    let nearest = run(&StopCondition::ClosestApproach(y));
    assert!((nearest.x - y).dot(nearest.v).abs() < 1e-9);

    // The plane is out of range, so the limit ends the march.
    let limited = march(
        &field,
        x,
        direction,
        &StopCondition::ArcLength(9.0),
        2.0,
        tolerance,
        |_, _| {},
    );
    assert!(!limited.stopped && (limited.arc_length - 2.0).abs() < 1e-12);
}

/// A closest approach is never the start itself: rays come back to their start in a fisheye, and
/// never where the index is constant.
#[test]
fn closest_approaches_are_not_the_start() {
    let tolerance = Tolerance::new(1e-9);
    let nearest = |field: &Field, y: DVec3, direction: DVec3| {
        let stop = StopCondition::ClosestApproach(y);
        march(
            field,
            DVec3::X,
            direction,
            &stop,
            20.0,
            tolerance,
            |_, _| {},
        )
    };
    let air = Constant::new(1.0).into();
    for y in [DVec3::ZERO, DVec3::X] {
        let end = nearest(&air, y, DVec3::X);
        assert!(!end.stopped && (end.arc_length - 20.0).abs() < 1e-12, "{y}");
    }
    assert!(nearest(&air, DVec3::X * 3.0, DVec3::X).stopped);
    // On a circle of radius 1, the ray is nearest to the point after a full turn, or just before
    // it.
    let fisheye = Fisheye::new(1.5, DVec3::ZERO, 1.0).unwrap().into();
    for turned in [1.9 * PI, 2.0 * PI] {
        let y = DVec3::new(turned.cos(), turned.sin(), 0.0);
        let end = nearest(&fisheye, y, DVec3::Y);
        assert!(
            end.stopped && (end.arc_length - turned).abs() < 1e-6,
            "{end:?}"
        );
    }
}

/// A march does not stop at an optical depth if the extinction is not a number.
#[test]
fn depths_that_are_not_a_number_stop_no_ray() {
    for depth in [0.5, f64::NAN] {
        let extinction = |x: DVec3| if x.x < 1.0 { 0.1 } else { f64::NAN };
        let stop = StopCondition::OpticalDepth {
            depth,
            extinction: &extinction,
            spacing: 0.01,
        };
        let field = Constant::new(1.0).into();
        let tolerance = Tolerance::default();
        let end = march(
            &field,
            DVec3::ZERO,
            DVec3::X,
            &stop,
            5.0,
            tolerance,
            |_, _| {},
        );
        assert!(
            !end.stopped && (end.arc_length - 5.0).abs() < 1e-12,
            "{end:?}"
        );
    }
}

/// Marches end for invalid limits, directions of any length, and events that never occur.
#[test]
fn marches_end() {
    let tolerance = Tolerance::default();
    let x = DVec3::new(-1.0, 0.05, 0.0);
    for field in [gaussian(), Constant::new(1.2).into()] {
        let go = |limit: f64, direction: DVec3| {
            let stop = StopCondition::ArcLength(2.0);
            march(&field, x, direction, &stop, limit, tolerance, |_, _| {})
        };
        for limit in [0.0, -1.0, f64::NAN] {
            let found = go(limit, DVec3::X);
            assert_eq!((found.x, found.arc_length, found.stopped), (x, 0.0, false));
        }
        let expected = go(10.0, DVec3::X);
        assert!(expected.stopped);
        let cases = [
            (f64::INFINITY, 1.0),
            (1e300, 1.0),
            (10.0, 7.0),
            (10.0, 1e200),
            (10.0, 1e-200),
        ];
        for (limit, direction) in cases {
            let found = go(limit, DVec3::X * direction);
            assert!(found.stopped && (found.x - expected.x).length() < 1e-6);
            assert!((found.optical_length - expected.optical_length).abs() < 1e-6);
        }
        assert!(!go(10.0, DVec3::ZERO).stopped);
    }
    // A ray that circles in a fisheye never reaches a surface.
    let fisheye = Fisheye::new(1.5, DVec3::ZERO, 1.0).unwrap().into();
    let never = StopCondition::Surface(&|_| None);
    let found = march(
        &fisheye,
        DVec3::X,
        DVec3::Y,
        &never,
        f64::INFINITY,
        tolerance,
        |_, _| {},
    );
    assert!(!found.stopped && found.x.is_finite());
}
