//! A ray through one field until something happens.

use super::arc::Arc;
use super::depth::Profile;
use super::flow::{Flow, Tolerance, Work};
use super::step::{Node, Step};
use crate::field::Field;
use glam::DVec3;

/// What ends a march.
pub enum StopCondition<'a> {
    /// A given arc length.
    ArcLength(f64),
    /// A given optical depth, for an extinction per unit length whose features are no smaller than
    /// `spacing`.
    OpticalDepth {
        /// ∫σ_t ds at which to stop.
        depth: f64,
        /// Extinction σ_t(x).
        extinction: &'a dyn Fn(DVec3) -> f64,
        /// Longest piece of the quadrature.
        spacing: f64,
    },
    /// The first crossing of a surface; the function returns the first θ on an arc.
    Surface(&'a dyn Fn(&Arc) -> Option<f64>),
    /// The first local minimum of the distance to a point.
    ClosestApproach(DVec3),
}

/// The end of a march.
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
    /// Whether the event occurred, rather than the length limit.
    pub stopped: bool,
}

/// Follows a ray from `x` in the unit `direction` until `stop` happens or `limit` of arc length is
/// reached. `visit` sees every step and the θ up to which it counts.
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
    let mut flow = Flow::new(field, Node::start(field, x, direction, ()), tolerance);
    let mut stop = Progress { stop, done: 0.0 };
    let (mut length, mut optical) = (0.0, 0.0);
    loop {
        let remaining = limit - length;
        let step = flow.advance(remaining / flow.node().v.length(), &mut work);
        let end = step.arc.theta_at_length(remaining);
        let event = stop.on(&step.arc).filter(|&theta| theta <= end);
        let theta = event.unwrap_or(end);
        visit(&step, theta);
        length += step.arc.arc_length(theta);
        optical += step.arc.optical_length(theta);
        let spent = limit - length <= 1e-13 * limit;
        if event.is_some() || spent || !length.is_finite() {
            let (x, v, ()) = step.at(theta);
            return March {
                x,
                v,
                arc_length: length,
                optical_length: optical,
                stopped: event.is_some(),
            };
        }
    }
}

/// A stop and how much of it has been used up.
struct Progress<'a> {
    stop: &'a StopCondition<'a>,
    done: f64,
}

impl Progress<'_> {
    /// θ at which the stop happens on this arc.
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
                (theta < 1.0).then_some(theta)
            }
        }
    }
}
