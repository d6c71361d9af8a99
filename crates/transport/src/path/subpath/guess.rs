//! Cheap estimates of the contribution of a connection, for choosing the connections to make.

use super::vertices::PathVertex;
use crate::path::segment::TransportMode;
use crate::scene::Scene;

/// Distance, relative to the radius of the scene, that limits the estimate for close points.
const MIN_RELATIVE_DISTANCE: f64 = 1e-3;

/// Estimates the contribution of a connection between a vertex of a sensor subpath and a vertex of
/// an emitter's subpath. The estimate assumes a straight ray through a medium like the medium at
/// the first vertex. Use it only to choose connections at random (Popov et al., "Probabilistic
/// Connections for Bidirectional Path Tracing", 2015).
pub fn guess(scene: &Scene, z: &PathVertex, y: &PathVertex) -> f64 {
    let chord = y.vertex.position() - z.vertex.position();
    let distance = chord.length();
    if distance == 0.0 {
        return 0.0;
    }
    let (direction, closest) = (
        chord / distance,
        MIN_RELATIVE_DISTANCE * scene.around().radius,
    );
    let scattered = z.throughput
        * z.vertex.eval(scene, direction, TransportMode::Radiance)
        * y.vertex.eval(scene, -direction, TransportMode::Importance)
        * y.throughput;
    let medium = scene.medium(z.vertex.medium());
    let depth = medium.extinction(z.vertex.position()) * distance;
    (scattered * depth.exp_neg()).sum() / (distance * distance + closest * closest)
}
