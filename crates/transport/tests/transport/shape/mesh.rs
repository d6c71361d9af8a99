//! Meshes, compared with analytic shapes and brute force over triangles.

use crate::shape::support::{Kind, Rng, all_hits, bumpy, icosphere};
use eikonal::ray::Arc;
use eikonal::ray::bernstein::{evaluate, first_root, height};
use glam::{DAffine3, DVec3};
use morgana_transport::shape::{Mesh, Shape, ShapeError};

/// The cube [−1, 1]³ as twelve triangles.
fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| DVec3::from_array([0, 1, 2].map(|k| f64::from(i >> k & 1) * 2.0 - 1.0));
    let quads: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let split = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let triangles = quads.into_iter().flat_map(split).collect();
    ((0..8).map(corner).collect(), triangles)
}

fn mesh((positions, triangles): (Vec<DVec3>, Vec<[u32; 3]>)) -> Mesh {
    Mesh::new(positions, triangles, None).unwrap()
}

#[test]
fn a_cube_of_triangles_is_the_cube() {
    let mut rng = Rng(31);
    for i in 0..3000 {
        let m = rng.affine();
        let triangles: Shape = mesh(cube()).transformed(m).unwrap().into();
        let exact = Kind::Cube.shape(m);
        if i < 50 {
            assert!(triangles.is_closed() && triangles.is_convex());
            assert!((triangles.area() / exact.area() - 1.0).abs() < 1e-13);
        }
        let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
        let [a, b] = [&triangles, &exact].map(|s| s.first_hit(&arc, 0.0, 1.0));
        assert_eq!(a.is_some(), b.is_some());
        if let (Some(a), Some(b)) = (a, b) {
            let slant = arc.velocity(a.theta).normalize().dot(a.normal).abs();
            assert!((a.theta - b.theta).abs() * slant < 1e-12);
            assert!(a.normal.distance(b.normal) < 1e-10);
        }
        let p = m.transform_point3(rng.vector(1.3));
        assert_eq!(triangles.contains(p), exact.contains(p));
    }
}

/// Lines from inside a convex mesh through points of its edges and through its vertices leave it.
/// Lines from outside to a point inside enter it.
#[test]
fn lines_through_edges_and_vertices_do_not_leak() {
    let mut rng = Rng(32);
    let m = DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.1));
    let sphere = mesh(icosphere(3)).transformed(m).unwrap();
    let shape: Shape = sphere.clone().into();
    assert!(shape.is_closed() && shape.is_convex());
    for i in 0..100_000 {
        let t = sphere.triangles()[rng.index(sphere.triangles().len())];
        let [a, b] = [0, 1].map(|k| sphere.positions()[t[k] as usize]);
        let f = if i % 4 == 0 { 0.0 } else { rng.uniform() };
        let target = a + (b - a) * f;
        let inside = m.translation + rng.vector(0.4);
        let reach = if i % 3 == 0 { 1000.0 } else { 3.0 };
        let outside = inside + (target - inside) * reach;
        let out = Arc::line(inside, outside - inside, 1.0);
        let hit = shape.first_hit(&out, 0.0, 1.0).expect("leak");
        assert!(hit.position.distance(target) < 1e-10);
        assert!(hit.normal.dot(outside - inside) > 0.0);
        let back = Arc::line(outside, inside - outside, 1.0);
        assert!(shape.first_hit(&back, 0.0, 1.0).is_some());
    }
}

