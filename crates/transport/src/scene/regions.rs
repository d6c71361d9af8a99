//! What is known of the region that each medium fills: bounds of its field, and whether connections
//! inside it are unique.
//!
//! Theory: docs/theory.md#certificate.

use super::parts::{AMBIENT, MediumId, Object, Parts};
use crate::emitter::Surroundings;
use crate::shape::Shape;
use crate::stop::Stop;
use eikonal::{Aabb, Field, FieldBounds, Uniqueness};

/// Boxes that are refined this many times where they straddle a shape's boundary.
const LEVELS: u32 = 4;
/// Bounds are taken over the medium and this margin around it, relative to its size.
const MARGIN: f64 = 1e-3;

/// The region that a medium fills.
#[derive(Clone, Debug)]
pub struct Region {
    /// A box around it; empty if no object holds the medium.
    pub aabb: Aabb,
    /// Bounds of the field over it.
    pub bounds: FieldBounds,
    /// What is known of the uniqueness of connections; `None` if the region is not convex.
    pub uniqueness: Option<Uniqueness>,
}

/// Surveys the regions of all media; of those that are left once `stop` is raised, none.
pub(super) fn all(parts: &Parts, around: &Surroundings, stop: &Stop) -> Vec<Region> {
    let mut holders: Vec<Vec<&Object>> = vec![Vec::new(); parts.media.len()];
    let mut is_outside = vec![false; parts.media.len()];
    for object in &parts.objects {
        if let Some(sides) = object.sides {
            holders[sides.interior].push(object);
            is_outside[sides.exterior] = true;
        }
    }
    let region = |(id, holders): (MediumId, &Vec<&Object>)| {
        let field = &parts.media[id].index;
        region(field, around, id, holders, is_outside[id])
    };
    let media = holders.iter().enumerate();
    let media = media.take_while(|_| !stop.is_raised());
    media.map(region).collect()
}

/// The region of a medium that objects hold; with `outside`, it is around others.
fn region(
    field: &Field,
    around: &Surroundings,
    id: MediumId,
    holders: &[&Object],
    outside: bool,
) -> Region {
    let ball = Aabb::new(around.center, around.center).grown(around.radius);
    let aabb = holders
        .iter()
        .fold(Aabb::EMPTY, |b, o| b.union(o.shape.aabb()));
    if id == AMBIENT || holders.is_empty() || holders.iter().any(|o| !o.shape.is_closed()) {
        let everywhere = if outside || id == AMBIENT { ball } else { aabb };
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
        let bounds = cells.map(|cell| field.bounds(&cell));
        bounds
            .reduce(FieldBounds::union)
            .unwrap_or_else(|| field.bounds(&aabb))
    };
    let margin = MARGIN * aabb.diagonal();
    let bounds = within(margin);
    let uniqueness = match *holders {
        [object] if object.shape.is_convex() => {
            let margin = margin.max(bulge(&object.shape, &bounds));
            let diameter = object.shape.diameter();
            Some(Uniqueness::new(
                aabb.grown(margin),
                diameter,
                within(margin),
            ))
        }
        _ => None,
    };
    Region {
        aabb,
        bounds,
        uniqueness,
    }
}

/// How far geodesics between points of a convex shape may bulge out of a flat side: κD²/8, no more
/// than its size. A ball holds them all if κD < 2, as the certificate demands.
fn bulge(shape: &Shape, bounds: &FieldBounds) -> f64 {
    match shape {
        Shape::Sphere(_) => 0.0,
        _ => (bounds.kappa() * shape.diameter().powi(2) / 8.0).min(shape.diameter()),
    }
}

/// Boxes that cover a closed shape and a margin around it, tightly enough that corners of its box far
/// from the shape do not count.
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
