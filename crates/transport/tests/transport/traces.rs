//! Single rays through scenes.

use crate::common::{camera, container, fog, parts, sky, vacuum};
use eikonal::field::LinearIndex;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::shape::Sphere;
use morgana_transport::trace::{TraceEnding, Tracer};

/// A ball of radius 1 whose index grows along y.
fn graded_ball() -> Scene {
    let index = LinearIndex::new(1.0, DVec3::Y * 0.2, DVec3::ZERO).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(index, 0.1, 0.9, 0.0)];
    let sensor = camera(DVec3::NEG_Z * 4.0, DVec3::ZERO);
    Scene::new(parts(vec![ball], media, vec![sky()], sensor)).unwrap()
}

/// A ray that starts on a boundary, from which it goes inwards, is the one that starts a little before or behind it.
#[test]
fn a_ray_from_a_boundary_goes_into_its_medium() {
    let scene = graded_ball();
    for direction in [DVec3::Z, DVec3::new(0.3, -0.2, 0.9).normalize()] {
        let end = |z: f64| {
            let start = DVec3::NEG_Z * (1.0 + z);
            let path = Tracer::new(&scene, None).follow(start, direction);
            path.points.last().unwrap().direction
        };
        let bent = (end(1e-6) - direction).length();
        assert!(bent > 0.05, "{bent}");
        for z in [0.0, 1e-15, -1e-15, -1e-6] {
            let off = (end(z) - end(1e-6)).length();
            assert!(off < 1e-5, "{z}: {off}");
        }
    }
}

/// However far a ray starts, its points are finite, and what it has is not more than doubles can tell.
#[test]
fn rays_from_afar() {
    let scene = graded_ball();
    let tracer = Tracer::new(&scene, None);
    for (distance, ending) in [
        (1e3, TraceEnding::Left),
        (1e9, TraceEnding::Left),
        (1e200, TraceEnding::Lost),
    ] {
        for from in [DVec3::X, DVec3::Y] {
            let path = tracer.follow(from * distance, -from);
            assert_eq!(path.ending, ending, "{distance}");
            assert!(path.points.iter().all(|p| p.x.is_finite()));
            let crosses = path.points.iter().any(|p| p.medium == 1);
            assert_eq!(crosses, ending == TraceEnding::Left, "{distance}");
        }
    }
}