/// Arcs through a point of an edge or a vertex, which they pass at θ = 1/2, leave and enter the
/// mesh like lines.
#[test]
fn arcs_through_edges_and_vertices_do_not_leak() {
    let mut rng = Rng(33);
    let sphere = mesh(icosphere(2));
    let shape: Shape = sphere.clone().into();
    for i in 0..20_000 {
        let t = sphere.triangles()[rng.index(sphere.triangles().len())];
        let [a, b] = [0, 1].map(|k| sphere.positions()[t[k] as usize]);
        let target = a + (b - a) * if i % 4 == 0 { 0.0 } else { rng.uniform() };
        let (inside, bend) = (rng.vector(0.3), rng.vector(2.0));
        // x = target + (target − inside)(2θ − 1) + bend (θ − 1/2)²/2.
        let v = 2.0 * (target - inside);
        let at = |u: f64| [target + v * u + bend * (0.5 * u * u), v + bend * u, bend];
        let arc = Arc::hermite(at(-0.5), at(0.5), 1.0);
        assert!(shape.contains(arc.start()) && !shape.contains(arc.end()));
        assert!(!all_hits(&shape, &arc).is_empty(), "leak");
    }
}

fn brute_force(mesh: &Mesh, arc: &Arc) -> Option<f64> {
    let mut best: Option<f64> = None;
    for t in mesh.triangles() {
        let [a, b, c] = t.map(|v| mesh.positions()[v as usize]);
        let n = (b - a).cross(c - a).normalize();
        let inside = |p: DVec3| {
            [(a, b), (b, c), (c, a)]
                .iter()
                .all(|(p0, p1)| n.dot((p1 - p0).cross(p - p0)) > 0.0)
        };
        let h = height(&arc.control(), a, n);
        let mut from = 0.0;
        while let Some(t) = first_root(&h, from, 1.0, [0.0; 2]) {
            if inside(evaluate(&arc.control(), t).0) {
                best = Some(best.map_or(t, |b| b.min(t)));
                break;
            }
            from = t;
        }
    }
    best
}

#[test]
fn the_hierarchy_loses_no_hit() {
    let mut rng = Rng(34);
    let mesh = bumpy(3);
    let shape: Shape = mesh.clone().into();
    assert!(shape.is_closed() && !shape.is_convex());
    let mut hits = 0;
    for i in 0..1500 {
        let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
        let found = shape.first_hit(&arc, 0.0, 1.0).map(|h| h.theta);
        let expected = brute_force(&mesh, &arc);
        assert_eq!(found.is_some(), expected.is_some());
        if let (Some(a), Some(b)) = (found, expected) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
            hits += 1;
        }
    }
    assert!(hits > 500);
}

#[test]
fn crossings_have_the_right_parity() {
    let mut rng = Rng(35);
    let shape: Shape = bumpy(3).into();
    for i in 0..10_000 {
        let arc = if i % 2 == 0 { rng.arc() } else { rng.line() };
        let hits = all_hits(&shape, &arc);
        let sides = shape.contains(arc.start()) != shape.contains(arc.end());
        assert_eq!(hits.len() % 2 == 1, sides, "{hits:?}");
    }
}

#[test]
fn contains_agrees_with_the_radius_of_a_star_shaped_mesh() {
    let mut rng = Rng(36);
    let mesh = bumpy(3);
    let shape: Shape = mesh.clone().into();
    for _ in 0..5000 {
        let d = rng.direction();
        let surface = shape.first_hit(&Arc::line(DVec3::ZERO, d, 3.0), 0.0, 1.0);
        let radius = surface.unwrap().position.length();
        assert!(shape.contains(d * (radius * 0.999)));
        assert!(!shape.contains(d * (radius * 1.001)));
    }
    // From these points, on lines through vertices, every direction is a special case.
    assert!(shape.contains(DVec3::ZERO));
}

