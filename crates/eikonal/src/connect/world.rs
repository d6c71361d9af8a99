//! What rays travel through, and what they are made of.

use crate::field::Field;
use crate::interface::Rule;
use crate::ray::Arc;
use glam::{DMat3, DVec3};

/// The regions through which rays travel, each with a field, and the interfaces between them.
pub trait World {
    /// Names a region.
    type Region: Copy + PartialEq + std::fmt::Debug;

    /// The field of a region.
    fn field(&self, region: Self::Region) -> &Field;

    /// The first interface that an arc in `region` meets and that rays go on from by a rule. Opaque surfaces are none: a shot passes them, and its owner tests the
    /// final ray for occlusion.
    fn crossing(&self, region: Self::Region, arc: &Arc) -> Option<Crossing<Self::Region>>;

    /// How far a ray that leaves an interface starts off it, so that it does not meet it again: far
    /// below any tolerance, far above round-off.
    fn ray_epsilon(&self) -> f64;
}

/// Where an arc meets an interface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<R> {
    /// Where on the arc, in (0, 1].
    pub theta: f64,
    /// Position.
    pub position: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Shape operator of the surface with respect to `normal`.
    pub shape: DMat3,
    /// How the ray goes on. A refraction that is not possible becomes a (total) reflection; one that is
    /// may become a reflection by choice, see [`Pattern`](super::Pattern).
    pub rule: Rule,
    /// The region beyond.
    pub beyond: R,
    /// Names the surface to the world's owner.
    pub surface: usize,
}

/// What happened where a piece of a ray ended at an interface.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    /// The rule that applied: never `Refract` for a total reflection.
    pub rule: Rule,
    /// Index just beyond the interface, where the ray goes on or not: with the index before, |`before`|,
    /// and the angle it gives Fresnel's reflectance.
    pub far_n: f64,
    /// Names the surface to the world's owner.
    pub surface: usize,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Velocity before.
    pub before: DVec3,
    /// Velocity after.
    pub after: DVec3,
}

/// A piece of a ray within one region.
#[derive(Clone, Copy, Debug)]
pub struct Piece<R> {
    /// The region.
    pub region: R,
    /// The curve, of which only θ ≤ `theta_end` belongs to the ray.
    pub arc: Arc,
    /// See `arc`.
    pub theta_end: f64,
    /// What ended the piece, if that was an interface.
    pub event: Option<Event>,
}

impl<R> Piece<R> {
    /// The curve and the θ where it ends.
    pub fn ends(&self) -> (&Arc, f64) {
        (&self.arc, self.theta_end)
    }

    /// Whether the ray was reflected at the end of the piece.
    pub fn is_reflected(&self) -> bool {
        self.event.is_some_and(|event| event.rule == Rule::Reflect)
    }
}

/// One field that fills all of space.
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
