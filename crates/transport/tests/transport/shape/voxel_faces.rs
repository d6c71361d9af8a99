//! Faces between voxels, compared with equivalent triangles.

use super::support::Rng;
use eikonal::ray::Arc;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::shape::{Accel, Mesh, Shape, VoxelFaces};
use morgana_transport::volume::LabelGrid;
use std::sync::Arc as Shared;

const SIZE: [usize; 3] = [9, 7, 8];

/// A ball of label 2 inside label 1 that extends beyond the grid, with random voxels of both labels
/// and of label 3.
fn labels() -> Vec<u8> {
    let place = |i: usize| DVec3::new((i % 9) as f64, (i / 9 % 7) as f64, (i / 63) as f64);
    let label = |i: usize| match (place(i) - DVec3::new(4.5, 3.0, 3.2)).length() {
        _ if i.is_multiple_of(29) => (i % 4) as u8,
        r if r < 2.0 => 2,
        r if r < 4.0 => 1,
        _ => 0,
    };
    (0..504).map(label).collect()
}

/// A skew transform, mirrored or not.
fn place(mirrored: bool) -> DAffine3 {
    let side = if mirrored { -1.0 } else { 1.0 };
    let columns = [[1.0, 0.1, 0.0], [0.0, 0.8 * side, 0.2], [0.0, 0.3, 0.9]];
    DAffine3::from_mat3_translation(DMat3::from_cols_array_2d(&columns), DVec3::NEG_ONE)
}

fn faces(labels: Vec<u8>, to_world: DAffine3) -> Vec<VoxelFaces> {
    let grid = LabelGrid::new(SIZE, labels, to_world).unwrap();
    VoxelFaces::all(&Shared::new(grid)).unwrap()
}

fn mesh(shape: &Shape) -> Shape {
    let all = shape.tessellation();
    Mesh::new(all.positions, all.triangles, None)
        .unwrap()
        .into()
}

/// Lines through the grid, some of them parallel to edges of voxels.
fn arcs(to_world: &DAffine3) -> Vec<Arc> {
    let mut random = Rng(5);
    let mut point = || {
        let unit = DVec3::from_array([0; 3].map(|_| random.uniform()));
        to_world.transform_point3(unit * 1.6 - 0.3)
    };
    let line = |i: usize, a: DVec3, b: DVec3| match i % 5 {
        0 => Arc::line(a, to_world.matrix3.col(i % 3).normalize(), 1.5),
        _ => Arc::line(a, (b - a).normalize(), a.distance(b)),
    };
    (0..3000).map(|i| line(i, point(), point())).collect()
}

#[test]
fn lines_meet_what_they_meet_of_triangles() {
    for mirrored in [false, true] {
        let to_world = place(mirrored);
        let shapes: Vec<Shape> = faces(labels(), to_world)
            .into_iter()
            .map(Shape::from)
            .collect();
        let meshes: Vec<Shape> = shapes.iter().map(mesh).collect();
        assert_eq!(shapes.len(), 6);
        let [walks, trees] = [&shapes, &meshes].map(|shapes| Accel::new(shapes));
        let (mut met, mut missed) = (0, 0);
        for arc in arcs(&to_world) {
            let mut from = 0.0;
            // Continue from hit to hit.
            loop {
                let found = walks.first(&shapes, &arc, [from, 1.0], [None; 2]);
                let expected = trees.first(&meshes, &arc, [from, 1.0], [None; 2]);
                let (Some((i, a)), Some((k, b))) = (found, expected) else {
                    assert_eq!(found.is_some(), expected.is_some(), "{from} {arc:?}");
                    missed += 1;
                    break;
                };
                let (a, b) = (shapes[i].hit(&a), meshes[k].hit(&b));
                assert_eq!(i, k);
                assert!((a.theta - b.theta).abs() < 1e-12, "{} {}", a.theta, b.theta);
                assert!(a.position.distance(b.position) < 1e-12);
                assert!(a.normal.distance(b.normal) < 1e-12);
                let alone = shapes[i].first_hit(&arc, from, 1.0).unwrap();
                assert_eq!(alone, a);
                (from, met) = (a.theta, met + 1);
            }
        }
        assert!(met > 4000 && missed == 3000, "{met} {missed}");
    }
}

