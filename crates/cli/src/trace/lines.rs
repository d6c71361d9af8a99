//! Rays as lines, for programs that show geometry.

use std::fmt::Write;
use std::ops::Range;
use transport::trace::{Path, TracePoint};

/// A number of a point.
type Scalar = fn(&TracePoint) -> f64;

/// Returns all points, ray by ray.
fn points(paths: &[Path]) -> impl Iterator<Item = &TracePoint> {
    paths.iter().flat_map(|p| &p.points)
}

/// Returns the range of each ray's point numbers, counted from 0 over all rays.
fn ranges(paths: &[Path]) -> impl Iterator<Item = Range<usize>> {
    paths.iter().scan(0, |end, path| {
        let start = *end;
        *end += path.points.len();
        Some(start..*end)
    })
}

fn joined(numbers: impl Iterator<Item = usize>) -> String {
    let numbers: Vec<String> = numbers.map(|n| n.to_string()).collect();
    numbers.join(" ")
}

fn position(point: &TracePoint) -> String {
    let [x, y, z] = point.x.to_array();
    format!("{x} {y} {z}")
}

/// Returns a Wavefront OBJ file with a polyline per ray. (Here and below, writing to a string
/// cannot fail.)
pub fn obj(paths: &[Path]) -> String {
    let mut out = String::new();
    for point in points(paths) {
        let _ = writeln!(out, "v {}", position(point));
    }
    for (ray, range) in ranges(paths).enumerate() {
        // Points are counted from 1.
        let _ = writeln!(out, "o ray{ray}\nl {}", joined(range.map(|i| i + 1)));
    }
    out
}

/// Returns a PLY file. Its vertices have arc length, optical path length, index and optical path
/// difference; its edges have the number of their ray.
pub fn ply(paths: &[Path]) -> String {
    let edges: usize = ranges(paths).map(|r| r.len().saturating_sub(1)).sum();
    let mut out = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property double arc_length\nproperty double opl\nproperty double index\nproperty double opd\n\
         element edge {edges}\nproperty int vertex1\nproperty int vertex2\nproperty int ray\nend_header\n",
        points(paths).count()
    );
    for p in points(paths) {
        let (length, opl, index) = (p.arc_length, p.optical_length, p.index);
        let opd = p.path_difference;
        let _ = writeln!(out, "{} {length} {opl} {index} {opd}", position(p));
    }
    for (ray, range) in ranges(paths).enumerate() {
        for i in range.skip(1) {
            let _ = writeln!(out, "{} {i} {ray}", i - 1);
        }
    }
    out
}

/// Returns a legacy VTK file of lines. Their points have arc length, optical path length, index,
/// optical path difference and direction.
pub fn vtk(paths: &[Path]) -> String {
    let count = points(paths).count();
    let mut out = format!(
        "# vtk DataFile Version 3.0\nrays\nASCII\nDATASET POLYDATA\nPOINTS {count} double\n"
    );
    for point in points(paths) {
        let _ = writeln!(out, "{}", position(point));
    }
    let _ = writeln!(out, "LINES {} {}", paths.len(), paths.len() + count);
    for range in ranges(paths) {
        let _ = writeln!(out, "{} {}", range.len(), joined(range));
    }
    let _ = writeln!(out, "POINT_DATA {count}");
    let scalars: [(&str, Scalar); 4] = [
        ("arc_length", |p| p.arc_length),
        ("opl", |p| p.optical_length),
        ("index", |p| p.index),
        ("opd", |p| p.path_difference),
    ];
    for (name, value) in scalars {
        let _ = writeln!(out, "SCALARS {name} double 1\nLOOKUP_TABLE default");
        for point in points(paths) {
            let _ = writeln!(out, "{}", value(point));
        }
    }
    let _ = writeln!(out, "VECTORS direction double");
    for point in points(paths) {
        let [x, y, z] = point.direction.to_array();
        let _ = writeln!(out, "{x} {y} {z}");
    }
    out
}
