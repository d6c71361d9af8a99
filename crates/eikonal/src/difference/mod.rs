//! Optical path differences: the optical length of a ray minus the optical length of reference rays
//! between its ends.
//!
//! The integrand is as small as the contrast, so that nothing cancels. The integral is Hamilton's
//! action minus the action of the reference ray. It is stationary in the path between the ends, so
//! that an error of the path has only a second-order effect. Steps of rays are chosen for
//! positions, and in weak fields are far longer than the scale on which the contrast varies. The
//! integral therefore has its own error control.
//!
//! Theory: docs/theory.md#optical-path-difference.

mod curved;
mod quadrature;
mod straight;

use crate::field::Field;
use crate::ray::{Arc, Work};
use curved::CurvedSegment;
use glam::DVec3;
use quadrature::Quadrature;
use straight::StraightSegment;

/// Reference of optical path differences.
#[derive(Clone, Copy, Debug)]
pub enum Reference<'a> {
    /// A constant index > 0: the rays of the reference are straight.
    Index(f64),
    /// A field that fills all of space.
    Field(&'a Field),
}

/// Optical path difference of a ray, arc by arc: the optical length of the ray minus the optical
/// length of reference rays. The reference rays connect the start of the ray, its points of
/// reflection, and its end.
///
/// The error is about 1e-7 of the largest contrast |n − n_r| on the ray times the length. It does
/// not depend on the tolerance of the ray. Rounding adds 2e-16 of the length.
#[derive(Clone, Debug)]
pub struct PathDifference<'a> {
    /// Path difference of the completed segments.
    done: f64,
    segment: Segment<'a>,
    quadrature: Quadrature,
}

/// Part of a ray since its start or its last reflection.
#[derive(Clone, Debug)]
enum Segment<'a> {
    Straight(StraightSegment),
    Curved(CurvedSegment<'a>),
}

impl<'a> PathDifference<'a> {
    /// Starts the path difference of a ray in the unit direction `toward`.
    pub fn new(reference: Reference<'a>, toward: DVec3) -> Self {
        PathDifference {
            done: 0.0,
            segment: match reference {
                Reference::Index(n) => Segment::Straight(StraightSegment::new(n, toward)),
                Reference::Field(field) => Segment::Curved(CurvedSegment::new(field, toward)),
            },
            quadrature: Quadrature::default(),
        }
    }

    /// Returns the path difference so far, in units of length, against a constant index. Returns
    /// `None` against a field, which needs a search.
    pub fn so_far(&self) -> Option<f64> {
        match &self.segment {
            Segment::Straight(segment) => Some(self.done + segment.value()),
            Segment::Curved(_) => None,
        }
    }

    /// Returns the path difference so far, in units of length. Against a field, this searches for
    /// the reference ray between the ends: the ray to which a search from the ray itself, or else
    /// from the chord, converges. NaN if there is none, or if the computation was abandoned.
    pub fn value(&mut self, work: &mut Work) -> f64 {
        let segment = match &self.segment {
            Segment::Straight(segment) => segment.value(),
            Segment::Curved(segment) => {
                let before = self.quadrature.evaluations;
                let value = segment.value(&mut self.quadrature, work);
                work.evaluations += self.quadrature.evaluations - before;
                value
            }
        };
        self.done + segment
    }

    /// Returns true if the computation was abandoned because a field is too fine; the value is then
    /// NaN.
    pub fn is_over_budget(&self) -> bool {
        self.quadrature.is_over_budget()
    }

    /// Reflects the ray, and the reference rays, into the unit direction `toward`.
    pub fn reflect(&mut self, toward: DVec3, work: &mut Work) {
        self.done = self.value(work);
        self.segment = match &self.segment {
            Segment::Straight(segment) => Segment::Straight(segment.reflected(toward)),
            Segment::Curved(segment) => Segment::Curved(segment.reflected(toward)),
        };
    }

    /// Adds the part of an arc in `field` between two θ.
    pub fn add(&mut self, field: &Field, arc: &Arc, range: [f64; 2], work: &mut Work) {
        let before = self.quadrature.evaluations;
        match &mut self.segment {
            Segment::Straight(segment) => segment.add(field, arc, range, &mut self.quadrature),
            Segment::Curved(segment) => segment.add(field, arc, range, &mut self.quadrature),
        }
        work.evaluations += self.quadrature.evaluations - before;
    }
}
