//! Intersections of lines and arcs with analytic shapes.

use crate::shape::support::{KINDS, Kind, Rng, all_hits, brute_force, bumpy};
use eikonal::ray::Arc;
use eikonal::ray::bernstein::split;
use glam::{DAffine3, DVec3};
use morgana_transport::shape::{Shape, Sphere};

/// Asserts that the first hit is as early as the one found by sampling, or is an earlier true
/// crossing that sampling stepped over.
fn check(kind: Kind, m: DAffine3, arc: &Arc) -> bool {
    let to_local = m.inverse();
    let local = |t: f64| to_local.transform_point3(arc.position(t));
    let hit = kind.shape(m).first_hit(arc, 0.0, 1.0);
    let expected = brute_force(kind, &to_local, arc);
    if let Some(t) = expected {
        let close = kind.margin(local(t)) < 1e-9;
        let found = hit.map_or(f64::INFINITY, |h| h.theta);
        assert!(close || found <= t + 1e-10, "{kind:?}: {found} after {t}");
    }
    if let Some(h) = hit {
        assert!(kind.implicit(local(h.theta)).abs() < 1e-10);
        assert!(kind.margin(local(h.theta)) > -1e-10);
        assert!(h.position.distance(arc.position(h.theta)) < 1e-10);
        let residual = kind.implicit(to_local.transform_point3(h.position));
        assert!(residual.abs() < 1e-14, "{kind:?} {residual:e}");
        if expected.is_none_or(|t| h.theta < t - 1e-10) {
            let f = |d: f64| kind.implicit(local(h.theta + d));
            assert!(f(2e-4).min(f(-2e-4)).abs() < 1e-2, "{kind:?}: no grazing");
        }
    }
    hit.is_some()
}

#[test]
fn lines_match_brute_force() {
    let mut rng = Rng(1);
    for kind in KINDS {
        let hits = (0..300).filter(|_| {
            let (m, line) = (rng.affine(), rng.line());
            check(kind, m, &line)
        });
        let hits = hits.count();
        assert!(hits > 20, "{kind:?} {hits}");
    }
}

#[test]
fn arcs_match_brute_force() {
    let mut rng = Rng(2);
    for kind in KINDS {
        let hits = (0..200).filter(|_| {
            let (m, arc) = (rng.affine(), rng.arc());
            check(kind, m, &arc)
        });
        let hits = hits.count();
        assert!(hits > 20, "{kind:?} {hits}");
    }
}

#[test]
fn a_line_as_an_arc_hits_at_the_same_parameter() {
    let mut rng = Rng(3);
    for kind in KINDS {
        for _ in 0..1000 {
            let shape = kind.shape(rng.affine());
            let (x, v) = (rng.vector(2.0), rng.vector(4.0));
            let end = [x + v, v, DVec3::ZERO];
            let arc = Arc::hermite([x, v, DVec3::ZERO], end, 1.0);
            let straight = all_hits(&shape, &Arc::line(x, v, 1.0));
            let curved = all_hits(&shape, &arc);
            assert_eq!(straight.len(), curved.len(), "{kind:?}");
            for (a, b) in straight.iter().zip(&curved) {
                // A grazing crossing is ill-conditioned.
                let slant = shape
                    .first_hit(&arc, b - 1e-6, 1.0)
                    .unwrap()
                    .normal
                    .dot(v)
                    .abs();
                assert!((a - b).abs() * slant.min(1.0) < 1e-12, "{kind:?} {a} {b}");
            }
        }
    }
}

/// The parity of the number of crossings tells whether both ends are on one side. No hit is lost or
/// counted twice, whether an arc is searched whole or in parts.
#[test]
fn crossings_have_the_right_parity() {
    let mut rng = Rng(4);
    for kind in [Kind::Sphere, Kind::Cube, Kind::Can] {
        for i in 0..3000 {
            let shape = kind.shape(rng.affine());
            let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
            let hits = all_hits(&shape, &arc);
            let sides = shape.contains(arc.start()) != shape.contains(arc.end());
            assert_eq!(hits.len() % 2 == 1, sides, "{kind:?} {hits:?}");
        }
    }
}

/// Parts of a curve, as arcs that share exactly one point.
fn cut(arc: &Arc, t: f64) -> [Arc; 2] {
    let (a, b) = split(&arc.control(), t);
    [a, b].map(|c| {
        let first = [c[0], (c[1] - c[0]) * 5.0, (c[2] - c[1] * 2.0 + c[0]) * 20.0];
        let last = [c[5], (c[5] - c[4]) * 5.0, (c[3] - c[4] * 2.0 + c[5]) * 20.0];
        Arc::hermite(first, last, 1.0)
    })
}

