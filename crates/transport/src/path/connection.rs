//! Edges made by connection: from a vertex to an emitter, to the sensor, or to another vertex.

use super::Workspace;
use super::edge::TransportMode;
use super::edge_geometry::EdgeGeometry;
use super::search::{Candidate, Search};
use super::straight;
use super::throughput::ConnectionThroughput;
use super::vertex::Vertex;
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::Emitter;
use crate::sampling::Sampler;
use crate::scene::{MediumId, Scene};
use crate::stats::Stats;
use eikonal::connect::{ConnectingRay, Guide, Piece, World};
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// Directions closer than this, in radians, are those of one branch, and closer than this multiple of
/// the rays' tolerance: the solver is no better than the rays that it shoots. Likewise for the
/// relative difference of optical path lengths.
const SAME_WAY: (f64, f64) = (1e-4, 100.0);

/// A grazing ray touches the surface on which it ends this many times its miss before the end.
const SLACK_PER_MISS: f64 = 1e3;
/// Likewise for the distance by which ends are kept off surfaces.
const SLACK_PER_RAY_EPSILON: f64 = 1e3;

/// What connections are worth, each with a weight: hardly ever more than one.
pub type Weighted<T> = SmallVec<[(T, f64); 1]>;

/// What a vertex is to be connected to.
#[derive(Clone, Copy, Debug)]
pub struct ConnectionTarget<'a> {
    /// Where the connection should end.
    pub aim: ConnectionEnd,
    /// Whether the connection may arrive on either side of the aim's surface, rather than on that of
    /// the aim's normal only.
    pub two_sided: bool,
    /// Medium at the aim, if it is a point.
    pub medium: Option<MediumId>,
    /// Centre and radius of the part of a plane from which light may come.
    pub disc: (DVec3, f64),
    /// Where a beam goes.
    pub guide: Option<&'a Guide<MediumId>>,
    /// What the vertex's own subpath carries: the aim is then at the other end of the path.
    pub mode: TransportMode,
}

impl<'a> ConnectionTarget<'a> {
    /// An aim at an emitter.
    pub fn emitter(scene: &'a Scene, emitter: usize, aim: ConnectionEnd) -> Self {
        let around = scene.around();
        let disc = match &scene.emitters()[emitter] {
            // Where nothing to speak of is left of a beam.
            Emitter::Collimated(beam) => (beam.origin(), 3.0 * beam.radius()),
            _ => (around.center, around.radius),
        };
        ConnectionTarget {
            aim,
            two_sided: false,
            medium: scene.medium_of_aim(&aim),
            disc,
            guide: scene.guide(emitter),
            mode: TransportMode::Radiance,
        }
    }

    /// An aim at the sensor.
    pub fn sensor(scene: &'a Scene, aim: ConnectionEnd) -> Self {
        let around = scene.around();
        ConnectionTarget {
            aim,
            two_sided: false,
            medium: scene.medium_of_aim(&aim),
            disc: (around.center, around.radius),
            guide: None,
            mode: TransportMode::Importance,
        }
    }

    /// The side of the aim's surface that light must leave it on, for a ray that arrives in `direction`.
    pub(super) fn facing(&self, on: &OnSurface, direction: DVec3) -> DVec3 {
        match self.two_sided && on.normal.dot(direction) > 0.0 {
            true => -on.normal,
            false => on.normal,
        }
    }

    /// A vertex of an emitter's subpath.
    pub fn vertex(vertex: &Vertex) -> Self {
        ConnectionTarget {
            aim: vertex.aim(),
            two_sided: true,
            medium: Some(vertex.medium()),
            disc: (DVec3::ZERO, 0.0),
            guide: None,
            mode: TransportMode::Radiance,
        }
    }
}

