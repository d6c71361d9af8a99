//! Edges made by connection: from a vertex to an emitter, to the sensor, or to another vertex.

use super::target::ConnectionTarget;
use crate::Spectrum;
use crate::connection_end::ConnectionEnd;
use crate::path::segment::{EdgeGeometry, Vertex};
use crate::scene::Scene;
use crate::stats::Stats;
use eikonal::Tolerance;
use eikonal::connect::World;
use eikonal::ray::Arc;
use glam::DVec3;

/// Limits below which two rays count as one branch: an angle in radians, and a multiple of the
/// tolerance of rays. The larger limit applies, because the solver is no more accurate than the
/// rays that it shoots. The limits also apply to the relative difference of optical path lengths.
const SAME_BRANCH: (f64, f64) = (1e-4, 100.0);

/// Slack at the end of a grazing ray, divided by the distance at which the ray misses its target.
/// Within the slack, the ray may touch the surface on which it ends.
const SLACK_PER_MISS: f64 = 1e3;
/// Slack at the end of a ray, divided by the ray epsilon, the distance by which ends are kept off
/// surfaces.
const SLACK_PER_RAY_EPSILON: f64 = 1e3;

/// A ray between a vertex and an end. The fields describe it from the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// Unit direction at the vertex, towards the end.
    pub direction: DVec3,
    /// Position of the ray at the end: the point, or the intersection with the plane.
    pub origin: DVec3,
    /// Unit direction at the end, towards the vertex.
    pub emission: DVec3,
    /// Geometry and optical depth of the ray.
    pub geometry: EdgeGeometry,
    /// Factor of the interfaces along the ray, Fresnel factors included.
    pub factor: Spectrum,
    /// Index at the vertex, on the side where the ray leaves it.
    pub n_vertex: f64,
    /// Index at the end, on the side where the ray arrives.
    pub n_end: f64,
    /// Optical path length.
    pub optical_length: f64,
    /// Distance between the ray and the point to which the solver aimed it.
    pub miss: f64,
    /// Probability that connections discover the ray, for MIS weights. It is 1 for a branch found
    /// from a deterministic start, and less for a branch that only random starts find.
    pub discovery: f64,
}

impl Connection {
    /// Multiplies the factor and the choice probability by the transmission of surfaces that let
    /// light pass straight on. Returns true if any light is left; an opaque or rough surface blocks
    /// the ray. `arcs` are the arcs of the ray, each with the θ at which it ends.
    pub(super) fn passes<'a>(
        &mut self,
        scene: &Scene,
        vertex: &Vertex,
        target: &ConnectionTarget,
        arcs: impl ExactSizeIterator<Item = (&'a Arc, f64)>,
        stats: &mut Stats,
    ) -> bool {
        let slack = SLACK_PER_MISS * self.miss + SLACK_PER_RAY_EPSILON * scene.ray_epsilon();
        let end = match target.end {
            ConnectionEnd::Point { surface, .. } => surface.map(|s| s.object),
            ConnectionEnd::Plane { .. } => vertex.object(),
        };
        let start_object = match target.end {
            ConnectionEnd::Point { .. } => vertex.start_object(scene, self.direction),
            ConnectionEnd::Plane { .. } => None,
        };
        let visible = scene.visibility(arcs, [start_object, end], slack);
        // A mask between media may also transmit nothing.
        let visible = visible.filter(|_| self.geometry.choice > 0.0);
        let Some(through) = visible else {
            stats.connections.occluded += 1;
            return false;
        };
        // Planted error "connections pass masks and panes unweakened", found by morgana-transport/transport::agreement::surfaces::textures_and_masks:
        // self.factor *= through.factor;
        self.factor *= through.factor * through.probability;
        self.geometry.choice *= through.probability;
        true
    }

    /// Returns true if two connections from one vertex to one target are one ray.
    pub(super) fn is_branch_of(&self, tolerance: Tolerance, other: &Connection) -> bool {
        same_way(tolerance, self.direction, other.direction)
            && same_length(tolerance, self.optical_length, other.optical_length)
    }

    /// Returns the transmittance, including the factor of the interfaces.
    pub fn transmittance(&self) -> Spectrum {
        self.geometry.depth.exp_neg() * self.factor
    }
}

fn same_angle(tolerance: Tolerance) -> f64 {
    SAME_BRANCH.0.max(SAME_BRANCH.1 * tolerance.get())
}

pub(super) fn same_way(tolerance: Tolerance, a: DVec3, b: DVec3) -> bool {
    a.distance(b) < same_angle(tolerance)
}

pub(super) fn same_length(tolerance: Tolerance, a: f64, b: f64) -> bool {
    (a - b).abs() < same_angle(tolerance) * a.abs().max(b.abs())
}
