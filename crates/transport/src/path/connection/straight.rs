//! Connections without ray bending: along the straight line, in closed form.

use super::ray::Connection;
use super::target::ConnectionTarget;
use crate::bsdf::PartialTransmission;
use crate::connection_end::ConnectionEnd;
use crate::medium::Attenuation;
use crate::path::segment::{EdgeGeometry, TransportMode, Vertex, leave};
use crate::path::workspace::{RayPart, Workspace};
use crate::scene::{MediumId, Scene};
use eikonal::Failure;
use eikonal::connect::World;
use eikonal::ray::Arc;
use glam::DVec3;

/// Largest number of index-matched boundaries on a line; sensible lines cross fewer.
const MAX_CROSSINGS: usize = 20_000;

/// The line that connects a vertex with a target: from the vertex to a point, or from a plane to
/// the vertex. The ends of the line are kept off the surfaces on which they lie.
struct Line {
    from: DVec3,
    to: DVec3,
    direction: DVec3,
    length: f64,
    /// Object that the line leaves at its start and does not meet again.
    start_object: Option<usize>,
    /// Medium at the start of the line.
    medium: MediumId,
    /// Medium at the vertex, on the side on which the line must lie.
    beside: MediumId,
    /// True if the line lies on that side of the vertex, and light leaves the surface of the end on
    /// the right side.
    proper: bool,
}

/// Transmission of media and surfaces along a line.
struct StraightThroughput {
    optical_length: f64,
    /// Indices at the start and at the end of the line.
    n: [f64; 2],
    /// ∏ n_after/n_before over declared index matches.
    jump: f64,
    /// Transmission of masks and panes between media.
    through: PartialTransmission,
}

/// Returns the connection along the straight line, and counts it. J is the squared distance from a
/// point; A is 1 from a plane (docs/theory.md#edges-and-geometry-terms). Returns `None` if the line
/// is blocked, or leaves or arrives on the wrong side of a surface.
pub(super) fn connect(
    scene: &Scene,
    vertex: &Vertex,
    target: &ConnectionTarget,
    ws: &mut Workspace,
) -> Option<Connection> {
    let line = Line::between(scene, vertex, target)?;
    let cut = line.cut(scene, &mut ws.line);
    ws.stats.work.steps += ws.line.len() as u64;
    ws.stats.count(&cut);
    let throughput = cut.ok()?;
    if !line.complies(scene, target, &ws.line) {
        ws.stats.connections.discarded += 1;
        return None;
    }
    let parts = ws.line.iter().map(|part| (&part.arc, part.theta_end));
    let mut connection = line.connection(target, &throughput);
    if !connection.passes(scene, vertex, target, parts, &mut ws.stats) {
        return None;
    }
    for part in &ws.line {
        let attenuation = Attenuation::new(scene.medium(part.medium), &part.arc, part.theta_end);
        connection.geometry.depth +=
            attenuation.depth(part.theta_end, part.arc.arc_length(part.theta_end));
    }
    Some(connection)
}

impl Line {
    /// Returns the line; `None` if the ends coincide or the vertex lies behind the plane.
    fn between(scene: &Scene, vertex: &Vertex, target: &ConnectionTarget) -> Option<Self> {
        let x = vertex.position();
        let line = match target.end {
            ConnectionEnd::Point { position, surface } => {
                let place = vertex.start(scene, (position - x).try_normalize()?);
                let facing = surface.map(|on| target.facing(&on, place.direction));
                let to = facing.map_or(position, |facing| leave(scene, position, facing, facing));
                let length = to.distance(place.x);
                let direction = (to - place.x) / length;
                let arrives = facing.is_none_or(|facing| facing.dot(direction) < 0.0);
                Line {
                    from: place.x,
                    to,
                    direction,
                    length,
                    start_object: place.start_object,
                    medium: place.medium,
                    beside: place.medium,
                    proper: arrives && vertex.same_side(direction, place.direction),
                }
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let place = vertex.start(scene, -direction);
                let length = (place.x - through).dot(direction);
                let from = place.x - direction * length;
                let medium = scene.medium_at(from);
                let region = target.guide.map_or(medium, |guide| guide.start().region);
                Line {
                    from,
                    to: place.x,
                    direction,
                    length,
                    start_object: None,
                    medium,
                    beside: place.medium,
                    // A beam starts in one medium.
                    proper: medium == region,
                }
            }
        };
        (line.length > 0.0 && line.length.is_finite()).then_some(line)
    }

