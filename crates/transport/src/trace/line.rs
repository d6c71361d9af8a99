//! Recorded points and lengths of a ray.

use super::{Path, TraceEnding, TracePoint};
use crate::scene::MediumId;
use eikonal::field::Field;
use eikonal::ray::{Step, Work};
use eikonal::{PathDifference, Reference};
use glam::DVec3;

/// Angle in radians by which a ray turns between recorded points, at most. Polylines then look
/// smooth.
const MAX_TURN: f64 = 0.03;

/// Ray traced so far.
pub(super) struct Line<'a> {
    /// Length of the ray.
    pub length: f64,
    optical: f64,
    difference: PathDifference<'a>,
    points: Vec<TracePoint>,
    /// Work of the path difference; not reported.
    work: Work,
}

impl<'a> Line<'a> {
    /// Creates a ray that starts in the unit direction `toward`. It is compared with rays of the
    /// `reference`.
    pub(super) fn new(reference: Reference<'a>, toward: DVec3) -> Self {
        Line {
            length: 0.0,
            optical: 0.0,
            difference: PathDifference::new(reference, toward),
            points: Vec::new(),
            work: Work::default(),
        }
    }

    /// Records the points of a step in a field, up to θ.
    pub(super) fn advance(&mut self, field: &Field, step: &Step<()>, theta: f64, medium: MediumId) {
        let arc = &step.arc;
        let turn = step.start.v.angle_between(step.at(theta).1);
        let pieces = if arc.is_straight() {
            1.0
        } else {
            (turn / MAX_TURN).ceil().clamp(1.0, 1e3)
        };
        let (length, optical) = (self.length, self.optical);
        let mut before = 0.0;
        for i in 1..=pieces as usize {
            let t = theta * i as f64 / pieces;
            self.length = length + arc.arc_length(t);
            self.optical = optical + arc.optical_length(t);
            self.difference.add(field, arc, [before, t], &mut self.work);
            let (x, v, ()) = step.at(t);
            self.record(x, v, medium);
            before = t;
        }
    }

    /// Returns true if the ray has this length, up to rounding of lengths and of positions.
    pub(super) fn reaches(&self, length: f64) -> bool {
        let place = self.points.last().map_or(0.0, |point| point.x.length());
        length - self.length <= 1e-12 * length + 4.0 * f64::EPSILON * place
    }

    /// Reflects the ray into the unit direction `toward`.
    pub(super) fn reflect(&mut self, toward: DVec3) {
        self.difference.reflect(toward, &mut self.work);
    }

    /// Returns the counter of the work of tracing the ray.
    pub(super) fn work(&mut self) -> &mut Work {
        &mut self.work
    }

    /// Records a point with velocity `v`.
    pub(super) fn record(&mut self, x: DVec3, v: DVec3, medium: MediumId) {
        self.points.push(TracePoint {
            x,
            direction: v.normalize(),
            arc_length: self.length,
            optical_length: self.optical,
            path_difference: self.difference.so_far().unwrap_or(f64::NAN),
            index: v.length(),
            medium,
        });
    }

    /// Replaces the last point, where the ray changes its direction or its medium.
    pub(super) fn replace(&mut self, x: DVec3, v: DVec3, medium: MediumId) {
        self.points.pop();
        self.record(x, v, medium);
    }

    pub(super) fn end(mut self, ending: TraceEnding) -> Path {
        if let Some(last) = self.points.last_mut() {
            last.path_difference = self.difference.value(&mut self.work);
        }
        Path {
            points: self.points,
            ending,
        }
    }
}
