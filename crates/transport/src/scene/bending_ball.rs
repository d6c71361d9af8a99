//! Scenes in which a single ball bends rays, by its smooth surface or the field inside.
//!
//! Theory: docs/theory.md#through-a-ball, docs/theory.md#through-a-lens,
//! docs/theory.md#certificate.

use super::parts::{AMBIENT, MediumId, Object, Parts};
use super::regions::{Region, cells};
use crate::bsdf::Bsdf;
use crate::medium::Medium;
use crate::shape::Shape;
use eikonal::connect::{Ball, BallRay, RadialBall};
use eikonal::{Aabb, Field};
use glam::DVec3;

/// Relative tolerance for rounding, of a ball's extents and of indices.
const ROUND_OFF: f64 = 1e-9;
/// Relative tolerance of two approximations: an index that is continuous at a ball's surface, and
/// an index that equals its mean over spheres. Rays of the mean field are first guesses of other
/// rays.
const INDEX_TOLERANCE: f64 = 1e-2;

/// Ball that is the only part of a scene that bends rays, by its smooth surface or the field
/// inside. The surroundings have constant index.
#[derive(Clone, Debug)]
pub(crate) struct BendingBall {
    /// The ball, with the index at its surface.
    pub ball: Ball,
    /// Medium inside the ball.
    pub interior: MediumId,
    /// Radial approximation of the field inside, if the field bends rays.
    pub lens: Option<RadialBall>,
    /// True if rays pass the surface of the ball straight on.
    pub matched: bool,
    /// Indices inside and outside.
    indices: [f64; 2],
    /// Largest index times distance from the centre at a point for which every ray through the
    /// point is known to leave the ball.
    leaving_limit: f64,
    /// Distance from the centre within which every point meets the condition of `leaving_limit`.
    leaving_radius: f64,
}

impl BendingBall {
    /// Returns the optical length of the straight segment outside from a point `p` of the surface
    /// to `to`.
    pub(crate) fn outside(&self, p: DVec3, to: DVec3) -> f64 {
        self.indices[1] * p.distance(to)
    }

    /// Returns true if all of the ball lies in front of a plane.
    pub(crate) fn is_before(&self, through: DVec3, direction: DVec3) -> bool {
        (self.ball.center - through).dot(direction) > self.ball.radius
    }

    /// Returns true if the straight segment between two points misses the ball.
    pub(crate) fn is_missed(&self, [x, y]: [DVec3; 2]) -> bool {
        let (way, arm) = (y - x, self.ball.center - x);
        let share = (arm.dot(way) / way.length_squared()).clamp(0.0, 1.0);
        (arm - way * share).length() >= self.ball.radius
    }

    /// Returns the straight ray from a point inside to a point of the surface.
    pub(crate) fn straight(&self, x: DVec3, crossing: DVec3) -> BallRay {
        let way = crossing - x;
        BallRay {
            crossing,
            direction: way.normalize_or_zero(),
            optical_length: self.indices[0] * way.length(),
        }
    }

    /// Returns true if it is known that no ray between two points is reflected totally, and that at
    /// most one ray within the ball joins them. `n` is the index as a function of position.
    pub(crate) fn is_unique(&self, ends: [DVec3; 2], n: impl Fn(DVec3) -> f64) -> bool {
        let off = ends.map(|p| p.distance(self.ball.center));
        let leaves_ball = |i: usize| n(ends[i]) * off[i] <= self.leaving_limit;
        // Planted error "pairs inside a lens certified that total reflections join", found by morgana-transport/transport::lens::pairs_inside_that_are_certified_have_one_ray:
        // let leaves = || off[0].min(off[1]) <= 2.0 * self.leaving_radius || leaves_ball(0) || leaves_ball(1);
        let leaves =
            || off[0].min(off[1]) <= self.leaving_radius || leaves_ball(0) || leaves_ball(1);
        ends.into_iter().all(|p| self.ball.contains(p)) && leaves()
    }
}

/// Returns the only part of the scene that bends rays, if it is a ball and the media around it are
/// constant. Either its surface is the only smooth interface, or there is no smooth interface and
/// the index is continuous. `overlapping` is true for each object with other objects near it.
pub(super) fn bending_ball(
    parts: &Parts,
    overlapping: &[bool],
    regions: &[Region],
) -> Option<BendingBall> {
    match parts.objects.iter().position(is_glass) {
        Some(place) => smooth_ball(parts, place, overlapping, regions),
        None => matched_ball(parts),
    }
}

fn is_glass(o: &Object) -> bool {
    matches!(o.bsdf, Bsdf::Dielectric(_))
}

/// Returns centre and radius of a sphere; `None` for other shapes and for ellipsoids.
fn round(shape: &Shape) -> Option<(DVec3, f64)> {
    // Each extent of an ellipsoid is a mean over its axes. All extents equal the longest axis if it
    // is round.
    let (aabb, diameter) = (shape.aabb(), shape.diameter());
    let extents = aabb.max - aabb.min;
    let is_round = (extents - diameter).abs().max_element() < ROUND_OFF * diameter;
    (matches!(shape, Shape::Sphere(_)) && is_round).then(|| (aabb.center(), 0.5 * diameter))
}

