//! What is known of the region that each medium fills: bounds of its field, and whether connections
//! inside it are unique; and of the ball that is all that bends rays in some scenes.
//!
//! Theory: docs/theory.md#certificate.

use super::parts::{AMBIENT, MediumId, Object, Parts};
use crate::bsdf::Bsdf;
use crate::emitter::Surroundings;
use crate::shape::Shape;
use eikonal::connect::{Ball, BallRay, RadialBall};
use eikonal::{Aabb, FieldBounds, Uniqueness};
use glam::DVec3;

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

/// A smooth ball that, with the field inside, is all that bends rays in a scene, in ambience of constant index.
#[derive(Clone, Debug)]
pub(crate) struct GlassBall {
    /// The ball, of the index at its surface.
    pub ball: Ball,
    /// The medium inside.
    pub interior: MediumId,
    /// What its field is nearly, if it bends rays.
    pub lens: Option<RadialBall>,
    /// Index inside and outside.
    indices: [f64; 2],
}

/// Relative differences of a ball's extents below this are those of rounding.
const ROUND: f64 = 1e-9;

impl GlassBall {
    /// Optical length of the straight way outside from a point of the surface to another point.
    pub(crate) fn outside(&self, p: DVec3, to: DVec3) -> f64 {
        self.indices[1] * p.distance(to)
    }

    /// The straight ray from a point inside to one of the surface.
    pub(crate) fn straight(&self, x: DVec3, crossing: DVec3) -> BallRay {
        let way = crossing - x;
        BallRay {
            crossing,
            direction: way.normalize_or_zero(),
            optical_length: self.indices[0] * way.length(),
        }
    }
}

/// The ball that is all that bends rays, if that is so: media around it are constant, there is one smooth
/// interface, and on either side of it one medium. `overlapping` tells of each object whether others are near.
pub(super) fn glass_ball(parts: &Parts, overlapping: &[bool]) -> Option<GlassBall> {
    let is_glass = |o: &Object| matches!(o.bsdf, Bsdf::Dielectric(_));
    let place = parts.objects.iter().position(is_glass)?;
    let object = &parts.objects[place];
    let bounded = |o: &Object| {
        let surrounded = |s: super::Sides| o.shape.is_closed() && s.exterior == AMBIENT;
        o.sides.is_none_or(surrounded)
    };
    let simple = parts.objects.iter().filter(|o| is_glass(o)).count() == 1
        && parts.objects.iter().all(bounded)
        && !overlapping[place]
        && matches!(object.shape, Shape::Sphere(_));
    // Each extent of an ellipsoid is a mean over its axes: all are the longest if it is round.
    let (aabb, diameter) = (object.shape.aabb(), object.shape.diameter());
    let extents = aabb.max - aabb.min;
    let round = (extents - diameter).abs().max_element() < ROUND * diameter;
    let interior = object.interior().filter(|_| simple && round)?;
    let mut media = parts.media.iter().enumerate();
    if !media.all(|(id, medium)| id == interior || medium.index.is_constant()) {
        return None;
    }
    let (center, radius) = (aabb.center(), 0.5 * diameter);
    let outside = parts.media[AMBIENT].index.n(center);
    let field = &parts.media[interior].index;
    let lens = if field.is_constant() {
        None
    } else {
        Some(RadialBall::new(field, center, radius, outside)?)
    };
    let ball = match &lens {
        Some(lens) => lens.surface(),
        None => Ball {
            center,
            radius,
            ratio: field.n(center) / outside,
        },
    };
    Some(GlassBall {
        ball,
        interior,
        lens,
        indices: [ball.ratio * outside, outside],
    })
}

/// Surveys the regions of all media.
pub(super) fn all(parts: &Parts, around: &Surroundings) -> Vec<Region> {
    (0..parts.media.len())
        .map(|id| region(parts, around, id))
        .collect()
}

fn region(parts: &Parts, around: &Surroundings, id: MediumId) -> Region {
    let field = &parts.media[id].index;
    let ball = Aabb::new(around.center, around.center).grown(around.radius);
    let holders: Vec<&Object> = parts
        .objects
        .iter()
        .filter(|o| o.interior() == Some(id))
        .collect();
    let outside = parts
        .objects
        .iter()
        .any(|o| o.sides.is_some_and(|s| s.exterior == id));
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
        let cells = holders.iter().flat_map(|o| cells(&o.shape, margin));
        let bounds = cells.map(|cell| field.bounds(&cell));
        bounds
            .reduce(FieldBounds::union)
            .unwrap_or_else(|| field.bounds(&aabb))
    };
    let margin = MARGIN * aabb.diagonal();
    let bounds = within(margin);
    let uniqueness = match holders[..] {
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
fn cells(shape: &Shape, margin: f64) -> Vec<Aabb> {
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
