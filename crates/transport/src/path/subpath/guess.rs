//! A cheap guess of what a connection would bring, to decide which ones are worth making.

use super::vertices::PathVertex;
use crate::path::segment::TransportMode;
use crate::scene::Scene;

/// Points closer than this, relative to the size of the scene, count as this far apart.
const CLOSEST: f64 = 1e-3;

/// What a connection between a vertex of a sensor subpath and one of an emitter's subpath would bring if
/// the ray between them were a straight line through a medium like that around the first. Only good
/// for choosing connections by chance (Popov et al., "Probabilistic Connections for Bidirectional Path
/// Tracing", 2015).
pub fn guess(scene: &Scene, z: &PathVertex, y: &PathVertex) -> f64 {
    let chord = y.vertex.position() - z.vertex.position();
    let distance = chord.length();
    if distance == 0.0 {
        return 0.0;
    }
    let (direction, closest) = (chord / distance, CLOSEST * scene.around().radius);
    let scattered = z.throughput
        * z.vertex.eval(scene, direction, TransportMode::Radiance)
        * y.vertex.eval(scene, -direction, TransportMode::Importance)
        * y.throughput;
    let medium = scene.medium(z.vertex.medium());
    let depth = medium.extinction(z.vertex.position()) * distance;
    (scattered * depth.exp_neg()).sum() / (distance * distance + closest * closest)
}
