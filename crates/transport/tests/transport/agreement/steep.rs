//! A block of index 1.3 in fog, whose faces are one grid cell wide, with an emitter outside. The
//! shortest path finds most rays that connect points across the step; the random search finds the
//! rest.

use crate::agreement::case::diffuse;
use crate::agreement::compare::{Effort, compare, judge, table};
use crate::agreement::{RATE, long};
use crate::common::{camera, container, fog, parts, vacuum};
use eikonal::field::{Bspline, Placement};
use eikonal::{Aabb, Tolerance};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use std::f64::consts::PI;

/// Samples along each axis.
const SIZE: usize = 24;

/// Emitter outside the fog: a point, or a ball of a given radius.
enum Light {
    Point,
    Ball(f64),
}

fn scene(light: &Light) -> Parts {
    let bounds = Aabb::new(-DVec3::ONE, DVec3::ONE);
    let at = |i: usize| -1.0 + 2.0 * i as f64 / (SIZE - 1) as f64;
    let place = |i: usize| DVec3::new(at(i % SIZE), at(i / SIZE % SIZE), at(i / SIZE / SIZE));
    let inside = |x: DVec3| x.abs().max_element() < 0.5;
    let index = |i: usize| if inside(place(i)) { 1.3 } else { 1.0 };
    let samples: Vec<f64> = (0..SIZE.pow(3)).map(index).collect();
    let grid = Bspline::from_samples([SIZE; 3], bounds, Placement::Nodes, &samples).unwrap();
    let mut objects = vec![container(
        Cube::new(Default::default()).unwrap(),
        Bsdf::Null,
    )];
    let position = DVec3::new(1.5, 2.0, 1.0);
    let emitter = match light {
        Light::Point => Emitter::Point {
            position,
            intensity: Spectrum::splat(10.0),
        },
        Light::Ball(radius) => {
            let mut ball = diffuse(Sphere::around(position, *radius).unwrap());
            ball.emitter = Some(0);
            objects.push(ball);
            Emitter::Area {
                object: 1,
                radiance: Spectrum::splat(10.0 / (PI * radius * radius)),
            }
        }
    };
    let mut parts = parts(
        objects,
        vec![vacuum(), fog(grid, 1.0, 0.8, 0.0)],
        vec![emitter],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    parts.tolerance = Tolerance::new(1e-4);
    (parts.film.width, parts.film.height) = (2, 2);
    parts
}

fn agree(name: &str, light: &Light, work: u64) {
    let effort = Effort { batches: 12, work };
    let row = compare(name, &scene(light), effort, 6000, Some(effort));
    println!("{}", table(std::slice::from_ref(&row), RATE, effort));
    judge(&[row], &[], RATE).unwrap();
}

#[test]
fn estimators_agree_in_a_steep_grid() {
    let work = if long() { 3_000_000 } else { 400_000 };
    agree("steep", &Light::Point, work);
}

/// Light from a ball is found by hits, too, which bounds the tails of 1/J at edges of shadows and
/// caustics. For a point light these tails are so heavy that means of a hundred times the samples
/// are not normal: the largest sample of `path` holds half of the scatter.
#[test]
fn estimators_agree_in_a_steep_grid_lit_by_a_ball() {
    let work = if long() { 300_000_000 } else { 200_000 };
    agree("steep, ball", &Light::Ball(0.4), work);
}
