//! Connections through the surface of a ball, whether or not the surface refracts. In a ball of
//! constant index all connections are known (docs/theory.md#through-a-ball); in a ball filled by a
//! field, nearly all (docs/theory.md#through-a-lens).

use super::{Candidate, Known, Search, Visit};
use crate::connection_end::ConnectionEnd;
use crate::scene::BendingBall;
use eikonal::connect::{BallRay, InitialGuess, Outside, PassingRay, Pattern, RayFamily, WallGuess};
use glam::DVec3;
use std::ops::ControlFlow;

/// Cosine of arrival from behind a surface above which rays are not shot. The limit is far above
/// the error of a crossing.
const MAX_BEHIND_COSINE: f64 = 1e-3;

impl Search<'_> {
    /// Returns true if the deterministic starts lead to every ray that is searched for, because
    /// only a ball bends rays. `any` says whether the starts led to any ray. From inside to outside
    /// all rays are known if the ball's index is constant. Inside the ball there is one ray if none
    /// is reflected totally.
    pub(super) fn ball_has_all(&self, any: bool) -> bool {
        let Some(glass) = self.scene.bending_ball() else {
            return false;
        };
        let straight = glass.lens.is_none();
        let within = match self.target.end {
            ConnectionEnd::Point { position, .. } => self
                .scene
                .is_unique_in_ball([self.vertex.position(), position]),
            ConnectionEnd::Plane { .. } => false,
        };
        let known = within && (any || straight) || straight && self.ends(glass).is_some();
        known && self.scene.branch_reach().reflections == 0
    }

    /// Visits a start for every ray through the surface of the ball that alone bends rays, if one
    /// end lies inside and the other outside. If the surface does not refract, also visits starts
    /// between two ends outside. Returns `None` in all other cases.
    pub(super) fn through_ball(&self, visit: &mut Visit) -> Option<ControlFlow<()>> {
        let ball = self.scene.bending_ball()?;
        match self.ends(ball) {
            Some(ends) => Some(self.out_of(ball, ends, visit)),
            None => self.past(ball, visit),
        }
    }

    /// Visits a start for every ray from inside to outside.
    fn out_of(
        &self,
        ball: &BendingBall,
        (inner, outer): (DVec3, Outside),
        visit: &mut Visit,
    ) -> ControlFlow<()> {
        let mut start = |ray: BallRay| match self.by_way_of(&ray, ball) {
            Some(candidate) => visit(candidate),
            None => ControlFlow::Continue(()),
        };
        match &ball.lens {
            Some(lens) => lens.rays(inner, outer).into_iter().try_for_each(start),
            None => (ball.ball.crossings(inner, outer))
                .try_for_each(|crossing| start(ball.straight(inner, crossing))),
        }
    }

    /// Visits a start for every ray between two ends outside, past the ball or through it, if the
    /// surface does not refract.
    fn past(&self, ball: &BendingBall, visit: &mut Visit) -> Option<ControlFlow<()>> {
        let x = self.vertex.position();
        let is_outside = |x| !ball.ball.contains(x);
        let lens = (ball.lens.as_ref()).filter(|_| ball.matched && is_outside(x))?;
        let (from, start) = match self.target.end {
            ConnectionEnd::Point { position: y, .. } if is_outside(y) => (Outside::Point(y), y),
            ConnectionEnd::Plane {
                through, direction, ..
            } if ball.is_before(through, direction) => {
                let depth = (x - through).dot(direction);
                (Outside::Direction(-direction), x - direction * depth)
            }
            _ => return None,
        };
        // Planted error "light past a ball that bends it forgotten", found by morgana-transport/transport::lens::parallel_light_comes_through_luneburgs_lens_in_closed_form:
        // let chord = ball.is_missed([x, start]).then(|| self.chord()).flatten().filter(|_| false);
        let chord = ball.is_missed([x, start]).then(|| self.chord()).flatten();
        if let Some(ControlFlow::Break(())) = chord.map(&mut *visit) {
            return Some(ControlFlow::Break(()));
        }
        let passing = lens.passing(from, x).into_iter();
        Some(
            passing
                .filter_map(|ray| self.through(&ray, ball))
                .try_for_each(visit),
        )
    }

    /// Returns the start of a ray through the ball; the target and the vertex both lie outside.
    fn through(&self, ray: &PassingRay, ball: &BendingBall) -> Option<Candidate> {
        let x = self.vertex.position();
        let length = ray.optical_length + ball.outside(ray.exit, x);
        match self.target.end {
            ConnectionEnd::Point { position, .. } => {
                let direction = (ray.exit - x).try_normalize()?;
                let arrival = (position - ray.entry).try_normalize()?;
                let place = self.vertex.start(self.scene, direction);
                let (end_point, facing) = self.end_point(position, arrival);
                if facing.is_some_and(|normal| normal.dot(arrival) > MAX_BEHIND_COSINE) {
                    return None;
                }
                let start = InitialGuess {
                    family: RayFamily::Point {
                        x: place.x,
                        direction,
                    },
                    region: place.medium,
                    optical_length: length + ball.outside(ray.entry, end_point),
                    pattern: Pattern::REFRACT,
                };
                Some(Candidate::new(start, place, end_point, facing))
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let p = ray.entry;
                let foot = p - direction * (p - through).dot(direction);
                let start = InitialGuess {
                    family: RayFamily::Plane { x: foot, direction },
                    region: self.scene.medium_at(foot),
                    optical_length: length + ball.outside(p, foot),
                    pattern: Pattern::REFRACT,
                };
                let arrival = (x - ray.exit).try_normalize()?;
                Some(self.arriving(start, arrival))
            }
        }
    }

    /// Returns the end inside the ball and the end outside.
    fn ends(&self, glass: &BendingBall) -> Option<(DVec3, Outside)> {
        let (x, ball) = (self.vertex.position(), &glass.ball);
        match self.target.end {
            ConnectionEnd::Point { position: y, .. } => {
                match (ball.contains(x), ball.contains(y)) {
                    (true, false) => Some((x, Outside::Point(y))),
                    (false, true) => Some((y, Outside::Point(x))),
                    _ => None,
                }
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let ends = (x, Outside::Direction(-direction));
                (glass.is_before(through, direction) && ball.contains(x)).then_some(ends)
            }
        }
    }

    /// Returns the start of a ray through the surface of the ball.
    fn by_way_of(&self, ray: &BallRay, glass: &BendingBall) -> Option<Candidate> {
        let (x, p) = (self.vertex.position(), ray.crossing);
        let inside = glass.ball.contains(x);
        match self.target.end {
            ConnectionEnd::Point { position, .. } => {
                let arrival = if inside { position - p } else { -ray.direction };
                let (direction, arrival) = (
                    if inside {
                        ray.direction
                    } else {
                        (p - x).try_normalize()?
                    },
                    arrival.try_normalize()?,
                );
                let place = self.vertex.start(self.scene, direction);
                let (end_point, facing) = self.end_point(position, arrival);
                if facing.is_some_and(|normal| normal.dot(arrival) > MAX_BEHIND_COSINE) {
                    return None;
                }
                let outer = if inside { end_point } else { place.x };
                let start = InitialGuess {
                    family: RayFamily::Point {
                        x: place.x,
                        direction,
                    },
                    region: place.medium,
                    optical_length: ray.optical_length + glass.outside(p, outer),
                    pattern: Pattern::REFRACT,
                };
                let candidate = Candidate::new(start, place, end_point, facing);
                if glass.lens.is_none() || glass.matched {
                    return Some(candidate);
                }
                let wall = WallGuess {
                    inner: if inside { place.x } else { end_point },
                    region: glass.interior,
                    outer,
                    crossing: p,
                    outward: inside,
                };
                Some(Candidate {
                    known: Known::Wall(wall, start),
                    ..candidate
                })
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let foot = p - direction * (p - through).dot(direction);
                let start = InitialGuess {
                    family: RayFamily::Plane { x: foot, direction },
                    region: self.scene.medium_at(foot),
                    optical_length: glass.outside(p, foot) + ray.optical_length,
                    pattern: Pattern::REFRACT,
                };
                Some(self.arriving(start, -ray.direction))
            }
        }
    }
}
