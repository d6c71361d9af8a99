//! Tessellations of shapes: corners on the surface, and areas of inscribed polyhedra.

use glam::{DAffine3, DVec3};
use morgana_transport::shape::{Cube, Cylinder, Disk, Rectangle, Shape, Sphere, Tessellation};

fn place() -> DAffine3 {
    let turn = DAffine3::from_rotation_y(0.7) * DAffine3::from_rotation_x(0.4);
    DAffine3::from_translation(DVec3::new(1.0, -2.0, 0.5))
        * turn
        * DAffine3::from_scale(DVec3::splat(0.8))
}

fn area(mesh: &Tessellation) -> f64 {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.triangles.iter().map(area).sum()
}

/// With 64 steps around, a circle's polygon lacks 1.6e-3 of its area, and a sphere's polyhedron
/// twice as much.
#[test]
fn areas_are_those_of_the_shapes() {
    let shapes: [(Shape, f64); 6] = [
        (Rectangle::new(place()).unwrap().into(), 1e-12),
        (Cube::new(place()).unwrap().into(), 1e-12),
        (Disk::new(place()).unwrap().into(), 2e-3),
        (Cylinder::new(place(), false).unwrap().into(), 1e-3),
        (Cylinder::new(place(), true).unwrap().into(), 2e-3),
        (Sphere::new(place()).unwrap().into(), 4e-3),
    ];
    for (shape, lacking) in shapes {
        let relative = area(&shape.tessellation()) / shape.area() - 1.0;
        assert!(
            relative <= 1e-12 && relative >= -lacking,
            "{shape:?}: {relative}"
        );
    }
}

#[test]
fn corners_lie_on_the_surface() {
    let center = place().transform_point3(DVec3::ZERO);
    let middle = place().transform_point3(DVec3::Z * 0.5);
    let shapes: [(Shape, DVec3); 3] = [
        (Sphere::new(place()).unwrap().into(), center),
        (Cube::new(place()).unwrap().into(), center),
        (Cylinder::new(place(), true).unwrap().into(), middle),
    ];
    for (shape, center) in shapes {
        for corner in shape.tessellation().positions {
            let from_center = corner - center;
            // Centres of caps lie between other vertices.
            assert!(
                shape.contains(center + from_center * (1.0 - 1e-9)),
                "{corner}"
            );
            assert!(
                !shape.contains(center + from_center * (1.0 + 1e-9)),
                "{corner}"
            );
        }
    }
}