#[test]
fn topology_is_recognised() {
    let (positions, triangles) = cube();
    let full = mesh((positions.clone(), triangles.clone()));
    let open: Shape = mesh((positions.clone(), triangles[1..].to_vec())).into();
    assert!(!open.is_closed() && !open.is_convex() && !open.contains(DVec3::ZERO));

    // A mesh wound inside out is turned.
    let reversed = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let turned: Shape = mesh((positions.clone(), reversed)).into();
    let ray = Arc::line(DVec3::new(0.1, 0.2, 3.0), DVec3::NEG_Z, 3.0);
    for shape in [turned.clone(), full.into()] {
        let hit = shape.first_hit(&ray, 0.0, 1.0).unwrap();
        assert!(hit.normal.distance(DVec3::Z) < 1e-15);
    }
    let flipped = turned.with_flipped_normals(true);
    assert!(flipped.first_hit(&ray, 0.0, 1.0).unwrap().normal.z < 0.0);

    // With one reversed triangle, the mesh is not a consistent surface.
    let mut twisted = triangles.clone();
    twisted[3].swap(0, 1);
    assert!(!Shape::from(mesh((positions.clone(), twisted))).is_closed());

    // Repeat vertices per triangle, as at seams of texture coordinates.
    let soup = triangles.iter().flatten().map(|v| positions[*v as usize]);
    let own = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    assert!(Shape::from(mesh((soup.collect(), own))).is_closed());
}

#[test]
fn texture_coordinates_are_interpolated() {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let uvs = vec![[0.0, 1.0], [2.0, 1.0], [0.0, 5.0]];
    let mesh = Mesh::new(positions, vec![[0, 1, 2]], Some(uvs)).unwrap();
    let ray = Arc::line(DVec3::new(0.25, 0.5, 1.0), DVec3::NEG_Z, 2.0);
    let hit = Shape::from(mesh).first_hit(&ray, 0.0, 1.0).unwrap();
    let [u, v] = hit.uv.get();
    assert!((u - 0.5).abs() < 1e-15 && (v - 3.0).abs() < 1e-15);
}

#[test]
fn broken_meshes_are_refused_or_repaired() {
    let (positions, mut triangles) = cube();
    triangles.extend([[0, 0, 1], [2, 2, 2]]);
    let repaired = mesh((positions.clone(), triangles));
    assert_eq!((repaired.dropped(), repaired.triangles().len()), (2, 12));
    assert!(Shape::from(repaired).is_closed());

    let refuse = |p: Vec<DVec3>, t: Vec<[u32; 3]>, uvs| Mesh::new(p, t, uvs).unwrap_err();
    let p = positions;
    let empty = refuse(p.clone(), vec![[1, 1, 1]], None);
    assert_eq!(empty, ShapeError::EmptyMesh { dropped: 1 });
    assert_eq!(
        refuse(vec![], vec![], None),
        ShapeError::EmptyMesh { dropped: 0 }
    );
    let index = refuse(p.clone(), vec![[0, 1, 2], [0, 1, 8]], None);
    assert_eq!(
        index.to_string(),
        "triangle 1 uses vertex 8, but there are only 8 vertices"
    );
    let uvs = refuse(p.clone(), vec![[0, 1, 2]], Some(vec![[0.0; 2]; 3]));
    assert_eq!(
        uvs,
        ShapeError::UvCount {
            expected: 8,
            got: 3
        }
    );
    let mut undefined = p;
    undefined[4].y = f64::NAN;
    let vertex = refuse(undefined, vec![[0, 1, 2]], None);
    assert_eq!(vertex, ShapeError::NonFiniteVertex { vertex: 4 });
}

#[test]
fn vertices_that_seams_have_split_are_shaded_as_one() {
    let roof = [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 1.0),
        (1.0, 1.0, 1.0),
        (2.0, 0.5, 0.0),
    ];
    let roof = roof.map(|(x, y, z)| DVec3::new(x, y, z)).to_vec();
    let split = [&roof[..], &roof[1..3]].concat();
    let joined = mesh((roof, vec![[0, 1, 2], [1, 3, 2]]));
    let split = mesh((split, vec![[0, 1, 2], [4, 3, 5]]));
    let normals = |mesh: Mesh| {
        let shape = Shape::from(mesh);
        let points = (0..20).map(|i| [f64::from(i) / 20.0, 0.3]);
        let normal = |u| {
            let sample = shape.sample_area(u);
            shape.shading_normal(&shape.site_of(&sample), sample.normal)
        };
        points.map(normal).collect::<Vec<DVec3>>()
    };
    let across = split
        .clone()
        .with_smooth_normals_across(&[0, 1, 2, 3, 1, 2]);
    let expected = normals(joined.with_smooth_normals());
    assert_eq!(normals(across.unwrap()), expected);
    assert_ne!(normals(split.clone().with_smooth_normals()), expected);
    for wrong in [&[0, 1, 2, 3, 1][..], &[0, 1, 2, 3, 1, 6]] {
        let error = split.clone().with_smooth_normals_across(wrong);
        assert_eq!(error.unwrap_err(), ShapeError::Originals { expected: 6 });
    }
}

