//! The smooth ball that, with the field inside, is all that bends rays in some scenes.
//!
//! Theory: docs/theory.md#through-a-ball, docs/theory.md#through-a-lens, docs/theory.md#certificate.

use super::parts::{AMBIENT, MediumId, Object, Parts};
use super::regions::{Region, cells};
use crate::bsdf::Bsdf;
use crate::shape::Shape;
use eikonal::connect::{Ball, BallRay, RadialBall};
use eikonal::{Aabb, Field};
use glam::DVec3;

/// Relative differences of a ball's extents below this are those of rounding.
const ROUND: f64 = 1e-9;

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
    /// Every ray leaves that passes through a point where the index times the distance from the centre is no more.
    lets_out: f64,
}

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

    /// Whether it is known that no ray between two points, at one of which the index is `n`, is reflected totally, and no two rays
    /// within the ball join them.
    pub(crate) fn is_unique(&self, [x, y]: [DVec3; 2], n: impl Fn(DVec3) -> f64) -> bool {
        let lets_out = |p: DVec3| n(p) * p.distance(self.ball.center) <= self.lets_out;
        self.ball.contains(x) && self.ball.contains(y) && (lets_out(x) || lets_out(y))
    }
}

/// The ball that is all that bends rays, if that is so: media around it are constant, there is one smooth
/// interface, and on either side of it one medium. `overlapping` tells of each object whether others are near.
pub(super) fn glass_ball(
    parts: &Parts,
    overlapping: &[bool],
    regions: &[Region],
) -> Option<GlassBall> {
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
    // A field may bend rays in this ball only.
    let holders = parts.objects.iter();
    let holders = holders.filter(|o| o.interior() == Some(interior)).count();
    let is_lens = !parts.media[interior].index.is_constant();
    let mut media = parts.media.iter().enumerate();
    let others = media.all(|(id, medium)| id == interior || medium.index.is_constant());
    if !others || (is_lens && holders > 1) {
        return None;
    }
    let (center, radius) = (aabb.center(), 0.5 * diameter);
    let outside = parts.media[AMBIENT].index.n(center);
    let field = &parts.media[interior].index;
    let lens = if is_lens {
        Some(RadialBall::new(field, center, radius, outside)?)
    } else {
        None
    };
    let ball = match &lens {
        Some(lens) => lens.surface(),
        None => Ball {
            center,
            radius,
            ratio: field.n(center) / outside,
        },
    };
    let lets_out = match &lens {
        Some(_) => outside * radius - drift(field, &ball, &object.shape, &regions[interior]),
        None => outside * radius,
    };
    Some(GlassBall {
        ball,
        interior,
        lens,
        indices: [ball.ratio * outside, outside],
        lets_out,
    })
}

/// How much n·r·sin(angle to the radius) can change along a ray on its way to the surface, which it would not in a radial
/// field: by the integral of |r × ½∇n²| over σ. Infinite unless no two rays within the ball join two points.
fn drift(field: &Field, ball: &Ball, shape: &Shape, region: &Region) -> f64 {
    let certificate = region.uniqueness.as_ref();
    let Some(certificate) = certificate.filter(|certificate| certificate.whole_medium()) else {
        return f64::INFINITY;
    };
    let across = |cell: Aabb| {
        // ∇n² changes within a cell by no more than the Hessian times the distance from its centre.
        let (bounds, h) = (field.bounds(&cell), 0.5 * cell.diagonal());
        let (_, gradient) = field.gradient(cell.center());
        let arm = cell.center() - ball.center;
        let change = bounds.hess_max.abs().max(bounds.hess_min.abs()) * h;
        arm.cross(gradient).length() + h * gradient.length() + (arm.length() + h) * change
    };
    let most = cells(shape, 0.0).into_iter().map(across);
    // What is not known is no bound.
    let most = most.fold(0.0, |most: f64, a| {
        if a.is_nan() {
            f64::INFINITY
        } else {
            most.max(a)
        }
    });
    0.5 * most * certificate.longest_ray() / certificate.bounds().n_min()
}
