//! Acceleration structure: the nearest of many shapes.

use crate::shape::support::{KINDS, Rng, bumpy};
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};
use morgana_transport::shape::{Accel, Rectangle, Shape, Sphere};

fn nearest(shapes: &[Shape], arc: &Arc, from: f64, to: f64) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for (i, shape) in shapes.iter().enumerate() {
        if let Some(hit) = shape.first_hit(arc, from, to)
            && best.is_none_or(|(_, t)| hit.theta < t)
        {
            best = Some((i, hit.theta));
        }
    }
    best
}

#[test]
fn the_accelerator_agrees_with_a_loop() {
    let mut rng = Rng(41);
    for count in [0, 1, 5, 8, 9, 40] {
        let mut shapes: Vec<Shape> = (0..count)
            .map(|i| KINDS[i % 6].shape(DAffine3::from_scale(DVec3::splat(0.4)) * rng.affine()))
            .collect();
        if count > 8 {
            shapes.push(bumpy(2).into());
        }
        let accel = Accel::new(&shapes);
        for i in 0..2000 {
            let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
            let (from, to) = (0.3 * rng.uniform(), 0.5 + 0.5 * rng.uniform());
            let found = accel.first(&shapes, &arc, [from, to], [None; 2]);
            let expected = nearest(&shapes, &arc, from, to);
            assert_eq!(found.map(|x| x.0), expected.map(|x| x.0));
            if let (Some((_, a)), Some((_, b))) = (found, expected) {
                assert!((a.theta - b).abs() < 1e-14);
            }
        }
    }
}

/// The any-hit search finds one of the shapes that count if the arc meets any.
#[test]
fn any_hit_agrees_with_a_loop() {
    let mut rng = Rng(43);
    let mut found = 0;
    for count in [0, 3, 8, 20] {
        let shapes: Vec<Shape> = (0..count)
            .map(|i| KINDS[i % 6].shape(DAffine3::from_scale(DVec3::splat(0.4)) * rng.affine()))
            .collect();
        let accel = Accel::new(&shapes);
        for i in 0..2000 {
            let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
            let to = 0.5 + 0.5 * rng.uniform();
            let counts = |shape: usize, theta: f64| shape % 3 != 1 && theta > 0.1;
            let any = accel.any_hit(&shapes, &arc, to, [None; 2], counts);
            let mut hits = shapes.iter().enumerate();
            let expected = hits.any(|(i, shape)| {
                let hit = shape.first_hit(&arc, 0.0, to);
                hit.is_some_and(|hit| counts(i, hit.theta))
            });
            assert_eq!(any, expected);
            found += u32::from(any);
        }
    }
    assert!((1000..7000).contains(&found), "{found}");
}

#[test]
fn of_coincident_surfaces_the_first_wins() {
    let mut rng = Rng(42);
    for extra in [0, 10] {
        let mut shapes: Vec<Shape> = (0..extra)
            .map(|i| {
                Sphere::around(DVec3::X * (10.0 + i as f64), 0.3)
                    .unwrap()
                    .into()
            })
            .collect();
        let first = shapes.len();
        let half_turn = DAffine3::from_rotation_x(std::f64::consts::PI);
        for m in [
            DAffine3::IDENTITY,
            half_turn,
            DAffine3::from_scale(DVec3::splat(2.0)),
        ] {
            shapes.push(Rectangle::new(m).unwrap().into());
        }
        let accel = Accel::new(&shapes);
        for _ in 0..500 {
            let v = rng.direction();
            let target = DVec3::new(rng.uniform() - 0.5, rng.uniform() - 0.5, 0.0);
            let hit = accel.first(
                &shapes,
                &Arc::line(target - v, v, 3.0),
                [0.0, 1.0],
                [None; 2],
            );
            assert_eq!(hit.unwrap().0, first);
        }
    }
}

/// Rays that meet thousands of balls in one place find the first one, in a number of steps linear
/// in the number of balls.
#[test]
fn thousands_of_shapes_in_one_place() {
    let shapes = vec![Shape::from(Sphere::new(DAffine3::IDENTITY).unwrap()); 30_000];
    let started = std::time::Instant::now();
    let accel = Accel::new(&shapes);
    for i in 0..20 {
        let start = DVec3::new(0.02 * f64::from(i), 0.1, -4.0);
        let line = Arc::line(start, DVec3::new(0.0, 0.0, 8.0), 1.0);
        let (first, _) = accel.first(&shapes, &line, [0.0, 1.0], [None; 2]).unwrap();
        assert_eq!(first, 0);
    }
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
}