/// Normals of vertices that a file rounded to six decimals do not shade a flat mesh. Normals that
/// lean by more do.
#[test]
fn rounded_normals_shade_no_flat_mesh() {
    let triangle = vec![[0, 1, 2]];
    let corners = [(0.0, 0.0, 0.0), (1.0, 0.2, 0.3), (0.1, 1.0, -0.4)];
    let corners = corners.map(|(x, y, z)| DVec3::new(x, y, z));
    let exact = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .normalize();
    let rounded = DVec3::from(exact.to_array().map(|x| (x * 1e6).round() / 1e6));
    let shading_normal = |of_vertices: DVec3| {
        let mesh = mesh((corners.to_vec(), triangle.clone()));
        let shape = Shape::from(mesh.with_normals(vec![of_vertices; 3]).unwrap());
        let sample = shape.sample_area([0.4, 0.3]);
        (
            sample.normal,
            shape.shading_normal(&shape.site_of(&sample), sample.normal),
        )
    };
    let (normal, shading) = shading_normal(rounded);
    assert!(rounded != exact && shading == normal);
    let leaning = exact + exact.any_orthonormal_vector() * 1e-4;
    let (normal, shading) = shading_normal(leaning);
    assert!((shading.angle_between(normal) - 1e-4).abs() < 1e-7);
}

/// Thousands of coincident triangles are met like a single one. Neither the time nor the stack
/// grows with the square of their number.
#[test]
fn thousands_of_triangles_in_one_place() {
    const COUNT: usize = 30_000;
    let at = |x: f64, y: f64| DVec3::new(x, y, 5.0);
    let size = |i: usize| (i + 1) as f64 / COUNT as f64;
    let same = (
        vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)],
        vec![[0, 1, 2]; COUNT],
    );
    let corners = (0..COUNT).flat_map(|i| [at(size(i), 0.0), at(0.0, size(i))]);
    let nested = (
        [at(0.0, 0.0)].into_iter().chain(corners).collect(),
        (0..COUNT as u32)
            .map(|i| [0, 2 * i + 1, 2 * i + 2])
            .collect(),
    );
    let ends = (0..COUNT).map(|i| at(0.0, size(i)));
    let fan = (
        [at(0.0, 0.0), at(1.0, 0.0)]
            .into_iter()
            .chain(ends)
            .collect(),
        (0..COUNT as u32).map(|i| [0, 1, i + 2]).collect(),
    );
    let started = std::time::Instant::now();
    // The first triangle with x + y < size, or x + y/size < 1, at the point (0.3, 0.2).
    let cases = [
        (same, 0),
        (nested, COUNT / 2 - 1),
        (fan, (0.2 / 0.7 * COUNT as f64) as usize),
    ];
    for (triangles, first) in cases {
        let shape: Shape = mesh(triangles).into();
        let line = Arc::line(DVec3::new(0.3, 0.2, 0.0), DVec3::new(0.0, 0.0, 8.0), 1.0);
        let hit = shape.first_hit(&line, 0.0, 1.0).unwrap();
        assert!((hit.theta - 0.625).abs() < 1e-12);
        assert!(hit.primitive as usize + 1 >= first, "{}", hit.primitive);
        let beside = Arc::line(DVec3::new(0.7, 0.6, 0.0), DVec3::new(0.0, 0.0, 8.0), 1.0);
        assert!(shape.first_hit(&beside, 0.0, 1.0).is_none());
    }
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
}
