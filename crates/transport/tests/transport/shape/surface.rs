//! Bounding boxes, sides, normals and curvature of analytic shapes.

use crate::shape::support::{KINDS, Kind, Rng};
use eikonal::ray::Arc;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::shape::{Cylinder, Disk, Shape, ShapeError, Sphere};

#[test]
fn contains_agrees_with_the_definition() {
    let mut rng = Rng(11);
    for kind in KINDS {
        for _ in 0..50 {
            let m = rng.affine();
            let shape = kind.shape(m);
            for _ in 0..100 {
                let p = rng.vector(1.5);
                assert_eq!(shape.contains(m.transform_point3(p)), kind.contains(p));
            }
        }
    }
}

#[test]
fn normals_are_gradients() {
    let mut rng = Rng(12);
    for kind in KINDS {
        for i in 0..500 {
            let m = rng.affine();
            let shape = kind.shape(m).with_flipped_normals(i % 3 == 0);
            let side = if i % 3 == 0 { -1.0 } else { 1.0 };
            let to_local = m.inverse();
            let s = shape.sample_area(rng.pair());
            let f = |p: DVec3| kind.implicit(to_local.transform_point3(p));
            let g = DVec3::AXES.map(|e| f(s.position + e * 1e-6) - f(s.position - e * 1e-6));
            let g = DVec3::from_array(g).normalize() * side;
            // Skip points within the difference step of an edge, where the normal is not defined.
            let near_edge = kind == Kind::Cube || kind == Kind::Can;
            assert!(
                g.distance(s.normal) < 1e-7 || near_edge && i % 50 == 0,
                "{kind:?}"
            );
            let probe = Arc::line(s.position - s.normal * 0.01, s.normal, 0.02);
            if let Some(h) = shape
                .first_hit(&probe, 0.0, 1.0)
                .filter(|h| h.primitive == s.primitive)
            {
                assert!(h.normal.distance(s.normal) < 1e-6);
                assert!(h.uv.get().iter().all(|u| (0.0..=1.0).contains(u)));
            }
        }
    }
}

#[test]
fn the_shape_operator_is_the_derivative_of_the_normal() {
    let mut rng = Rng(13);
    for kind in [
        Kind::Sphere,
        Kind::EdgeGeometry,
        Kind::Can,
        Kind::Cube,
        Kind::Disk,
    ] {
        for i in 0..500 {
            let shape = kind.shape(rng.affine()).with_flipped_normals(i % 2 == 0);
            let s = shape.sample_area(rng.pair());
            let operator = shape.shape_operator(s.position, s.primitive);
            let asymmetry = (operator - operator.transpose()).to_cols_array();
            let bound = 1e-13 * (1.0 + operator.to_cols_array().map(f64::abs).iter().sum::<f64>());
            assert!(asymmetry.iter().all(|x| x.abs() < bound));
            assert!((operator * s.normal).length() < bound);
            let tangent = s.normal.cross(rng.direction()).normalize();
            let normal_at = |h: f64| {
                let p = s.position + tangent * h - s.normal * 1e-3;
                let hit = shape.first_hit(&Arc::line(p, s.normal, 2e-3), 0.0, 1.0);
                hit.filter(|x| x.primitive == s.primitive).map(|x| x.normal)
            };
            let h = 1e-5;
            if let (Some(a), Some(b)) = (normal_at(-h), normal_at(h)) {
                let difference = (b - a) / (2.0 * h);
                let error = (difference - operator * tangent).length();
                let scale = 1.0 + difference.length();
                assert!(error < 1e-6 * scale.powi(3), "{kind:?} {error:e} {scale}");
            }
        }
    }
    let sphere: Shape = Sphere::around(DVec3::ONE, 2.0).unwrap().into();
    let operator = sphere.shape_operator(DVec3::new(3.0, 1.0, 1.0), 0);
    assert!((operator * DVec3::Y - 0.5 * DVec3::Y).length() < 1e-15);
}

#[test]
fn boxes_are_tight() {
    let mut rng = Rng(14);
    for kind in KINDS {
        for _ in 0..5 {
            let shape = kind.shape(rng.affine());
            let bounds = shape.aabb();
            let mut seen = eikonal::Aabb::EMPTY;
            for _ in 0..20_000 {
                let p = shape.sample_area(rng.pair()).position;
                assert!(bounds.contains(p));
                seen = seen.include(p);
            }
            assert!(
                (seen.size() / bounds.size()).min_element() > 0.9,
                "{kind:?}"
            );
        }
    }
}

#[test]
fn closed_analytic_shapes_are_convex() {
    for kind in KINDS {
        let shape = kind.shape(DAffine3::IDENTITY);
        let closed = matches!(kind, Kind::Sphere | Kind::Cube | Kind::Can);
        assert_eq!(shape.is_closed(), closed);
        assert_eq!(shape.is_convex(), closed);
    }
}

#[test]
fn a_cylinder_between_points_has_its_radius_and_length() {
    let (p0, p1) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 0.0, 5.0));
    let open: Shape = Cylinder::between(p0, p1, 0.5, false).unwrap().into();
    let can: Shape = Cylinder::between(p0, p1, 0.5, true).unwrap().into();
    let tau = std::f64::consts::TAU;
    assert!((open.area() - tau * 0.5 * 3.0).abs() < 1e-12);
    assert!((can.area() - tau * 0.5 * 3.5).abs() < 1e-12);
    assert!(can.contains(0.5 * (p0 + p1)) && !can.contains(2.0 * p1 - p0));
    let through = Arc::line(p0 - (p1 - p0), p1 - p0, 3.0);
    let hit = can.first_hit(&through, 0.0, 1.0).unwrap();
    assert!(hit.position.distance(p0) < 1e-14 && hit.primitive == 1);
    assert!(open.first_hit(&through, 0.0, 1.0).is_none());
}

#[test]
fn impossible_shapes_are_refused() {
    let flat = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)));
    let infinite = DAffine3::from_translation(DVec3::INFINITY);
    assert!(matches!(
        Disk::new(flat),
        Err(ShapeError::SingularTransform { .. })
    ));
    assert!(matches!(
        Sphere::new(infinite),
        Err(ShapeError::NonFiniteTransform)
    ));
    let zero = Sphere::around(DVec3::ZERO, 0.0).unwrap_err();
    assert_eq!(
        zero.to_string(),
        "the radius must be positive and finite, but it is 0"
    );
    let point = Cylinder::between(DVec3::ONE, DVec3::ONE, 1.0, true);
    assert_eq!(point.unwrap_err(), ShapeError::CylinderEnds);
}
