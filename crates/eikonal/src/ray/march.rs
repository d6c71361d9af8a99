//! Rays through one field up to a stop condition.

use super::arc::Arc;
use super::depth::Profile;
use super::flow::{Flow, Tolerance, Work};
use super::step::{Node, Step};
use crate::direction::unit;
use crate::field::Field;
use glam::DVec3;
use std::fmt;

/// Condition that ends a march.
pub enum StopCondition<'a> {
    /// A given arc length.
    ArcLength(f64),
    /// A given optical depth, for an extinction per unit length whose features are no smaller than
    /// `spacing`.
    OpticalDepth {
        /// ∫σ_t ds at which to stop.
        depth: f64,
        /// Extinction σ_t(x). From a place where it is NaN on, no depth is reached.
        extinction: &'a dyn Fn(DVec3) -> f64,
        /// Longest piece of Simpson's rule, in units of arc length, positive. A step of a ray has
        /// at most a million pieces.
        spacing: f64,
    },
    /// The first crossing of a surface; the function returns the first θ on an arc.
    Surface(&'a dyn Fn(&Arc) -> Option<f64>),
    /// The first local minimum of the distance to a point after the start.
    ClosestApproach(DVec3),
}

impl fmt::Debug for StopCondition<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StopCondition::ArcLength(length) => f.debug_tuple("ArcLength").field(length).finish(),
            StopCondition::OpticalDepth { depth, spacing, .. } => f
                .debug_struct("OpticalDepth")
                .field("depth", depth)
                .field("spacing", spacing)
                .finish_non_exhaustive(),
            StopCondition::Surface(_) => f.debug_tuple("Surface").finish_non_exhaustive(),
            StopCondition::ClosestApproach(point) => {
                f.debug_tuple("ClosestApproach").field(point).finish()
            }
        }
    }
}

/// End of a march.
#[derive(Clone, Copy, Debug)]
pub struct March {
    /// Position at the end.
    pub x: DVec3,
    /// Velocity at the end; |v| = n up to the tolerance.
    pub v: DVec3,
    /// Arc length travelled.
    pub arc_length: f64,
    /// Optical path length travelled.
    pub optical_length: f64,
    /// True if the stop condition was met, false if a limit was reached.
    pub stopped: bool,
}

/// Longest arc length of a ray: polynomials of longer arcs would overflow.
const MAX_ARC_LENGTH: f64 = 1e100;
/// Maximum number of steps of a ray; only rays that circle for ever need more.
const MAX_STEPS: usize = 1_000_000;

/// Traces a ray from `x` in a `direction` of any finite length except zero. The ray ends at `stop`,
/// at the arc length `limit`, or after a million steps. Calls `visit` with every step, and with the
/// θ up to which the step belongs to the ray. If the limit is NaN, zero or negative, the ray ends
/// at its start.
pub fn march(
    field: &Field,
    x: DVec3,
    direction: DVec3,
    stop: &StopCondition,
    limit: f64,
    tolerance: Tolerance,
    mut visit: impl FnMut(&Step<()>, f64),
) -> March {
    let mut work = Work::default();
    let direction = unit(direction).unwrap_or(DVec3::NAN);
    let start = Node::start(field, x, direction, ());
    let mut ray = March {
        x,
        v: start.v,
        arc_length: 0.0,
        optical_length: 0.0,
        stopped: false,
    };
    let goes = limit > 0.0 && start.v.is_finite();
    let limit = limit.min(MAX_ARC_LENGTH);
    let mut flow = Flow::new(field, start, tolerance);
    let mut stop = Progress {
        stop,
        done: 0.0,
        nearing: false,
    };
    let most_steps = if goes { MAX_STEPS } else { 0 };
    for _ in 0..most_steps {
        // Take a step, at most to the limit.
        let remaining = limit - ray.arc_length;
        let step = flow.advance(remaining / flow.node().v.length(), &mut work);
        let end = step.arc.theta_at_length(remaining);
        // End the step at the stop condition.
        let event = stop.on(&step.arc).filter(|&theta| theta <= end);
        let theta = event.unwrap_or(end);
        visit(&step, theta);
        let (x, v, ()) = step.at(theta);
        ray = March {
            x,
            v,
            arc_length: ray.arc_length + step.arc.arc_length(theta),
            optical_length: ray.optical_length + step.arc.optical_length(theta),
            stopped: event.is_some(),
        };
        let spent = limit - ray.arc_length <= 1e-13 * limit;
        if ray.stopped || spent || !ray.arc_length.is_finite() {
            break;
        }
    }
    ray
}

/// A stop condition with the progress towards it.
struct Progress<'a> {
    stop: &'a StopCondition<'a>,
    done: f64,
    /// True if the last arc ended while approaching the point.
    nearing: bool,
}

impl Progress<'_> {
    /// Returns the θ at which this arc meets the condition.
    fn on(&mut self, arc: &Arc) -> Option<f64> {
        match *self.stop {
            StopCondition::ArcLength(s) => {
                let left = s - self.done;
                self.done += arc.arc_length(1.0);
                (self.done >= s).then(|| arc.theta_at_length(left))
            }
            StopCondition::OpticalDepth {
                depth,
                extinction,
                spacing,
            } => {
                let left = depth - self.done;
                let profile = Profile::new(arc, [0.0, 1.0], spacing, |x| [extinction(x)]);
                self.done += profile.total()[0];
                profile.invert(0, left)
            }
            StopCondition::Surface(first) => first(arc),
            StopCondition::ClosestApproach(y) => {
                let theta = arc.closest_approach(y);
                // Accept the start of an arc that moves away from the point as a minimum only if
                // the previous arc approached the point.
                let stops = theta < 1.0 && (theta > 0.0 || self.nearing);
                let slope = (arc.position(1.0) - y).dot(arc.velocity(1.0));
                self.nearing = theta == 1.0 || slope < 0.0;
                stops.then_some(theta)
            }
        }
    }
}
