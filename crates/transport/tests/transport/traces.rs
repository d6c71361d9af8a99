//! Single rays traced through scenes.

use crate::common::{camera, container, fog, glass, parts, sky, vacuum};
use eikonal::Tolerance;
use eikonal::field::{Constant, LinearIndex, LinearSquare};
use glam::{DVec2, DVec3};
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::shape::Sphere;
use morgana_transport::trace::{TraceEnding, Tracer, follow_field};
use testkit::Rng;

/// A ball of radius 1 whose index grows along y.
fn graded_ball() -> Scene {
    let index = LinearIndex::new(1.0, DVec3::Y * 0.2, DVec3::ZERO).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(index, 0.1, 0.9, 0.0)];
    let sensor = camera(DVec3::NEG_Z * 4.0, DVec3::ZERO);
    Scene::new(parts(vec![ball], media, vec![sky()], sensor)).unwrap()
}

/// A ray that starts on a boundary and goes inwards equals a ray that starts a little before or
/// behind it.
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

/// However far away a ray starts, its points are finite, and its values have no more digits than
/// doubles.
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

/// If n² grows linearly along z, v_x and v_y are conserved, whatever the length at which a ray is
/// cut.
#[test]
fn rays_that_end_at_a_length_have_the_direction_of_their_field() {
    let field = LinearSquare::new(1.5, DVec3::Z * 0.2, DVec3::ZERO).unwrap();
    let cube = container(Sphere::around(DVec3::ZERO, 4.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(field, 0.1, 0.9, 0.0)];
    let sensor = camera(DVec3::NEG_Z * 9.0, DVec3::ZERO);
    let scene = Scene::new(parts(vec![cube], media, vec![sky()], sensor)).unwrap();
    let (field, mut rng) = (field.into(), Rng::new(2));
    for length in [1e-5, 1e-3, 0.1, 1.0, 3.0] {
        let tracer = Tracer::new(&scene, Some(length));
        for _ in 0..300 {
            let x = 0.5 * DVec3::from_array(rng.direction());
            let direction = DVec3::from_array(rng.direction());
            // The length of the direction does not matter.
            let alone = follow_field(&field, scene.tolerance(), x, 3.0 * direction, length, None);
            for path in [alone, tracer.follow(x, 0.5 * direction)] {
                assert_eq!(path.ending, TraceEnding::Length);
                let (start, end) = (path.points[0], path.points.last().unwrap());
                assert!((end.arc_length - length).abs() < 1e-6 * length);
                let n = |x: DVec3| (2.25 + 0.2 * x.z).sqrt();
                let conserved = DVec2::new(direction.x, direction.y) * n(start.x) / n(end.x);
                let off = (DVec2::new(end.direction.x, end.direction.y) - conserved).length();
                assert!(
                    off < 2e-6 && (end.index / n(end.x) - 1.0).abs() < 2e-6,
                    "{length}: {off}"
                );
            }
        }
    }
}

/// A ray of length zero ends at its start. A ray without an end continues to the limit.
#[test]
fn lengths_that_are_no_lengths() {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(Constant::new(1.0), 0.0, 0.0, 0.0)];
    let sensor = camera(DVec3::NEG_Z * 9.0, DVec3::ZERO);
    let scene = Scene::new(parts(vec![ball], media, vec![sky()], sensor)).unwrap();
    let trace = |length| Tracer::new(&scene, length).follow(DVec3::NEG_Z * 3.0, DVec3::Z);
    for length in [0.0, -1.0, f64::NAN] {
        let path = trace(Some(length));
        assert_eq!(
            (path.points.len(), path.ending),
            (1, TraceEnding::Length),
            "{length}"
        );
    }
    let [whole, unlimited] = [Some(f64::INFINITY), None].map(trace);
    assert_eq!(whole.ending, TraceEnding::Left);
    assert_eq!(whole.points.len(), unlimited.points.len());
    let tolerance = Tolerance::default();
    let follow = |length: f64| {
        let field = Constant::new(1.5).into();
        follow_field(&field, tolerance, DVec3::ZERO, DVec3::X, length, None)
    };
    for length in [0.0, -1.0, f64::NAN] {
        let path = follow(length);
        assert_eq!((path.points.len(), path.ending), (1, TraceEnding::Length));
    }
    let path = follow(f64::INFINITY);
    assert!(path.points.iter().all(|p| p.x.is_finite()));
}

/// Distant objects do not change the refraction by a ball, because the offset of rays from its
/// surface stays small.
#[test]
fn refraction_does_not_depend_on_the_extent_of_the_scene() {
    let end = |far: f64| {
        let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), glass());
        let mark = container(Sphere::around(DVec3::Y * far, 1.0).unwrap(), Bsdf::Null);
        let media = vec![vacuum(), fog(Constant::new(1.5), 0.0, 0.0, 0.0)];
        let sensor = camera(DVec3::NEG_Z * 4.0, DVec3::ZERO);
        let scene = Scene::new(parts(vec![ball, mark], media, vec![sky()], sensor)).unwrap();
        let path = Tracer::new(&scene, None).follow(DVec3::new(0.6, 0.0, -3.0), DVec3::Z);
        path.points.last().unwrap().direction
    };
    // The ray is refracted twice, by asin(0.6) − asin(0.4) each.
    let angle = 2.0 * (0.6_f64.asin() - 0.4_f64.asin());
    let exact = DVec3::new(-angle.sin(), 0.0, angle.cos());
    for (far, bound) in [(3.0, 1e-11), (1e3, 1e-8), (1e5, 1e-6)] {
        let off = (end(far) - exact).length();
        assert!(off < bound, "{far}: {off}");
    }
}
