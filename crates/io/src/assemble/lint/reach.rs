//! Check for grids and tables that end inside the shape whose medium they describe.

use super::super::placed_grid::{Placed, Quantity};
use crate::diagnostic::{Diagnostic, Diagnostics, lints};
use eikonal::Aabb;
use glam::{DAffine3, DVec3};
use transport::scene::Object;

/// Fraction of the largest side by which a shape may extend beyond a grid without a warning. It
/// covers the rounding in files.
const MAX_EXCESS: f64 = 1e-3;

/// Warns about each grid beyond which a shape with the grid's medium extends, once per grid.
pub(in super::super) fn warnings(
    grids: &[Placed],
    objects: &[Object],
    diagnostics: &mut Diagnostics,
) {
    for grid in grids {
        let inside = |o: &&Object| o.interior() == grid.medium && o.shape.is_closed();
        let beyond = |o: &&Object| is_beyond(&o.shape.aabb(), &grid.to_world);
        let mut shapes = objects.iter().filter(inside);
        if let (Some(_), Some(object)) = (grid.medium, shapes.find(beyond)) {
            diagnostics.push(warning(grid, &object.name));
        }
    }
}

/// Returns true if a box extends beyond the bounding box of the image of the unit cube.
fn is_beyond(shape: &Aabb, to_world: &DAffine3) -> bool {
    let cube = Aabb::new(DVec3::ZERO, DVec3::ONE).corners();
    let grid = Aabb::around(cube.map(|p| to_world.transform_point3(p)));
    let side = |of: &Aabb| (of.max - of.min).max_element();
    // Use the smaller size: tables are infinite across their coordinate.
    let slack = MAX_EXCESS * side(&grid).min(side(shape));
    let low = (grid.min - shape.min).max_element();
    let high = (shape.max - grid.max).max_element();
    low.max(high) > slack
}

fn warning(grid: &Placed, shape: &str) -> Diagnostic {
    let (message, help) = match grid.quantity {
        Quantity::Extinction => (
            format!(
                "the grid of the extinction ends inside of '{shape}': the medium is clear beyond it"
            ),
            "give shape and grid equal sizes, or silence this check",
        ),
        Quantity::Index => (
            format!(
                "the grid of the index ends inside of '{shape}': the index is continued over one spacing, and is constant beyond"
            ),
            "make the shape at most as large as the grid: there are no measurements beyond",
        ),
        Quantity::Table => (
            format!(
                "the table of the index ends inside of '{shape}': the index is continued as a parabola"
            ),
            "extend the table to the size of the shape: there are no measurements beyond",
        ),
    };
    let warning = lints::warning(lints::SMALL_GRID, message).help(String::from(help));
    warning.at(&grid.location)
}
