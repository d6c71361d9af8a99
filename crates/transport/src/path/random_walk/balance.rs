//! Energy balance as an observer of walks from emitters (docs/theory.md#energy-balance).

use super::{CellCollision, CellDetail, FreeFlightEvent, Observer, WalkEvent, WalkRay};
use crate::path::energy_balance::ParticleBalance;
use crate::path::segment::{End, Span, share};
use crate::path::workspace::Workspace;
use crate::scene::CellVolume;
use std::ops::ControlFlow;

impl Observer for ParticleBalance {
    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        let edge = event.edge;
        self.pass(event, &edge.spans);
        let left = || {
            let share = share(event.channel_pdf, edge.geometry.depth);
            (event.ray.throughput * edge.weight * share).sum()
        };
        match &edge.end {
            End::Collision(point) => {
                let albedo = point.albedo(event.scene);
                let absorption = point.rate * albedo.map(|a| 1.0 - a);
                self.media += (event.path(point) * absorption).sum();
            }
            End::Surface { .. } => {
                self.surfaces += left() - event.onward.map_or(0.0, |ray| ray.throughput.sum());
            }
            End::Escaped { .. } => self.escaped += left(),
            End::Dead if edge.lost => self.lost += left(),
            End::Dead => self.surfaces += left(),
        }
        ControlFlow::Continue(())
    }

    fn sees_free_flights(&self) -> bool {
        true
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        self.media += event.ray.throughput.sum() * (1.0 - event.flight.albedo());
    }

    fn detail_in(&self, _volume: &CellVolume) -> CellDetail {
        CellDetail::Cells
    }

    #[inline]
    fn collide_in_cell(&mut self, collision: &CellCollision) {
        self.media += collision.absorbed;
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        let (edge, spans) = (event.edge, &event.edge.spans);
        // Include the span after the cut, whose start is still reached.
        self.pass(event, &spans[..spans.len().min(event.spans + 1)]);
        let (weight, depth) = match spans.get(event.spans) {
            Some(span) => (span.weight_before, span.depth_before),
            None => (edge.weight, edge.geometry.depth),
        };
        self.cut += (event.ray.throughput * weight * share(event.channel_pdf, depth)).sum();
    }

    fn lose(&mut self, ray: &WalkRay) {
        self.lost += ray.throughput.sum();
    }
}

impl ParticleBalance {
    /// Adds the power that smooth surfaces absorb between consecutive spans of an edge.
    fn pass(&mut self, event: &WalkEvent, spans: &[Span]) {
        for pair in spans.windows(2) {
            // Planted error "light that smooth surfaces absorb is missing from the energy balance", found by morgana-transport/transport::meters::conservation::every_particle_is_accounted_for:
            // let weight = pair[1].weight_before - pair[1].weight_before;
            let weight = pair[0].weight_before - pair[1].weight_before;
            let share = share(event.channel_pdf, pair[1].depth_before);
            self.surfaces += (event.ray.throughput * weight * share).sum();
        }
    }
}
