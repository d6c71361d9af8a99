//! Renders that must be equal, bit for bit.

use crate::common::{camera, container, fog, parts, shoot, vacuum};
use eikonal::field::{Bspline, Constant, Gaussian, Placement};
use eikonal::{Aabb, Field};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::render::Rendering;
use morgana_transport::shape::Sphere;

fn render(index: impl Into<Field>) -> Rendering {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let light = Emitter::Point {
        position: DVec3::new(0.3, 0.4, 2.0),
        intensity: Spectrum::splat(10.0),
    };
    let scene = parts(
        vec![container(ball, Bsdf::Null)],
        vec![vacuum(), fog(index, 1.0, 0.9, 0.5)],
        vec![light],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    shoot(scene, 32, 1)
}

/// A constant index gives the straight-line renderer, however the index is described.
#[test]
fn a_constant_index_gives_the_same_bits_however_it_is_described() {
    let straight = render(Constant::new(1.0));
    // Straight rays cost no evaluations: connections are closed forms, not shots.
    assert_eq!(straight.stats.work.evaluations, 0);
    assert_eq!(straight.stats.work.shots, 0);
    assert!(straight.stats.connections.found > 0);
    let bounds = Aabb::new(-DVec3::ONE, DVec3::ONE);
    let samples = vec![1.0f32; 64];
    let grid = Bspline::from_samples([4, 4, 4], bounds, Placement::Nodes, &samples).unwrap();
    assert_eq!(straight.film, render(grid).film);
    let flat = Gaussian::new(1.0, 0.0, DVec3::ZERO, 0.3).unwrap();
    assert_eq!(straight.film, render(flat).film);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.3).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| render(index))
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        let many = with(threads);
        assert_eq!(one.film, many.film);
        assert_eq!(one.stats, many.stats);
    }
}
