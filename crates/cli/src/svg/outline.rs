//! Sections of shapes.

use super::colour::INK;
use super::view::View;
use eikonal::Aabb;
use std::collections::HashMap;
use std::fmt::Write;
use transport::Scene;
use transport::shape::Shape;

/// Side of a cell in the search for boundaries, in pixels of the page.
const CELL: f64 = 5.0;
/// Number of bisections that locate a boundary between two corners of a cell.
const HALVINGS: u32 = 10;

/// A position on the page, in pixels.
type PagePoint = [f64; 2];
/// A side of a cell: its first corner, and true if it goes down, false if it goes right.
type Side = (usize, usize, bool);

/// Draws the outlines of all objects in the plane of the view. Open shapes are drawn as boxes, and
/// closed shapes outside the plane as dashed boxes.
pub fn outlines(scene: &Scene, view: &View) -> String {
    let mut out = format!(
        "<g fill=\"none\" stroke=\"{INK}\" stroke-opacity=\"0.75\" stroke-width=\"1.4\" \
         stroke-linejoin=\"round\" stroke-linecap=\"round\">\n"
    );
    for object in scene.objects() {
        let shape = &object.shape;
        let section = if shape.is_closed() {
            section(shape, view)
        } else {
            String::new()
        };
        if !section.is_empty() {
            let _ = writeln!(out, "<path d=\"{section}\"/>");
        } else {
            out.push_str(&outline_box(&shape.aabb(), shape.is_closed(), view));
        }
    }
    out.push_str("</g>\n");
    out
}

fn outline_box(aabb: &Aabb, dashed: bool, view: &View) -> String {
    let [[x0, y1], [x1, y0]] = [view.place(aabb.min), view.place(aabb.max)];
    let dash = if dashed {
        " stroke-dasharray=\"5 4\" stroke-opacity=\"0.4\""
    } else {
        ""
    };
    format!("<path d=\"M{x0:.2},{y0:.2}H{x1:.2}V{y1:.2}H{x0:.2}Z\"{dash}/>\n")
}

/// Returns the boundary of a closed shape in the plane of the view as a path. Marching squares find
/// it, and bisection locates its corners.
fn section(shape: &Shape, view: &View) -> String {
    let size = view.size();
    // Add a cell on every side, so that shapes that touch the frame are closed outside it.
    let [columns, rows] = size.map(|s| (s / CELL).ceil() as usize + 3);
    let corner = |i: usize, j: usize| [(i as f64 - 1.0) * CELL, (j as f64 - 1.0) * CELL];
    let contains = |p: PagePoint| shape.contains(view.point(p));
    let inside: Vec<bool> = (0..columns * rows)
        .map(|k| contains(corner(k % columns, k / columns)))
        .collect();
    let at = |i: usize, j: usize| inside[j * columns + i];
    let mut next: HashMap<Side, Vec<Side>> = HashMap::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let sides = [
                (i, j, false),
                (i + 1, j, true),
                (i, j + 1, false),
                (i, j, true),
            ];
            let cut: Vec<Side> = (0..4)
                .filter(|&k| corners[k] != corners[(k + 1) % 4])
                .map(|k| sides[k])
                .collect();
            for pair in cut.chunks_exact(2) {
                next.entry(pair[0]).or_default().push(pair[1]);
                next.entry(pair[1]).or_default().push(pair[0]);
            }
        }
    }
    let crossing = |(i, j, down): Side| {
        let (a, b) = (
            corner(i, j),
            if down {
                corner(i, j + 1)
            } else {
                corner(i + 1, j)
            },
        );
        bisect(&contains, a, b)
    };
    let mut starts: Vec<Side> = next.keys().copied().collect();
    starts.sort_unstable();
    starts
        .into_iter()
        .map(|start| chain(start, &mut next, &crossing))
        .collect()
}

/// Locates the boundary between two corners: one is inside, the other outside.
fn bisect(contains: &impl Fn(PagePoint) -> bool, mut a: PagePoint, mut b: PagePoint) -> PagePoint {
    let side = contains(a);
    for _ in 0..HALVINGS {
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        if contains(middle) == side {
            a = middle;
        } else {
            b = middle;
        }
    }
    a
}

/// Returns a line from `start` through linked sides, and removes it from `next`; empty if none is
/// left.
fn chain(
    start: Side,
    next: &mut HashMap<Side, Vec<Side>>,
    place: &impl Fn(Side) -> PagePoint,
) -> String {
    let mut path = String::new();
    let mut side = start;
    while let Some(link) = next.get_mut(&side).and_then(Vec::pop) {
        if path.is_empty() {
            let [x, y] = place(start);
            let _ = write!(path, "M{x:.2},{y:.2}");
        }
        if let Some(back) = next.get_mut(&link) {
            back.retain(|s| *s != side);
        }
        let [x, y] = place(link);
        let _ = write!(path, "L{x:.2},{y:.2}");
        side = link;
    }
    if !path.is_empty() && side == start {
        path.push('Z');
    }
    path
}