#[test]
fn bent_rays_meet_them() {
    let to_world = place(false);
    let mut random = Rng(3);
    let mut met = 0;
    for faces in faces(labels(), to_world) {
        let shape = Shape::from(faces);
        let mesh = mesh(&shape);
        for _ in 0..3000 {
            let arc = random.arc();
            let [a, b] = [&shape, &mesh].map(|shape| shape.first_hit(&arc, 0.0, 1.0));
            assert_eq!(a.is_some(), b.is_some());
            if let (Some(a), Some(b)) = (a, b) {
                assert_eq!(a.theta, b.theta);
                assert!(a.position.distance(b.position) < 1e-12);
                assert!(a.normal.distance(b.normal) < 1e-12);
                met += 1;
            }
        }
    }
    assert!(met > 300, "{met}");
}

/// Areas, volumes, boxes, closedness and sides agree with the triangles. Sampled points lie
/// uniformly on them.
#[test]
fn they_have_the_measures_of_their_triangles() {
    for mirrored in [false, true] {
        let to_world = place(mirrored);
        let sprinkled = labels();
        // A part inside another, and a box.
        let nested = sprinkled
            .iter()
            .map(|l| [0, 2, 1, 1][usize::from(*l)])
            .collect();
        let whole = vec![7; 504];
        let mut closed = 0;
        for labels in [sprinkled, nested, whole] {
            let count = labels.iter().filter(|l| **l == 7).count();
            for faces in faces(labels, to_world) {
                let shape = Shape::from(faces);
                let mesh = mesh(&shape);
                assert!((shape.area() / mesh.area() - 1.0).abs() < 1e-12);
                assert!(
                    (shape.part_areas().iter().sum::<f64>() / shape.area() - 1.0).abs() < 1e-12
                );
                assert!(shape.aabb().min.distance(mesh.aabb().min) < 1e-12);
                assert!(shape.aabb().max.distance(mesh.aabb().max) < 1e-12);
                assert_eq!(shape.is_closed(), mesh.is_closed());
                assert_eq!(shape.is_convex(), mesh.is_convex());
                assert_eq!(shape.is_convex(), count == 504);
                closed += usize::from(shape.is_closed());
                let Shape::Mesh(triangles) = &mesh else {
                    unreachable!()
                };
                assert!(!triangles.was_inside_out());
                let mut random = Rng(2);
                let mut below = [0.0; 2];
                for _ in 0..2000 {
                    let u = random.pair();
                    let sample = shape.sample_area(u);
                    let back = shape.inverse_area(sample.position, sample.primitive);
                    assert!((back[0] - u[0]).abs() < 1e-9 && (back[1] - u[1]).abs() < 1e-9);
                    assert!((sample.pdf * shape.area() - 1.0).abs() < 1e-12);
                    let off =
                        Arc::line(sample.position + 1e-9 * sample.normal, -sample.normal, 2e-9);
                    let hit = mesh.first_hit(&off, 0.0, 1.0).unwrap();
                    assert!(hit.normal.distance(sample.normal) < 1e-6);
                    below[0] += f64::from(sample.position.x < 0.0);
                    let other = mesh.sample_area(u).position;
                    below[1] += f64::from(other.x < 0.0);
                    let p = to_world
                        .transform_point3(DVec3::from_array([0; 3].map(|_| random.uniform())));
                    assert_eq!(shape.contains(p), mesh.contains(p));
                }
                assert!((below[0] - below[1]).abs() < 150.0, "{below:?}");
            }
        }
        // At least the box is closed; random labels touch at edges.
        assert!(closed >= 1, "{closed}");
    }
}

#[test]
fn faces_without_an_area_are_refused() {
    let grid =
        |size: DVec3| LabelGrid::new([2; 3], vec![1; 8], DAffine3::from_scale(size)).unwrap();
    let all = |size| VoxelFaces::all(&Shared::new(grid(size)));
    assert!(all(DVec3::splat(1e-30)).is_ok());
    let error = all(DVec3::new(1.0, 1.0, 1e-18)).unwrap_err().to_string();
    assert!(error.contains("across axis 0"), "{error}");
}
