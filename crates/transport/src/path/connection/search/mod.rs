//! The search for connections, from deterministic starts and from random ones
//! (docs/theory.md#branches).

mod ball;
mod found;
mod random;

use super::ray::Connection;
use super::target::ConnectionTarget;
use crate::connection_end::ConnectionEnd;
use crate::path::segment::{Start, Vertex, leave};
use crate::path::workspace::Workspace;
use crate::scene::{MediumId, Scene};
use eikonal::connect::{self, ConnectingRay, Failure, Piece, RayFamily, World};
use glam::DVec3;
use std::ops::ControlFlow;

/// A start for the solver, with the conditions that the ray found from it must meet.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Medium in which the ray starts.
    pub region: MediumId,
    /// Point that the ray must meet.
    pub end_point: DVec3,
    /// The vertex as one end of the ray. The ray must leave on the side of this direction.
    place: Start,
    /// Normal of the end's surface on the side on which the ray must arrive.
    facing: Option<DVec3>,
    known: Known,
}

/// Initial data of a candidate.
#[derive(Clone, Debug)]
enum Known {
    /// A ray family whose direction points along the chord; the solver searches for the primary
    /// branch.
    Chord(RayFamily),
    /// A guess of where the ray crosses the wall of a lens, and a guess of the whole ray.
    Wall(connect::WallGuess<MediumId>, Guess),
    /// A ray that was already followed.
    Followed(Box<connect::Followed<MediumId>>),
    /// A guess of the whole ray.
    Guess(Guess),
}

type Guess = connect::InitialGuess<MediumId>;

impl Candidate {
    /// Makes a candidate from a guess. Its ray must meet `end_point` on the side of `facing`.
    fn new(guess: Guess, place: Start, end_point: DVec3, facing: Option<DVec3>) -> Self {
        Candidate {
            region: guess.region,
            end_point,
            place,
            facing,
            known: Known::Guess(guess),
        }
    }

    fn connect(&self, scene: &Scene, ws: &mut Workspace) -> Result<ConnectingRay, Failure> {
        let solver = &mut ws.solver;
        match &self.known {
            Known::Chord(family) => solver.primary(scene, *family, self.region, self.end_point),
            Known::Wall(wall, guess) => match solver.through_wall(scene, wall) {
                Some(found) => Ok(found),
                None => solver.solve(scene, guess, self.end_point),
            },
            Known::Followed(known) => solver.solve_on(scene, known, self.end_point),
            Known::Guess(guess) => solver.solve(scene, guess, self.end_point),
        }
    }
}

/// Callback for each start; it returns whether to visit further starts.
pub(super) type Visit<'v> = dyn FnMut(Candidate) -> ControlFlow<()> + 'v;

