//! A block of index 1.3 whose faces are one cell of a grid, in fog, with a lamp outside: most of what connects points across the step is
//! found from the shortest way, and the rest by luck.

use crate::common::{camera, container, fog, parts, vacuum};
use crate::compare::{Effort, compare, judge, table};
use crate::{RATE, long};
use eikonal::field::{Bspline, Placement};
use eikonal::{Aabb, Tolerance};
use glam::DVec3;
use transport::Spectrum;
use transport::bsdf::Bsdf;
use transport::emitter::Emitter;
use transport::scene::Parts;
use transport::shape::Cube;

/// Samples along each axis.
const SIZE: usize = 24;

fn scene() -> Parts {
    let bounds = Aabb::new(-DVec3::ONE, DVec3::ONE);
    let at = |i: usize| -1.0 + 2.0 * i as f64 / (SIZE - 1) as f64;
    let place = |i: usize| DVec3::new(at(i % SIZE), at(i / SIZE % SIZE), at(i / SIZE / SIZE));
    let inside = |x: DVec3| x.abs().max_element() < 0.5;
    let index = |i: usize| if inside(place(i)) { 1.3 } else { 1.0 };
    let samples: Vec<f64> = (0..SIZE.pow(3)).map(index).collect();
    let grid = Bspline::from_samples([SIZE; 3], bounds, Placement::Nodes, &samples).unwrap();
    let lamp = Emitter::Point {
        position: DVec3::new(1.5, 2.0, 1.0),
        intensity: Spectrum::splat(10.0),
    };
    let mut parts = parts(
        vec![container(
            Cube::new(Default::default()).unwrap(),
            Bsdf::Null,
        )],
        vec![vacuum(), fog(grid, 1.0, 0.8, 0.0)],
        vec![lamp],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    parts.tolerance = Tolerance::new(1e-4);
    (parts.film.width, parts.film.height) = (2, 2);
    parts
}

#[test]
fn estimators_agree_in_a_steep_grid() {
    let effort = Effort {
        batches: 12,
        work: if long() { 300_000_000 } else { 3_000_000 },
    };
    let row = compare("steep", &scene(), effort, 6000, Some(effort));
    println!("{}", table(std::slice::from_ref(&row), RATE, effort));
    judge(&[row], &[], RATE).unwrap();
}
