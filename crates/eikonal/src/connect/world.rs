//! Regions and interfaces through which rays travel, and pieces of rays.

use crate::field::Field;
use crate::interface::Rule;
use crate::ray::Arc;
use glam::{DMat3, DVec3};

/// The regions through which rays travel, each with a field, and the interfaces between them.
pub trait World {
    /// Identifier of a region.
    type Region: Copy + PartialEq + std::fmt::Debug;

    /// Returns the field of a region.
    fn field(&self, region: Self::Region) -> &Field;

    /// Returns the first interface with a rule for rays that an arc in `region` meets. Opaque
    /// surfaces have no rule: rays pass them, and the caller tests the final ray for occlusion.
    fn crossing(&self, region: Self::Region, arc: &Arc) -> Option<Crossing<Self::Region>>;

    /// Returns the distance from an interface at which rays that leave it start. Rays then do not
    /// intersect the interface again. The distance is far below any tolerance, and far above
    /// round-off.
    fn ray_epsilon(&self) -> f64;
}

/// Intersection of an arc with an interface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<R> {
    /// Parameter on the arc, in (0, 1].
    pub theta: f64,
    /// Position.
    pub position: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Shape operator of the surface with respect to `normal`.
    pub shape: DMat3,
    /// Rule by which the ray continues. An impossible refraction becomes a total reflection; a
    /// possible one may become a reflection by choice, see [`Pattern`](super::Pattern).
    pub rule: Rule,
    /// Region behind the interface.
    pub beyond: R,
    /// Identifier of the surface, for the owner of the world.
    pub surface: usize,
}

/// Event at an interface where a piece of a ray ended.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    /// Rule that applied; never `Refract` for a total reflection.
    pub rule: Rule,
    /// Index just beyond the interface, even if the ray does not continue there. With |`before`|,
    /// the index before the interface, and the angle, it determines Fresnel's reflectance.
    pub far_n: f64,
    /// Identifier of the surface, for the owner of the world.
    pub surface: usize,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Velocity before the interface.
    pub before: DVec3,
    /// Velocity after the interface.
    pub after: DVec3,
}

/// A piece of a ray within one region.
#[derive(Clone, Copy, Debug)]
pub struct Piece<R> {
    /// Region in which the piece lies.
    pub region: R,
    /// Curve of the piece; only θ ≤ `theta_end` belongs to the ray.
    pub arc: Arc,
    /// Largest θ of `arc` that belongs to the ray.
    pub theta_end: f64,
    /// Interface event that ended the piece, if any.
    pub event: Option<Event>,
}

impl<R> Piece<R> {
    /// Returns the curve and the θ where the piece ends.
    pub fn ends(&self) -> (&Arc, f64) {
        (&self.arc, self.theta_end)
    }

    /// Returns true if the ray was reflected at the end of the piece.
    pub fn is_reflected(&self) -> bool {
        self.event.is_some_and(|event| event.rule == Rule::Reflect)
    }
}

/// A field that fills all of space.
#[derive(Clone, Copy, Debug)]
pub struct Unbounded<'a>(pub &'a Field);

impl World for Unbounded<'_> {
    type Region = ();

    fn field(&self, (): ()) -> &Field {
        self.0
    }

    fn crossing(&self, (): (), _: &Arc) -> Option<Crossing<()>> {
        None
    }

    fn ray_epsilon(&self) -> f64 {
        0.0
    }
}
