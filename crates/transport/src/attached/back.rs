//! Sweep backwards along a path (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::majorant::log_albedo_gradient;
use super::record::{AttachedPath, Crossed, Found, SampledChannel, Scattering, SegmentEnd};
use super::{AttachedWalk, arrival::Arrival};
use crate::Spectrum;
use crate::scene::{MediumId, Scene};
use eikonal::adjoint::{FlightAdjoint, FlightDerivative, FlightPoint};
use eikonal::connect::World;
use eikonal::field::IndexDerivative;
use glam::DVec3;

/// Derivative of a path's contribution by the position and the direction with which it continues
/// after an event.
#[derive(Clone, Copy, Debug, Default)]
struct Onward {
    /// Derivative by the position.
    x: DVec3,
    /// Derivative by the direction after a collision, perpendicular to the direction. After a
    /// boundary or a null collision it is the derivative by the velocity.
    way: DVec3,
}

/// State of the backward sweep along a path.
struct Sweep<'p, S> {
    walk: &'p AttachedWalk<'p>,
    scene: &'p Scene,
    /// Weight × contribution of each channel.
    channel_weights: Spectrum,
    /// Sum of `channel_weights` over the channels, by which logarithmic derivatives are multiplied.
    value: f64,
    /// Channel in which the current segment was sampled.
    sampled: SampledChannel,
    sink: S,
}

impl AttachedWalk<'_> {
    /// Computes the derivative of Σ weight × contribution of a path, from its end back to the
    /// sensor. The derivatives by n² and ∇n² at points of media are passed to `sink`.
    pub(crate) fn back(
        &self,
        path: &AttachedPath,
        weights: Spectrum,
        sink: impl FnMut(MediumId, DVec3, IndexDerivative),
    ) {
        let Some(found) = &path.found else {
            return;
        };
        let mut sweep = Sweep {
            walk: self,
            scene: self.scene,
            channel_weights: found.value * weights,
            value: (found.value * weights).sum(),
            sampled: SampledChannel::GREY,
            sink,
        };
        let mut onward = Onward::default();
        for segment in path.segments.iter().rev() {
            let (scene, medium) = (self.scene, segment.medium);
            let field = scene.field(medium);
            let resolved = self.plan.has(medium);
            sweep.sampled = segment.sampled;
            let spans = &path.spans[segment.spans.clone()];
            let mut adjoint = match &segment.end {
                SegmentEnd::Arrived(end) => sweep.arrived(found, weights, end),
                SegmentEnd::Crossed(crossed) => sweep.crossed(crossed, medium, onward),
                SegmentEnd::Scattered(event) => {
                    sweep.scattered(event, medium, resolved, spans, onward)
                }
            };
            let rest = match &segment.end {
                SegmentEnd::Scattered(event) => &spans[..event.step],
                _ => spans,
            };
            let mut add = |x, by| (sweep.sink)(medium, x, by);
            adjoint.back(field, resolved, rest, &mut add);
            onward = match segment.direction {
                Some(direction) => {
                    let start = adjoint.start(field, direction, &mut add);
                    Onward {
                        x: start.x,
                        way: start.direction,
                    }
                }
                None => Onward {
                    x: adjoint.by.x,
                    way: adjoint.by.v,
                },
            };
        }
        // Add the derivative by n² at the sensor.
        if let Some(first) = path.segments.first() {
            let x = path.origin;
            let n2 = self.scene.field(first.medium).n2(x);
            let by = value(sweep.value / n2);
            (sweep.sink)(first.medium, x, by);
        }
    }
}