/// A ray between a vertex and an aim, seen from the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// Unit direction at the vertex, towards the aim.
    pub direction: DVec3,
    /// Where the ray meets the aim.
    pub origin: DVec3,
    /// Unit direction at the aim, towards the vertex.
    pub emission: DVec3,
    /// Geometry and depth.
    pub geometry: EdgeGeometry,
    /// Factor of the interfaces on the way, Fresnel's included.
    pub factor: Spectrum,
    /// Index at the vertex, on the side where the ray leaves it.
    pub n_vertex: f64,
    /// Index at the aim, on the side where the ray arrives.
    pub n_aim: f64,
    /// Optical path length.
    pub optical_length: f64,
    /// How far the ray passes from the point that it was aimed at.
    pub miss: f64,
    /// Probability that connections discover it, as multiple importance sampling takes it: 1 for a branch that
    /// is found for certain, less for one that only random starts find.
    pub discovery: f64,
}

impl Connection {
    /// Connects a vertex to a target along all branches (docs/theory.md#branches) and asks `evaluate` what each is worth;
    /// returns what it answers, each with a weight. Sums of value times weight are unbiased: rays
    /// found from deterministic starts have weight 1, others the reciprocal of the probability that they
    /// are found. Rays that are blocked or worth nothing (`None`) are left out. Every
    /// attempt and its outcome is counted.
    pub fn each<T>(
        scene: &Scene,
        (vertex, target): (&Vertex, &ConnectionTarget),
        sampler: &mut Sampler,
        ws: &mut Workspace,
        evaluate: impl Fn(&Connection) -> Option<T>,
    ) -> Weighted<T> {
        // Where nothing bends rays there is one branch at most, in closed form.
        if scene.is_straight() {
            ws.stats.connections.certified += 1;
            let connection = straight::connect(scene, (vertex, target), ws);
            let value = connection.and_then(|connection| evaluate(&connection));
            return value.map(|value| (value, 1.0)).into_iter().collect();
        }
        // The branches from deterministic starts count with weight 1.
        let search = Search::new(scene, vertex, target);
        let mut values = SmallVec::new();
        let mut known: Vec<Connection> = Vec::new();
        for candidate in search.certain() {
            let Some(connection) = search.attempt(&candidate, ws) else {
                continue;
            };
            // Several starts may lead to one branch.
            if known.iter().any(|k| k.is_branch_of(scene, &connection)) {
                continue;
            }
            known.push(connection);
            let pieces = ws.solver.pieces().iter().map(Piece::ends);
            if let Some(connection) =
                connection.unless_blocked(scene, (vertex, target), pieces, &mut ws.stats)
            {
                values.extend(evaluate(&connection).map(|value| (value, 1.0)));
            }
        }
        // Further branches: with probability q, one random start, with weight N/q, eq. (sum over branches).
        if search.has_all(!known.is_empty()) {
            ws.stats.connections.certified += 1;
        } else if sampler.next_1d() < ws.search {
            let other =
                |connection: &Connection| !known.iter().any(|k| k.is_branch_of(scene, connection));
            let found = search.at_random(sampler, ws, other, evaluate);
            values.extend(found.map(|(value, weight)| (value, weight / ws.search)));
        }
        values
    }

    /// How easily connections from a vertex to a target find the branch that leaves the vertex in
    /// `direction`, which was found by other means. `optical_length` tells branches from a plane
    /// apart that leave in one direction (docs/theory.md#connection-and-chance).
    pub fn discovery(
        scene: &Scene,
        (vertex, target): (&Vertex, &ConnectionTarget),
        (geometry, direction, optical_length): (&EdgeGeometry, DVec3, Option<f64>),
        ws: &mut Workspace,
    ) -> f64 {
        if scene.is_straight() {
            return 1.0;
        }
        let search = Search::new(scene, vertex, target);
        if search.has_all(true) {
            return 1.0;
        }
        let same = |connection: Connection| {
            same_way(scene, connection.direction, direction)
                && optical_length.is_none_or(|s| same_length(scene, s, connection.optical_length))
        };
        let mut certain = search.certain();
        match certain.any(|candidate| search.solve(&candidate, ws).is_some_and(same)) {
            true => 1.0,
            false => ws.random_discovery(geometry),
        }
    }

