//! Regions that media fill: bounds of the field, and uniqueness of connections inside.
//!
//! Theory: docs/theory.md#certificate.

use super::parts::{AMBIENT, MediumId, Object, Parts};
use crate::emitter::Surroundings;
use crate::shape::Shape;
use crate::stop::Stop;
use eikonal::{Aabb, Field, FieldBounds, Uniqueness};

/// Number of refinements of boxes that straddle a shape's boundary.
const LEVELS: u32 = 4;
/// Margin around a medium for the bounds of its field, relative to the size of the medium.
const MARGIN: f64 = 1e-3;

/// Region that a medium fills.
#[derive(Clone, Debug)]
pub struct Region {
    /// A box around the region; empty if no object holds the medium.
    pub aabb: Aabb,
    /// Bounds of the field over the region.
    pub bounds: FieldBounds,
    /// Certificate of the uniqueness of connections; `None` if the region is not convex.
    pub uniqueness: Option<Uniqueness>,
}

/// Objects that border on a medium.
#[derive(Clone, Debug, Default)]
struct Borders<'a> {
    /// Objects that the medium fills.
    filled: Vec<&'a Object>,
    /// Surfaces inside divided volumes that have the medium on their exterior side.
    around: Vec<&'a Object>,
    /// True if the medium may reach beyond all objects.
    is_outside: bool,
}

impl Borders<'_> {
    /// Returns true if the medium fills closed shapes and nothing else, except the ambient medium.
    fn are_closed_shapes(&self, id: MediumId) -> bool {
        id != AMBIENT
            && !self.filled.is_empty()
            && self.around.is_empty()
            && self.filled.iter().all(|object| object.shape.is_closed())
    }
}

/// Finds the objects that border on each medium.
fn borders(parts: &Parts) -> Vec<Borders<'_>> {
    let mut borders = vec![Borders::default(); parts.media.len()];
    for (i, object) in parts.objects.iter().enumerate() {
        let Some(sides) = object.sides else { continue };
        borders[sides.interior].filled.push(object);
        let mut partitions = parts.partitions.iter();
        let divided = partitions.find(|partition| partition.objects.contains(&i));
        // Inside a divided volume, both media end at surfaces of the volume.
        // Planted error "labels that reach as far as the scene", found by morgana-io/io::labels::graded_indices_of_labels_hold_inside_their_label:
        // let divided = divided.filter(|_| false);
        match divided {
            Some(volume) if sides.exterior != volume.exterior => {
                borders[sides.exterior].around.push(object);
            }
            _ => borders[sides.exterior].is_outside = true,
        }
    }
    borders
}

/// Computes the regions of all media; leaves out the remaining media once `stop` is raised.
pub(super) fn all(parts: &Parts, around: &Surroundings, stop: &Stop) -> Vec<Region> {
    let region = |(id, borders): (MediumId, &Borders)| {
        let field = &parts.media[id].index;
        region(field, around, id, borders)
    };
    let borders = borders(parts);
    let media = borders.iter().enumerate();
    let media = media.take_while(|_| !stop.is_raised());
    media.map(region).collect()
}

/// Computes the region of a medium.
fn region(field: &Field, around: &Surroundings, id: MediumId, borders: &Borders) -> Region {
    let ball = Aabb::new(around.center, around.center).grown(around.radius);
    let holders = &borders.filled;
    let aabb = holders
        .iter()
        .chain(&borders.around)
        .fold(Aabb::EMPTY, |b, o| b.union(o.shape.aabb()));
    if !borders.are_closed_shapes(id) {
        let is_outside = borders.is_outside || id == AMBIENT;
        let everywhere = if is_outside { ball } else { aabb };
        return Region {
            aabb: everywhere,
            bounds: field.bounds(&everywhere),
            uniqueness: None,
        };
    }
    let within = |margin: f64| {
        if matches!(field, Field::Constant(_)) {
            return field.bounds(&aabb);
        }
        let cells = holders.iter().flat_map(|o| cells(&o.shape, margin));
        let bounds = cells.map(|cell| field.stored_bounds(&cell));
        bounds
            .reduce(FieldBounds::union)
            .unwrap_or_else(|| field.bounds(&aabb))
    };
    let margin = MARGIN * aabb.diagonal();
    let bounds = within(margin);
    let uniqueness = match holders[..] {
        [object] if object.shape.is_convex() => {
            let bulge = bulge(&object.shape, &bounds);
            let diameter = object.shape.diameter();
            let (margin, bounds) = if bulge > margin {
                (bulge, within(bulge))
            } else {
                (margin, bounds)
            };
            Some(Uniqueness::new(aabb.grown(margin), diameter, bounds))
        }
        _ => None,
    };
    Region {
        aabb,
        bounds,
        uniqueness,
    }
}

/// Returns a bound of the distance by which geodesics between points of a convex shape bulge out of
/// a flat side: κD²/8, at most its diameter. A ball contains all geodesics if κD < 2, as the
/// certificate demands.
fn bulge(shape: &Shape, bounds: &FieldBounds) -> f64 {
    match shape {
        Shape::Sphere(_) => 0.0,
        _ => (bounds.kappa() * shape.diameter().powi(2) / 8.0).min(shape.diameter()),
    }
}

/// Returns boxes that cover a closed shape and a margin around it. The boxes leave out corners of
/// the shape's box that are far from the shape.
pub(super) fn cells(shape: &Shape, margin: f64) -> Vec<Aabb> {
    let mut cells = vec![shape.aabb().grown(margin)];
    for _ in 0..LEVELS {
        cells = cells
            .iter()
            .flat_map(octants)
            .filter(|cell| !shape.misses(&cell.grown(margin)))
            .collect();
    }
    cells
}

fn octants(cell: &Aabb) -> [Aabb; 8] {
    let center = cell.center();
    cell.corners().map(|corner| Aabb::new(corner, center))
}