impl<S: FnMut(MediumId, DVec3, IndexDerivative)> Sweep<'_, S> {
    /// Returns the derivative of the logarithm of a medium's survival probability by the length.
    fn log_survival(&self, medium: MediumId) -> f64 {
        let own = self.walk.majorants.of(medium)[self.sampled.channel];
        self.log_weight(medium) - self.value * own
    }

    /// Returns the derivative of the logarithm of the channels' weights by the length of the
    /// segment.
    fn log_weight(&self, medium: MediumId) -> f64 {
        let extinctions = self.walk.majorants.of(medium);
        let mean = (self.sampled.posterior * extinctions).sum();
        (self.channel_weights * extinctions.map(|sigma| mean - sigma)).sum()
    }

    /// Starts the sweep at the emitter that the path has reached.
    fn arrived(&mut self, found: &Found, weights: Spectrum, end: &FlightPoint) -> FlightAdjoint {
        let scene = self.scene;
        let medium = found.arrival.medium();
        let field = scene.field(medium);
        let (n2, grad) = field.gradient(end.x);
        let [by_x, by_direction] = found.arrival.gradient(scene, weights * found.throughput);
        let unit = end.v.normalize();
        let by = FlightDerivative {
            x: (by_x - grad * self.value) / n2,
            v: (by_direction - unit * unit.dot(by_direction)) / (n2 * end.v.length()),
            length: self.log_survival(medium),
        };
        (self.sink)(medium, end.x, value(-self.value / n2));
        match &found.arrival {
            Arrival::Panel { on, .. } => FlightAdjoint::on_surface(field, end, on.normal, by),
            Arrival::Sky { .. } => FlightAdjoint {
                x: end.x,
                v: end.v,
                by: FlightDerivative { length: 0.0, ..by },
            },
        }
    }

    /// Sweeps back across a boundary.
    fn crossed(&mut self, crossed: &Crossed, medium: MediumId, onward: Onward) -> FlightAdjoint {
        let Crossed {
            end, crossing, far, ..
        } = crossed;
        let (mut by_x, mut by_v, mut by_n2) = crossing.back(onward.x, onward.way);
        let interface = &crossing.interface;
        if let Some(share) = &crossed.share {
            // Add ∂ log of the fraction that is followed; p = |N·v| changes with the normal, too.
            let log = self.value / share.value;
            let side = interface.normal.dot(end.v).signum();
            by_v += interface.normal * (log * share.by_normal * side);
            // Planted error "shares of reflection that do not change with the surface's normal", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
            // (no line)
            by_x += interface.shape * end.v * (log * share.by_normal * side);
            self.share(
                &mut by_x,
                &mut by_n2,
                crossed,
                share.by_n2.map(|by| log * by),
            );
        } else {
            let [near, far] = [interface.near.0, interface.far.0];
            let logs = [-self.value / near, self.value / far];
            self.share(&mut by_x, &mut by_n2, crossed, logs);
        }
        (self.sink)(medium, end.x, value(by_n2[0]));
        (self.sink)(*far, end.x, value(by_n2[1]));
        let by = FlightDerivative {
            x: by_x,
            v: by_v,
            length: self.log_survival(medium),
        };
        FlightAdjoint::on_surface(self.scene.field(medium), end, interface.normal, by)
    }

    /// Adds a derivative by n² on both sides of a boundary. The values of n² change with the field
    /// and with the position.
    fn share(&self, by_x: &mut DVec3, by_n2: &mut [f64; 2], crossed: &Crossed, logs: [f64; 2]) {
        let interface = &crossed.crossing.interface;
        let halves = [interface.near.1, interface.far.1];
        for side in 0..2 {
            by_n2[side] += logs[side];
            *by_x += halves[side] * (2.0 * logs[side]);
        }
    }

    /// Returns the gradient of the logarithm of a collision's factor by its position. The factor is
    /// the collision's acceptance probability, times the albedo if it is real.
    fn log_chance(&self, event: &Scattering, medium: MediumId) -> DVec3 {
        let (x, is_real) = (event.vertex.x, event.onward.is_some());
        let acceptance_ratio = self.walk.majorants.acceptance_ratio(self.scene, medium);
        let by_acceptance =
            acceptance_ratio.map(|c| c.log_gradient(x, self.channel_weights, is_real));
        let by_albedo = is_real
            .then(|| log_albedo_gradient(self.scene.medium(medium), x, self.channel_weights));
        by_acceptance.unwrap_or_default() + by_albedo.unwrap_or_default()
    }

    /// Sweeps back across a collision. The sweep has returned to the start of the step that
    /// contains the collision.
    fn scattered(
        &mut self,
        event: &Scattering,
        medium: MediumId,
        resolved: bool,
        spans: &[f64],
        onward: Onward,
    ) -> FlightAdjoint {
        let field = self.scene.field(medium);
        let vertex = &event.vertex;
        let by_v = match event.onward {
            // The frame turns with the direction by the shortest rotation, and the direction after
            // the collision turns with the frame.
            Some(direction) => {
                let n = vertex.v.length();
                // Planted error "directions after collisions that do not turn with those before", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
                // direction.cross(onward.way).cross(vertex.v / n) * 0.0
                direction.cross(onward.way).cross(vertex.v / n) / n
            }
            None => onward.way,
        };
        let by = FlightDerivative {
            // Planted error "extinction that does not change where a collision moves to", found by morgana-transport/transport::index_absorption:
            // x: onward.x,
            x: onward.x + self.log_chance(event, medium),
            v: by_v,
            length: 0.0,
        };
        let (mut adjoint, by_length) = FlightAdjoint::at_length(field, vertex, by);
        // Planted error "channels whose weights do not change with how long a flight is", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
        // (no line)
        let by_length = by_length + self.log_weight(medium);
        let mut add = |x, by| (self.sink)(medium, x, by);
        adjoint.back(field, resolved, &[event.span], &mut add);
        if let Some(beyond) = &event.boundary {
            // The collision moves along with the boundary, and its probability changes.
            let by = FlightDerivative {
                // Planted error "collisions that do not get more likely where the boundary moves away", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
                // length: by_length * beyond.length,
                // Planted error "collisions that do not move along with the boundary", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
                // length: self.value * beyond.log,
                length: by_length * beyond.length + self.value * beyond.log,
                ..FlightDerivative::default()
            };
            let mut end = FlightAdjoint::on_surface(field, &beyond.end, beyond.normal, by);
            end.back(field, resolved, &spans[event.step..], &mut add);
            adjoint.by.x += end.by.x;
            adjoint.by.v += end.by.v;
            adjoint.by.length += end.by.length;
        }
        adjoint
    }
}

/// Returns a derivative by n² alone.
fn value(n2: f64) -> IndexDerivative {
    IndexDerivative {
        n2,
        gradient: DVec3::ZERO,
    }
}
