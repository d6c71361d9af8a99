//! Connections through the surface of a ball: all are known if its index is constant (docs/theory.md#through-a-ball), and nearly all
//! if a field fills it (docs/theory.md#through-a-lens).

use super::{Candidate, Known, Search};
use crate::connection_end::ConnectionEnd;
use crate::scene::GlassBall;
use eikonal::connect::{BallRay, InitialGuess, Outside, Pattern, RayFamily, WallGuess};
use glam::DVec3;

/// Rays that come to a surface from behind at so large a cosine are not shot at all: far above the
/// error of a crossing.
const BEHIND: f64 = 1e-3;

impl<'a> Search<'a> {
    /// Whether the deterministic starts lead to every ray that is looked for, given whether these led to any, because nothing but a
    /// ball bends rays: from inside to outside all are known if its index is constant, and inside there is one if none is reflected
    /// totally.
    pub(super) fn ball_has_all(&self, any: bool) -> bool {
        let Some(glass) = self.scene.glass_ball() else {
            return false;
        };
        let straight = glass.lens.is_none();
        let within = match self.target.end {
            ConnectionEnd::Point { position, .. } => {
                let n = |x| self.scene.n(glass.interior, x);
                glass.is_unique([self.vertex.position(), position], n)
            }
            ConnectionEnd::Plane { .. } => false,
        };
        let known = within && (any || straight) || straight && self.ends(glass).is_some();
        known && self.scene.branch_reach().reflections == 0
    }

    /// A start for every ray through the surface of the ball that is all that bends rays, with the field inside, if one end
    /// lies inside and the other outside.
    pub(super) fn through_ball(self) -> Option<impl Iterator<Item = Candidate> + use<'a>> {
        let glass = self.scene.glass_ball()?;
        let (inner, outer) = self.ends(glass)?;
        let lens = glass.lens.as_ref();
        let bent = lens.map(|lens| lens.rays(inner, outer)).unwrap_or_default();
        let straight = lens.is_none().then(|| glass.ball.crossings(inner, outer));
        let straight = straight.into_iter().flatten();
        let rays = straight
            .map(move |crossing| glass.straight(inner, crossing))
            .chain(bent);
        Some(rays.filter_map(move |ray| self.by_way_of(&ray, glass)))
    }

    /// The end that lies inside, and the one that lies outside.
    fn ends(&self, glass: &GlassBall) -> Option<(DVec3, Outside)> {
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
                let before = (ball.center - through).dot(direction) > ball.radius;
                let ends = (x, Outside::Direction(-direction));
                (before && ball.contains(x)).then_some(ends)
            }
        }
    }

    /// The start of a ray through the surface of the ball.
    fn by_way_of(&self, ray: &BallRay, glass: &GlassBall) -> Option<Candidate> {
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
                if facing.is_some_and(|normal| normal.dot(arrival) > BEHIND) {
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
                let known = match &glass.lens {
                    None => Known::Nothing,
                    Some(_) => Known::Wall(WallGuess {
                        inner: if inside { place.x } else { end_point },
                        region: glass.interior,
                        outer,
                        crossing: p,
                        outward: inside,
                    }),
                };
                Some(Candidate {
                    known,
                    ..Candidate::new(start, place, end_point, facing)
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
