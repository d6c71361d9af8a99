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

/// Directions closer than this, in radians, are those of one branch, and closer than this multiple of
/// the rays' tolerance: the solver is no better than the rays that it shoots. Likewise for the
/// relative difference of optical path lengths.
const SAME_WAY: (f64, f64) = (1e-4, 100.0);

/// A grazing ray touches the surface on which it ends this many times its miss before the end.
const SLACK_PER_MISS: f64 = 1e3;
/// Likewise for the distance by which ends are kept off surfaces.
const SLACK_PER_RAY_EPSILON: f64 = 1e3;

/// A ray between a vertex and an end, seen from the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// Unit direction at the vertex, towards the end.
    pub direction: DVec3,
    /// Where the ray meets the end.
    pub origin: DVec3,
    /// Unit direction at the end, towards the vertex.
    pub emission: DVec3,
    /// Geometry and depth.
    pub geometry: EdgeGeometry,
    /// Factor of the interfaces on the way, Fresnel's included.
    pub factor: Spectrum,
    /// Index at the vertex, on the side where the ray leaves it.
    pub n_vertex: f64,
    /// Index at the end, on the side where the ray arrives.
    pub n_end: f64,
    /// Optical path length.
    pub optical_length: f64,
    /// How far the ray passes from the point that it was aimed at.
    pub miss: f64,
    /// Probability that connections discover it, as multiple importance sampling takes it: 1 for a branch that
    /// is found for certain, less for one that only random starts find.
    pub discovery: f64,
}

impl Connection {
    /// Takes off what surfaces on the way take of the light that passes them straight on. Whether any is left: an
    /// opaque or rough one blocks the ray, whose arcs are given with the θ where they end.
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
        let left = match target.end {
            ConnectionEnd::Point { .. } => vertex.left(scene, self.direction),
            ConnectionEnd::Plane { .. } => None,
        };
        let visible = scene.visibility(arcs, [left, end], slack);
        // Nothing may pass a mask between media either.
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

    /// Whether two connections of one vertex to one target are the same ray.
    pub(super) fn is_branch_of(&self, tolerance: Tolerance, other: &Connection) -> bool {
        same_way(tolerance, self.direction, other.direction)
            && same_length(tolerance, self.optical_length, other.optical_length)
    }

    /// Transmittance, the factor of the interfaces included.
    pub fn transmittance(&self) -> Spectrum {
        self.geometry.depth.exp_neg() * self.factor
    }
}

fn same_angle(tolerance: Tolerance) -> f64 {
    SAME_WAY.0.max(SAME_WAY.1 * tolerance.get())
}

pub(super) fn same_way(tolerance: Tolerance, a: DVec3, b: DVec3) -> bool {
    a.distance(b) < same_angle(tolerance)
}

pub(super) fn same_length(tolerance: Tolerance, a: f64, b: f64) -> bool {
    (a - b).abs() < same_angle(tolerance) * a.abs().max(b.abs())
}
