//! Sampling of points by area.

use crate::shape::support::{KINDS, Kind, Rng, bumpy};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::shape::Shape;
use std::f64::consts::PI;

#[test]
fn samples_lie_on_the_surface_and_have_their_density() {
    let mut rng = Rng(21);
    for kind in KINDS {
        for _ in 0..300 {
            let m = rng.affine();
            let shape = kind.shape(m);
            let s = shape.sample_area(rng.pair());
            let local = m.inverse().transform_point3(s.position);
            assert!(kind.implicit(local).abs() < 1e-14 && kind.margin(local) > -1e-14);
            let pdf = shape.pdf_area(s.position, s.primitive);
            assert!((pdf / s.pdf - 1.0).abs() < 1e-12);
            let again = shape.sample_area(shape.inverse_area(s.position, s.primitive));
            assert_eq!(again.primitive, s.primitive);
            assert!(local.distance(m.inverse().transform_point3(again.position)) < 1e-10);
            assert!((s.normal.length() - 1.0).abs() < 1e-14);
        }
    }
}

/// E[1/pdf] is the area; the standard error comes from the sample.
#[test]
fn reciprocal_densities_average_to_the_area() {
    let mut rng = Rng(22);
    let shapes = KINDS.map(|k| k.shape(rng.affine()));
    for shape in shapes.into_iter().chain([bumpy(2).into()]) {
        let n = 40_000.0;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n as usize {
            let x = shape.sample_area(rng.pair()).pdf.recip();
            sum += x;
            squares += x * x;
        }
        let mean = sum / n;
        let error = ((squares / n - mean * mean).max(0.0) / n).sqrt();
        let bound = 5.0 * error + 1e-9 * mean;
        assert!((mean - shape.area()).abs() < bound, "{shape:?}");
    }
}

#[test]
fn areas_match_closed_forms() {
    // Oblate spheroid a = b = 2, c = 1: 2πa² (1 + (1 − e²)/e · artanh e).
    let m = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(2.0, 2.0, 1.0)));
    let e = 0.75f64.sqrt();
    let spheroid = 8.0 * PI * (1.0 + 0.25 / e * e.atanh());
    for (kind, area) in [
        (Kind::Sphere, spheroid),
        (Kind::Cube, 64.0),
        (Kind::Rectangle, 16.0),
        (Kind::Disk, 4.0 * PI),
        (Kind::EdgeGeometry, 4.0 * PI),
        (Kind::Can, 12.0 * PI),
    ] {
        let found = kind.shape(m).area();
        assert!((found / area - 1.0).abs() < 1e-8, "{kind:?} {found} {area}");
    }
}

/// χ² of the counts in `cells` for equal expectations, over its standard deviation.
fn excess(counts: &[f64]) -> f64 {
    let total: f64 = counts.iter().sum();
    let expected = total / counts.len() as f64;
    let chi2: f64 = counts
        .iter()
        .map(|c| (c - expected).powi(2) / expected)
        .sum();
    let dof = (counts.len() - 1) as f64;
    (chi2 - dof) / (2.0 * dof).sqrt()
}

/// Returns the cell, one of 64 of equal area, of a local point of the shape.
fn cell(kind: Kind, p: DVec3, primitive: u32) -> usize {
    let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    let phi = p.y.atan2(p.x) / (2.0 * PI) + 0.5;
    let unit = |x: f64| 0.5 * (x + 1.0);
    match kind {
        Kind::Sphere => 8 * bin(unit(p.z), 8) + bin(phi, 8),
        Kind::Rectangle => 8 * bin(unit(p.x), 8) + bin(unit(p.y), 8),
        Kind::Disk => 8 * bin(p.truncate().length_squared(), 8) + bin(phi, 8),
        Kind::EdgeGeometry => 8 * bin(p.z, 8) + bin(phi, 8),
        // Side : cap : cap = 2 : 1 : 1 for unit radius and height.
        Kind::Can => match primitive {
            0 => 8 * bin(p.z, 4) + bin(phi, 8),
            1 => 32 + bin(phi, 16),
            _ => 48 + bin(phi, 16),
        },
        Kind::Cube => {
            let k = primitive as usize / 2;
            let (a, b) = (unit(p[(k + 1) % 3]), unit(p[(k + 2) % 3]));
            9 * primitive as usize + 3 * bin(a, 3) + bin(b, 3)
        }
    }
}

#[test]
fn samples_are_uniform_under_similarities() {
    let mut rng = Rng(23);
    for kind in KINDS {
        let m = rng.similarity();
        let (shape, to_local) = (kind.shape(m), m.inverse());
        let mut counts = vec![0.0; if kind == Kind::Cube { 54 } else { 64 }];
        for _ in 0..64_000 {
            let s = shape.sample_area(rng.pair());
            let p = to_local.transform_point3(s.position);
            counts[cell(kind, p, s.primitive)] += 1.0;
        }
        assert!(excess(&counts).abs() < 5.0, "{kind:?} {}", excess(&counts));
    }
}

#[test]
fn mesh_triangles_are_drawn_by_their_area() {
    let mut rng = Rng(24);
    let mesh = bumpy(1);
    let corners = |t: &[u32; 3]| t.map(|v| mesh.positions()[v as usize]);
    let areas: Vec<f64> = mesh
        .triangles()
        .iter()
        .map(corners)
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .collect();
    let shape: Shape = mesh.clone().into();
    let n = 160_000.0;
    let mut counts = vec![0.0; areas.len()];
    for _ in 0..n as usize {
        let s = shape.sample_area(rng.pair());
        counts[s.primitive as usize] += 1.0;
        let a = mesh.positions()[mesh.triangles()[s.primitive as usize][0] as usize];
        assert!(s.normal.dot(s.position - a).abs() < 1e-14);
    }
    let chi2: f64 = areas
        .iter()
        .zip(&counts)
        .map(|(a, c)| (c - n * a / shape.area()).powi(2) / (n * a / shape.area()))
        .sum();
    let dof = areas.len() as f64 - 1.0;
    assert!(((chi2 - dof) / (2.0 * dof).sqrt()).abs() < 5.0);
    assert!((areas.iter().sum::<f64>() / shape.area() - 1.0).abs() < 1e-13);
}