    /// Cuts the line at the boundaries that it crosses, into `parts`.
    ///
    /// # Errors
    /// [`Failure::OverBudget`] if there are too many boundaries.
    fn cut(&self, scene: &Scene, parts: &mut Vec<RayPart>) -> Result<StraightThroughput, Failure> {
        parts.clear();
        let (mut x, mut medium, mut start_object) = (self.from, self.medium, self.start_object);
        let mut n = scene.n(medium, x);
        let mut throughput = StraightThroughput {
            optical_length: 0.0,
            n: [n; 2],
            jump: 1.0,
            through: PartialTransmission::ALL,
        };
        while parts.len() < MAX_CROSSINGS {
            // The end may be closer to the last boundary than the ray epsilon; the arc still needs
            // a direction.
            let rest = (self.to - x).dot(self.direction).max(scene.ray_epsilon());
            let arc = Arc::line(x, self.direction * n, rest / n);
            let boundary = scene.first_boundary(&arc, start_object);
            let theta_end = boundary.map_or(1.0, |(_, intersection)| intersection.theta);
            throughput.optical_length += rest * theta_end * n;
            throughput.n[1] = n;
            parts.push(RayPart {
                arc,
                theta_end,
                medium,
            });
            let Some((object, intersection)) = boundary else {
                return Ok(throughput);
            };
            if let Some(through) = scene.through(object, &intersection, &arc) {
                throughput.through.times(&through);
            }
            let hit = scene.hit(object, &intersection);
            medium = scene.medium_beside(object, medium, hit.position, hit.normal, self.direction);
            x = leave(scene, hit.position, hit.normal, self.direction);
            start_object = scene.start_object(object, hit.normal, self.direction);
            let n_after = scene.n(medium, x);
            throughput.jump *= n_after / n;
            n = n_after;
        }
        Err(Failure::OverBudget)
    }

    /// Returns the connection along the line, without the test for occlusion.
    fn connection(&self, target: &ConnectionTarget, throughput: &StraightThroughput) -> Connection {
        let (ahead, back, [n_first, n_last]) = (self.direction, -self.direction, throughput.n);
        let point = matches!(target.end, ConnectionEnd::Point { .. });
        let (direction, emission, n_vertex, n_end) = if point {
            (ahead, back, n_first, n_last)
        } else {
            (back, ahead, n_last, n_first)
        };
        let (origin, jacobian) = match target.end {
            ConnectionEnd::Point { position, .. } => (position, self.length * self.length),
            ConnectionEnd::Plane { .. } => (self.from, 1.0),
        };
        let against_light = point == (target.mode == TransportMode::Radiance);
        let PartialTransmission {
            probability,
            factor,
        } = throughput.through;
        let jump = if against_light {
            throughput.jump
        } else {
            throughput.jump.recip()
        };
        Connection {
            direction,
            origin,
            emission,
            geometry: EdgeGeometry {
                geometry_term: throughput.jump / (jacobian * n_last * n_last),
                choice: probability,
                ..EdgeGeometry::new()
            },
            factor: factor * (probability * jump),
            n_vertex,
            n_end,
            optical_length: throughput.optical_length,
            miss: 0.0,
            discovery: 1.0,
        }
    }

    /// Returns true if the line leaves and arrives on the right sides and is within the reach of
    /// branches; see [`crate::path`].
    fn complies(&self, scene: &Scene, target: &ConnectionTarget, parts: &[RayPart]) -> bool {
        let parallel = matches!(target.end, ConnectionEnd::Plane { .. });
        // Leave out the distance to a plane.
        let counted = &parts[usize::from(parallel)..];
        let length = counted.iter().map(|p| p.arc.optical_length(p.theta_end));
        let arrives = parts.last().is_some_and(|last| last.medium == self.beside);
        self.proper && (arrives || !parallel) && scene.branch_reach().includes(length.sum(), 0, 0)
    }
}
