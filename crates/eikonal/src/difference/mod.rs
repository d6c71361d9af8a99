//! Optical path differences: how much longer, or shorter, a ray is than the rays of a reference that join its ends.
//!
//! What is integrated is as small as the contrast, so that nothing cancels. It is Hamilton's action less that of the
//! reference ray, hence stationary in the path between the ends: an error of the path counts in second order only.
//! Steps are chosen for positions, and in weak fields are far longer than what the contrast varies over, so the
//! integral has an error control of its own.
//!
//! Theory: docs/theory.md#optical-path-difference.

mod curved;
mod quadrature;
mod straight;

use crate::field::Field;
use crate::ray::{Arc, Work};
use curved::CurvedLeg;
use glam::DVec3;
use quadrature::Quadrature;
use straight::StraightLeg;

/// What optical path differences are taken against.
#[derive(Clone, Copy, Debug)]
pub enum Reference<'a> {
    /// An index > 0 that is the same everywhere: the rays of the reference are straight.
    Index(f64),
    /// A field that fills all of space.
    Field(&'a Field),
}

/// The optical path difference of a ray, arc by arc: its optical length less that of the rays of a reference that join
/// its start, the points where it was reflected, and its end.
///
/// The error is about 1e-7 of the largest contrast |n − n_r| on the ray times the length, whatever the tolerance of
/// the ray, and rounding, 2e-16 of the length.
#[derive(Clone, Debug)]
pub struct PathDifference<'a> {
    /// Of the legs that have ended.
    done: f64,
    leg: Leg<'a>,
    quadrature: Quadrature,
}

/// A ray since its start or its last reflection.
#[derive(Clone, Debug)]
enum Leg<'a> {
    Straight(StraightLeg),
    Curved(CurvedLeg<'a>),
}

impl<'a> PathDifference<'a> {
    /// Of a ray that starts in the unit direction `toward`.
    pub fn new(reference: Reference<'a>, toward: DVec3) -> Self {
        PathDifference {
            done: 0.0,
            leg: match reference {
                Reference::Index(n) => Leg::Straight(StraightLeg::new(n, toward)),
                Reference::Field(field) => Leg::Curved(CurvedLeg::new(field, toward)),
            },
            quadrature: Quadrature::default(),
        }
    }

    /// So far, in units of length, if it is at hand: against an index that is the same everywhere.
    pub fn so_far(&self) -> Option<f64> {
        match &self.leg {
            Leg::Straight(leg) => Some(self.done + leg.value()),
            Leg::Curved(_) => None,
        }
    }

    /// So far, in units of length. Against a field this looks for the reference ray: one of those that join the ends,
    /// that to which the ray itself leads, or the chord; NaN if there is none, or if it was given up.
    pub fn value(&mut self, work: &mut Work) -> f64 {
        let leg = match &self.leg {
            Leg::Straight(leg) => leg.value(),
            Leg::Curved(leg) => {
                let before = self.quadrature.evaluations;
                let value = leg.value(&mut self.quadrature, work);
                work.evaluations += self.quadrature.evaluations - before;
                value
            }
        };
        self.done + leg
    }

    /// Whether it was given up, because a field is too fine: it is NaN then.
    pub fn is_over_budget(&self) -> bool {
        self.quadrature.is_over_budget()
    }

    /// The ray is reflected into the unit direction `toward`, and so are those of the reference.
    pub fn reflect(&mut self, toward: DVec3, work: &mut Work) {
        self.done = self.value(work);
        self.leg = match &self.leg {
            Leg::Straight(leg) => Leg::Straight(leg.reflected(toward)),
            Leg::Curved(leg) => Leg::Curved(leg.reflected(toward)),
        };
    }

    /// Adds the part of an arc in `field` between two θ.
    pub fn add(&mut self, field: &Field, arc: &Arc, range: [f64; 2], work: &mut Work) {
        let before = self.quadrature.evaluations;
        match &mut self.leg {
            Leg::Straight(leg) => leg.add(field, arc, range, &mut self.quadrature),
            Leg::Curved(leg) => leg.add(field, arc, range, &mut self.quadrature),
        }
        work.evaluations += self.quadrature.evaluations - before;
    }
}