/// Returns the ball that the only field fills. The field must be nearly radial, and its index at
/// the surface must equal the index of all other media.
fn matched_ball(parts: &Parts) -> Option<BendingBall> {
    let mut fields = (0..parts.media.len()).filter(|id| !parts.media[*id].index.is_constant());
    let interior = fields.next().filter(|_| fields.next().is_none())?;
    let mut holders = parts
        .objects
        .iter()
        .filter(|o| o.interior() == Some(interior));
    let object = holders.next().filter(|_| holders.next().is_none())?;
    let (center, radius) = round(&object.shape)?;
    let around = object.sides?.exterior;
    if around == interior || !matches!(object.bsdf, Bsdf::Null) {
        return None;
    }
    let outside = parts.media[around].index.n(center);
    let is_alike = |(id, medium): (MediumId, &Medium)| {
        id == interior || (medium.index.n(center) / outside - 1.0).abs() < ROUND_OFF
    };
    let within = |o: &Object| {
        let inside = |p: DVec3| p.distance(center) < radius;
        o.sides.is_some_and(|s| s.interior != interior)
            && inside(o.shape.aabb().center())
            && o.shape.diameter() < 2.0 * radius
    };
    if !parts.media.iter().enumerate().all(is_alike) || parts.objects.iter().any(within) {
        return None;
    }
    let lens = RadialBall::new(&parts.media[interior].index, center, radius, outside)?;
    let ball = lens.surface();
    let nearly = lens.deviation() < INDEX_TOLERANCE && (ball.ratio - 1.0).abs() < INDEX_TOLERANCE;
    nearly.then_some(BendingBall {
        ball,
        interior,
        lens: Some(lens),
        matched: true,
        indices: [outside; 2],
        leaving_limit: f64::NEG_INFINITY,
        leaving_radius: f64::NEG_INFINITY,
    })
}

/// Returns the ball of a smooth interface.
fn smooth_ball(
    parts: &Parts,
    place: usize,
    overlapping: &[bool],
    regions: &[Region],
) -> Option<BendingBall> {
    let object = &parts.objects[place];
    let bounded = |o: &Object| {
        let surrounded = |s: super::Sides| o.shape.is_closed() && s.exterior == AMBIENT;
        o.sides.is_none_or(surrounded)
    };
    let simple = parts.objects.iter().filter(|o| is_glass(o)).count() == 1
        && parts.objects.iter().all(bounded)
        && !overlapping[place];
    let (center, radius) = round(&object.shape)?;
    let interior = object.interior().filter(|_| simple)?;
    // A field may bend rays only in this ball.
    let holders = parts.objects.iter();
    let holders = holders.filter(|o| o.interior() == Some(interior)).count();
    let is_lens = !parts.media[interior].index.is_constant();
    let mut media = parts.media.iter().enumerate();
    let others = media.all(|(id, medium)| id == interior || medium.index.is_constant());
    if !others || (is_lens && holders > 1) {
        return None;
    }
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
    let leaving_limit = match &lens {
        Some(_) => outside * radius - drift(field, &ball, &object.shape, &regions[interior]),
        None => outside * radius,
    };
    Some(BendingBall {
        ball,
        interior,
        lens,
        matched: false,
        indices: [ball.ratio * outside, outside],
        leaving_limit,
        leaving_radius: leaving_limit / field.bounds(&object.shape.aabb()).n_max(),
    })
}

/// Returns a bound of the change of n·r·sin(angle to the radius) along a ray before it reaches the
/// surface. The change is zero in a radial field; the bound is the integral of |r × ½∇n²| over σ.
/// Returns infinity unless at most one ray within the ball joins two points.
fn drift(field: &Field, ball: &Ball, shape: &Shape, region: &Region) -> f64 {
    let certificate = region.uniqueness.as_ref();
    let Some(certificate) = certificate.filter(|certificate| certificate.whole_medium()) else {
        return f64::INFINITY;
    };
    let across = |cell: Aabb| {
        // Within a cell, ∇n² changes by at most the Hessian times the distance from the centre of
        // the cell.
        let (bounds, h) = (field.stored_bounds(&cell), 0.5 * cell.diagonal());
        let (_, gradient) = field.gradient(cell.center());
        let arm = cell.center() - ball.center;
        let change = bounds.hess_max.abs().max(bounds.hess_min.abs()) * h;
        arm.cross(gradient).length() + h * gradient.length() + (arm.length() + h) * change
    };
    let most = cells(shape, 0.0).into_iter().map(across);
    // Treat an unknown value as infinite.
    let most = most.fold(0.0, |most: f64, a| {
        if a.is_nan() {
            f64::INFINITY
        } else {
            most.max(a)
        }
    });
    0.5 * most * certificate.longest_ray() / certificate.bounds().n_min()
}
