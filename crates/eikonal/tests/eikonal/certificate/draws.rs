//! Random media and pairs of points: no certified pair has a second ray, and the search detects
//! second rays where they exist.
//!
//! The search is lighter than [`Solver::all`]: Newton's method from 100 directions all over the cap
//! in which rays that stay inside can start. `MORGANA_LONG_TESTS=1` draws 10 800 pairs instead of
//! 432.

use crate::certificate::families::{KINDS, at_criterion, point};
use crate::certificate::in_ball;
use crate::certificate::search::{all_rays, cap};
use glam::DVec3;
use morgana_eikonal::connect::{Reach, Unbounded};
use morgana_eikonal::field::Selfoc;
use morgana_eikonal::{Field, Solver, Tolerance};
use std::f64::consts::PI;
use testkit::Rng;

/// Starts of the search, per pair.
const STARTS: usize = 100;
/// Pairs per medium.
const PAIRS: usize = 12;

fn families() -> usize {
    if std::env::var_os("MORGANA_LONG_TESTS").is_some() {
        150
    } else {
        6
    }
}

fn inside(p: DVec3) -> bool {
    p.length() < 1.0
}

/// Two points far apart on opposite sides of the ball, where second rays would be.
fn across(rng: &mut Rng) -> [DVec3; 2] {
    let x = DVec3::from_array(rng.direction());
    let y = (point(rng, 0.7) - x).normalize();
    [x, y].map(|p| p * rng.range(0.7, 1.0))
}

#[test]
fn certified_media_have_one_ray_between_any_two_points() {
    let mut rng = Rng::new(31);
    let (mut connected, mut pairs, mut near) = (0, 0, 0);
    for (name, make) in KINDS {
        for _ in 0..families() {
            let family = make(&mut rng);
            let (strength, certificate) = at_criterion(&family, rng.range(0.82, 1.0));
            near += usize::from(certificate.criterion() > 0.8);
            assert!(certificate.whole_medium() && strength > 1e-3, "{name}");
            let field = family(strength);
            for _ in 0..PAIRS {
                let ends = across(&mut rng);
                let cap = cap(&certificate, ends[0].distance(ends[1]));
                let rays = all_rays(&field, ends, (STARTS, cap), inside);
                assert!(rays.len() <= 1, "{field:?} {ends:?} {rays:?}");
                pairs += 1;
                connected += rays.len();
            }
        }
    }
    // For some families certification ends at κD = 2 before the criterion reaches its target.
    assert!(near * PAIRS * 10 > pairs * 9, "{near}");
    // A few rays leave the ball between their ends.
    assert!(connected * 20 >= pairs * 17, "{connected} of {pairs}");
}

#[test]
fn certified_pairs_have_one_ray() {
    let mut rng = Rng::new(32);
    let mut certified = [0; 2];
    for (_, make) in KINDS {
        for _ in 0..families() {
            let family = make(&mut rng);
            let field = family(1.5 * at_criterion(&family, 1.0).0);
            let certificate = in_ball(&field, 1.0);
            assert!(!certificate.whole_medium());
            for _ in 0..PAIRS {
                let ends = [point(&mut rng, 1.0), point(&mut rng, 1.0)];
                let pair = certificate.pair(&field, ends[0], ends[1]);
                assert_eq!(pair, certificate.pair(&field, ends[1], ends[0]));
                certified[usize::from(pair)] += 1;
                if !pair {
                    continue;
                }
                let cap = cap(&certificate, ends[0].distance(ends[1]));
                let rays = all_rays(&field, ends, (STARTS, cap), inside);
                assert!(rays.len() <= 1, "{field:?} {ends:?} {rays:?}");
            }
        }
    }
    // Certificates of pairs cover much that the certificate of the whole medium does not.
    assert!(certified[1] > certified[0], "{certified:?}");
}

/// Returns the number of rays that stay inside, by the dense search.
fn dense(field: &Field, [x, y]: [DVec3; 2]) -> usize {
    let world = Unbounded(field);
    let mut solver = Solver::new(Tolerance::new(1e-7));
    let reach = Reach {
        optical_length: 2.0 * x.distance(y) * field.n(DVec3::ZERO),
        reflections: 0,
        bounces: 0,
    };
    let mut count = 0;
    for (start, _) in solver.all(&world, x, (), y, &reach).branches {
        solver.solve(&world, &start, y).unwrap();
        let mut points = solver.pieces().iter().map(|p| p.arc.position(p.theta_end));
        count += usize::from(points.all(|p| inside(p) || p.distance(y) < 1e-6));
    }
    count
}

#[test]
fn second_rays_are_seen_from_where_they_begin() {
    // In a rod, a ray that crosses the axis at the angle θ crosses it again after π cos θ/α, and
    // stays within sin θ/α of it. In the unit ball around the middle of the rod, two points of the
    // axis at distance d thus have second rays if α ≥ 1/√(1 + (d/π)²).
    for d in [1.0, 1.5, 1.94] {
        let onset = 1.0 / (1.0 + (d / PI).powi(2)).sqrt();
        let rod = |alpha: f64| -> Field {
            Selfoc::new(1.5, alpha, DVec3::ZERO, DVec3::Z)
                .unwrap()
                .into()
        };
        // Leave the axis slightly: exactly on it the second rays form a cone.
        let off = DVec3::new(3e-3, 1e-3, 0.0);
        let ends = [off - DVec3::Z * (0.5 * d), DVec3::Z * (0.5 * d)];
        let count = |alpha: f64| {
            let light = all_rays(&rod(alpha), ends, (STARTS, 1.4), inside).len();
            (light, dense(&rod(alpha), ends))
        };
        assert_eq!(count(0.97 * onset), (1, 1), "{d}");
        let (light, dense) = count(1.03 * onset);
        assert!(light >= 2 && dense == 3, "{d}: {light} {dense}");
        let pair = |alpha: f64| in_ball(&rod(alpha), 1.0).pair(&rod(alpha), ends[0], ends[1]);
        assert!(pair(0.3 * onset) && !pair(onset), "{d}");
    }
}