    /// The connection that a candidate found, whose pieces the solver still holds.
    pub(super) fn new(
        scene: &Scene,
        target: &ConnectionTarget,
        (candidate, ray): (&Candidate, &ConnectingRay),
        ws: &Workspace,
    ) -> Option<Connection> {
        let pieces = ws.solver.pieces();
        let throughput = ConnectionThroughput::new(scene, pieces);
        let last = pieces.last()?;
        // The ray is followed from the vertex to a point, but from a plane to the vertex.
        let (near, far) = (ray.direction_out, -ray.direction_in);
        let from_vertex = matches!(target.aim, ConnectionEnd::Point { .. });
        let n_last = scene.n(last.region, candidate.end_point);
        let against_light = from_vertex == (target.mode == TransportMode::Radiance);
        let jump = if against_light {
            throughput.jump
        } else {
            1.0 / throughput.jump
        };
        let n_first = scene.n(candidate.start.region, ray.start);
        let (direction, origin, emission, n_vertex, n_aim) = match target.aim {
            ConnectionEnd::Point { position, .. } => (near, position, far, n_first, n_last),
            ConnectionEnd::Plane { .. } => (far, ray.start, near, n_last, n_first),
        };
        Some(Connection {
            direction,
            origin,
            emission,
            geometry: EdgeGeometry {
                geometry_term: throughput.jump / (ray.jacobian * n_last * n_last),
                depth: throughput.depth,
                choice: throughput.choice,
                events: throughput.events,
                reflections: throughput.reflections,
            },
            factor: throughput.factor * jump,
            n_vertex,
            n_aim,
            optical_length: ray.optical_length,
            miss: ray.miss,
            discovery: 1.0,
        })
    }

    /// The connection less what surfaces on the way take of the light that passes them straight on; `None` if an
    /// opaque or rough one blocks the ray, whose arcs are given with the θ where they end.
    pub(super) fn unless_blocked<'a>(
        mut self,
        scene: &Scene,
        (vertex, target): (&Vertex, &ConnectionTarget),
        arcs: impl ExactSizeIterator<Item = (&'a Arc, f64)>,
        stats: &mut Stats,
    ) -> Option<Connection> {
        let slack = SLACK_PER_MISS * self.miss + SLACK_PER_RAY_EPSILON * scene.ray_epsilon();
        let end = match target.aim {
            ConnectionEnd::Point { surface, .. } => surface.map(|s| s.object),
            ConnectionEnd::Plane { .. } => vertex.object(),
        };
        let left = match target.aim {
            ConnectionEnd::Point { .. } => vertex.left(scene, self.direction),
            ConnectionEnd::Plane { .. } => None,
        };
        let Some(through) = scene.visibility(arcs, [left, end], slack) else {
            stats.connections.occluded += 1;
            return None;
        };
        self.factor *= through.factor * through.probability;
        self.geometry.choice *= through.probability;
        Some(self)
    }

    /// Whether two connections of one vertex to one target are the same ray.
    pub(super) fn is_branch_of(&self, scene: &Scene, other: &Connection) -> bool {
        same_way(scene, self.direction, other.direction)
            && same_length(scene, self.optical_length, other.optical_length)
    }

    /// Transmittance, the factor of the interfaces included.
    pub fn transmittance(&self) -> Spectrum {
        self.geometry.depth.exp_neg() * self.factor
    }
}

fn same_angle(scene: &Scene) -> f64 {
    SAME_WAY.0.max(SAME_WAY.1 * scene.tolerance().get())
}

fn same_way(scene: &Scene, a: DVec3, b: DVec3) -> bool {
    a.distance(b) < same_angle(scene)
}

fn same_length(scene: &Scene, a: f64, b: f64) -> bool {
    (a - b).abs() < same_angle(scene) * a.abs().max(b.abs())
}

/// The aim with which a connection to an environment would look in the direction `toward`.
pub fn environment_aim(scene: &Scene, toward: DVec3) -> ConnectionEnd {
    let around = scene.around();
    ConnectionEnd::Plane {
        through: around.center + toward * (2.0 * around.radius),
        direction: -toward,
        beam: false,
    }
}