#[test]
fn cutting_an_arc_at_a_hit_neither_loses_nor_repeats_it() {
    let mut rng = Rng(5);
    let mesh: Shape = bumpy(2).into();
    for i in 0..3000 {
        let kind = KINDS[i % 6];
        let shape = if i % 7 == 0 {
            mesh.clone()
        } else {
            kind.shape(rng.affine())
        };
        let arc = rng.arc();
        let whole = all_hits(&shape, &arc);
        for t in &whole {
            let [a, b] = cut(&arc, *t);
            let parts = all_hits(&shape, &a).len() + all_hits(&shape, &b).len();
            assert_eq!(parts, whole.len(), "{kind:?} cut at {t}");
        }
    }
}

#[test]
fn an_arc_that_pokes_through_is_found_although_its_chord_misses() {
    // A parabola with its apex at height `apex`, over a chord well outside the surface at z = 1.
    let bow = |apex: f64| {
        let (base, bend) = (1.5, -8.0 * (1.5 - apex));
        let v = DVec3::new(1.0, 0.0, 0.5 * bend);
        let a = DVec3::new(0.0, 0.0, -bend);
        let x = DVec3::new(-0.5, 0.01, base);
        Arc::hermite([x, v, a], [x + DVec3::X, v.with_z(-v.z), a], 1.0)
    };
    for shape in [
        Kind::Cube.shape(DAffine3::IDENTITY),
        Kind::Can.shape(DAffine3::IDENTITY),
        Kind::Sphere.shape(DAffine3::IDENTITY),
    ] {
        let chord = Arc::line(bow(0.0).start(), DVec3::X, 1.0);
        assert!(shape.first_hit(&chord, 0.0, 1.0).is_none());
        assert_eq!(all_hits(&shape, &bow(0.99)).len(), 2);
        assert_eq!(all_hits(&shape, &bow(0.999_9)).len(), 2);
        assert_eq!(all_hits(&shape, &bow(1.000_1)).len(), 0);
    }
    assert!((bow(0.9).position(0.5).z - 0.9).abs() < 1e-14);
}

#[test]
fn very_long_segments_stay_exact() {
    let mut rng = Rng(6);
    for _ in 0..5000 {
        let (center, radius) = (rng.vector(1.0), 0.5);
        let sphere: Shape = Sphere::around(center, radius).unwrap().into();
        let target = center + rng.direction() * (0.4 * rng.uniform());
        let d = rng.direction();
        let arc = Arc::line(target - d * 1000.0, d, 2000.0);
        let hit = sphere.first_hit(&arc, 0.0, 1.0).unwrap();
        // Closed form about the point nearest to the centre.
        let w = target - center;
        let along = -w.dot(d);
        let half = (radius * radius - (w + d * along).length_squared()).sqrt();
        let theta = (1000.0 + along - half) / 2000.0;
        assert!((hit.theta - theta).abs() < 1e-15 * 50.0);
        assert!((hit.position.distance(center) - radius).abs() < 1e-15);
        assert!(hit.position.distance(target + d * (along - half)) < 2e-12);
        assert_eq!(all_hits(&sphere, &arc).len(), 2);
    }
}

#[test]
fn a_ray_that_starts_on_the_surface_does_not_hit_there() {
    let mut rng = Rng(7);
    for kind in KINDS {
        for _ in 0..2000 {
            let shape = kind.shape(rng.affine());
            let s = shape.sample_area(rng.pair());
            let out = Arc::line(s.position, s.normal + 0.7 * rng.direction(), 3.0);
            let closed = shape.is_closed();
            assert!(!closed || all_hits(&shape, &out).is_empty(), "{kind:?}");
            let inward = Arc::line(s.position, -s.normal + 0.7 * rng.direction(), 9.0);
            assert!(!closed || all_hits(&shape, &inward).len() == 1, "{kind:?}");
        }
    }
}

#[test]
fn undefined_arcs_hit_nothing() {
    let mesh: Shape = bumpy(1).into();
    let nan = DVec3::NAN;
    for shape in KINDS
        .map(|k| k.shape(DAffine3::IDENTITY))
        .iter()
        .chain([&mesh])
    {
        for arc in [
            Arc::line(nan, DVec3::X, 1.0),
            Arc::line(DVec3::ZERO, nan, 1.0),
            Arc::hermite([nan; 3], [nan; 3], 1.0),
            Arc::line(DVec3::ZERO, DVec3::ZERO, 0.0),
            Arc::hermite([DVec3::ZERO; 3], [DVec3::ZERO; 3], 0.0),
        ] {
            assert!(shape.first_hit(&arc, 0.0, 1.0).is_none());
        }
        let line = Arc::line(DVec3::splat(-3.0), DVec3::splat(6.0), 1.0);
        assert!(shape.first_hit(&line, 1.0, 0.0).is_none());
        assert!(shape.first_hit(&line, 0.4, 0.4).is_none());
    }
}