/// A vertex and the target of its connections.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    scene: &'a Scene,
    vertex: &'a Vertex,
    target: &'a ConnectionTarget<'a>,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        vertex: &'a Vertex,
        target: &'a ConnectionTarget<'a>,
    ) -> Self {
        Search {
            scene,
            vertex,
            target,
        }
    }

    /// Returns true if the deterministic starts lead to every ray; `any` says whether they led to
    /// any.
    pub(crate) fn has_all(&self, any: bool) -> bool {
        self.scene.is_straight() || self.ball_has_all(any) || any && self.is_unique()
    }

    /// Returns true if a proof shows that there is at most one ray.
    fn is_unique(&self) -> bool {
        let (ConnectionEnd::Point { position, .. }, Some(medium)) =
            (self.target.end, self.target.medium)
        else {
            return false;
        };
        let x = self.vertex.position();
        let start = self.vertex.start(self.scene, position - x);
        self.scene
            .is_unique(start.x, start.medium, position, medium)
    }

    /// Visits the deterministic starts. They lie at every ray through the surface of a ball.
    /// Without a ball they lie along the chord, at the foot of the vertex on a plane, or where a
    /// beam passes the vertex.
    pub(super) fn certain(&self, visit: &mut Visit) -> ControlFlow<()> {
        match self.through_ball(visit) {
            Some(flow) => flow,
            None => self.around_chord(visit),
        }
    }

    fn around_chord(&self, visit: &mut Visit) -> ControlFlow<()> {
        let Some(guide) = self.target.guide else {
            return self.chord().map_or(ControlFlow::Continue(()), visit);
        };
        let starts = guide.starts(self.scene, self.vertex.position());
        starts.into_iter().try_for_each(|known| {
            visit(Candidate {
                known: Known::Followed(Box::new(known)),
                ..self.arriving(known.start, known.start.family.direction())
            })
        })
    }

    /// Returns the start along the chord.
    fn chord(&self) -> Option<Candidate> {
        let x = self.vertex.position();
        match self.target.end {
            ConnectionEnd::Point { position, .. } => {
                let direction = (position - x).try_normalize()?;
                let place = self.vertex.start(self.scene, direction);
                let (end_point, facing) = self.end_point(position, direction);
                Some(Candidate {
                    region: place.medium,
                    end_point,
                    place,
                    facing,
                    known: Known::Chord(RayFamily::Point {
                        x: place.x,
                        direction: (end_point - place.x).try_normalize()?,
                    }),
                })
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let depth = (x - through).dot(direction);
                let foot = x - direction * depth;
                let place = self.vertex.start(self.scene, -direction);
                (depth > 0.0).then(|| Candidate {
                    region: self.scene.medium_at(foot),
                    end_point: place.x,
                    place,
                    facing: None,
                    known: Known::Chord(RayFamily::Plane { x: foot, direction }),
                })
            }
        }
    }

    /// Returns the point that a ray arriving in `direction` must meet, and the side of the surface
    /// there.
    fn end_point(&self, position: DVec3, direction: DVec3) -> (DVec3, Option<DVec3>) {
        let ConnectionEnd::Point {
            surface: Some(on), ..
        } = self.target.end
        else {
            return (position, None);
        };
        let facing = self.target.facing(&on, direction);
        (leave(self.scene, position, facing, facing), Some(facing))
    }

    /// Makes a candidate that starts on a plane and arrives at the vertex in `direction`.
    fn arriving(&self, guess: Guess, direction: DVec3) -> Candidate {
        let place = self.vertex.start(self.scene, -direction);
        Candidate::new(guess, place, place.x, None)
    }

    /// Solves for a candidate, and counts the attempt and its outcome.
    pub(super) fn attempt(&self, candidate: &Candidate, ws: &mut Workspace) -> Option<Connection> {
        if ws.stop.is_raised() {
            return None;
        }
        let outcome = candidate.connect(self.scene, ws);
        ws.stats.count(&outcome);
        let connection = self.comply(candidate, &outcome.ok()?, ws);
        ws.stats.connections.discarded += u64::from(connection.is_none());
        connection
    }

    /// Solves for a candidate without counting.
    pub(super) fn solve(&self, candidate: &Candidate, ws: &mut Workspace) -> Option<Connection> {
        if ws.stop.is_raised() {
            return None;
        }
        let ray = candidate.connect(self.scene, ws).ok()?;
        self.comply(candidate, &ray, ws)
    }

    /// Returns the connection of a ray. Returns `None` if the ray leaves or arrives on the wrong
    /// side of a surface, or is beyond the reach of branches.
    fn comply(
        &self,
        candidate: &Candidate,
        ray: &ConnectingRay,
        ws: &Workspace,
    ) -> Option<Connection> {
        let connection = self.found(ray, ws);
        let leaves = self
            .vertex
            .same_side(connection.direction, candidate.place.direction);
        let arrives = candidate
            .facing
            .is_none_or(|f| f.dot(connection.emission) > 0.0);
        let through = match self.target.end {
            ConnectionEnd::Point { .. } => true,
            // Reject rays that run against their own direction or through the medium behind the
            // vertex's surface. Also reject rays from a part of the plane in another medium than
            // the start.
            ConnectionEnd::Plane { .. } => {
                let last = ws.solver.pieces().last()?;
                ray.optical_length > 0.0
                    && last.region == candidate.place.medium
                    // Planted error "beam followed through another medium than it starts in" (2 lines), found by morgana-transport/transport::beams::all_of_a_beam_goes_through_a_graded_tank:
                    // }
                    && self.scene.medium_at(ray.start) == candidate.region
            }
        };
        let within = self.within_reach(ray, ws.solver.pieces());
        (leaves && arrives && through && within).then_some(connection)
    }

    /// Returns true if the ray is within the reach of branches; see [`crate::path`].
    fn within_reach(&self, ray: &ConnectingRay, pieces: &[Piece<MediumId>]) -> bool {
        let bounces = pieces.iter().filter(|p| p.is_reflected()).count() as u32;
        // Leave out the distance to a plane.
        let approach = match (self.target.end, pieces.first()) {
            (ConnectionEnd::Plane { .. }, Some(first))
                if self.scene.field(first.region).is_constant() =>
            {
                first.arc.optical_length(first.theta_end)
            }
            _ => 0.0,
        };
        let length = ray.optical_length - approach;
        let reach = self.scene.branch_reach();
        reach.includes(length, ray.pattern.reflections(), bounces)
    }
}
