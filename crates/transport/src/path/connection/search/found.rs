//! Conversion of the solver's rays to connections.

use super::Search;
use crate::connection_end::ConnectionEnd;
use crate::path::connection::ray::Connection;
use crate::path::connection::throughput::ConnectionThroughput;
use crate::path::segment::{EdgeGeometry, TransportMode};
use crate::path::workspace::Workspace;
use eikonal::connect::ConnectingRay;

impl Search<'_> {
    /// Makes a connection of a ray that the solver found; the solver still holds the pieces of the
    /// ray.
    pub(super) fn found(&self, ray: &ConnectingRay, ws: &Workspace) -> Connection {
        let target = self.target;
        let throughput = ConnectionThroughput::new(self.scene, ws.solver.pieces());
        // The ray runs from the vertex to a point, or from a plane to the vertex.
        // Planted error "chord directions in the scattering function", found by morgana-transport/transport::edges::connections_follow_the_harmonic_orbit:
        // let near = ws.solver.pieces().last().map_or(ray.start, |p| p.arc.position(p.theta_end) - ray.start).normalize(); let far = -near;
        let (near, far) = (ray.direction_out, -ray.direction_in);
        let from_vertex = matches!(target.end, ConnectionEnd::Point { .. });
        let against_light = from_vertex == (target.mode == TransportMode::Radiance);
        let jump = if against_light {
            throughput.jump
        } else {
            1.0 / throughput.jump
        };
        let [n_first, n_last] = ray.indices;
        let (direction, origin, emission, n_vertex, n_end) = match target.end {
            ConnectionEnd::Point { position, .. } => (near, position, far, n_first, n_last),
            ConnectionEnd::Plane { .. } => (far, ray.start, near, n_last, n_first),
        };
        Connection {
            direction,
            origin,
            emission,
            geometry: EdgeGeometry {
                // Planted error "1/d² as geometry term: the estimators disagree", found by morgana-transport/transport::agreement::branches::estimators_agree_on_all_branches:
                // geometry_term: throughput.jump / (ws.solver.pieces().last().map_or(1.0, |p| p.arc.position(p.theta_end).distance_squared(ray.start)) * n_last * n_last),
                // Planted error "1/d² as geometry term", found by morgana-transport/transport::tallies::irradiance_of_a_luneburg_ball_around_a_point_source:
                // geometry_term: throughput.jump / (ws.solver.pieces().last().map_or(1.0, |p| p.arc.position(p.theta_end).distance_squared(ray.start)) * n_last * n_last),
                geometry_term: throughput.jump / (ray.jacobian * n_last * n_last),
                depth: throughput.depth,
                choice: throughput.choice,
                events: throughput.events,
                reflections: throughput.reflections,
            },
            factor: throughput.factor * jump,
            n_vertex,
            n_end,
            optical_length: ray.optical_length,
            miss: ray.miss,
            discovery: 1.0,
        }
    }
}
