//! Ends of a segment of the walk: at a boundary, which transmits or reflects the path, or at light
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::arrival::Arrival;
use super::fresnel::FresnelShare;
use super::record::{Crossed, Found, SegmentEnd};
use super::walk::{Met, Walking};
use crate::bsdf::{Bsdf, Dielectric};
use crate::budget::EVENTS_PER_EDGE;
use crate::connection_end::OnSurface;
use crate::scene::MediumId;
use eikonal::adjoint::{FlightCrossing, FlightPoint};
use eikonal::connect::World;
use eikonal::interface::{Interface, Rule};
use glam::DVec3;
use std::ops::{ControlFlow, Range};

impl Walking<'_, '_> {
    /// Passes a boundary, reflects at it, or ends on a panel.
    pub(super) fn meet(&mut self, end: FlightPoint, met: &Met) -> ControlFlow<()> {
        let scene = self.walk.scene;
        let (object, hit) = &met.what;
        let object = &scene.objects()[*object];
        match &object.bsdf {
            Bsdf::Null => self.cross(end, met, None),
            Bsdf::Dielectric(dielectric) => self.choose(end, met, dielectric),
            _ => {
                let arrival = Arrival::Panel {
                    on: OnSurface {
                        object: met.what.0,
                        normal: hit.normal,
                        site: object.shape.site(hit),
                    },
                    medium: self.medium,
                };
                let spans = self.path.keep();
                self.arrive(arrival, spans, end)
            }
        }
    }

    /// Samples reflection or refraction at a smooth dielectric.
    fn choose(&mut self, end: FlightPoint, met: &Met, dielectric: &Dielectric) -> ControlFlow<()> {
        if self.events >= EVENTS_PER_EDGE {
            self.stats.over_budget.rays += 1;
            return self.lose();
        }
        let n2 = [self.medium, self.beyond(met, end.v)].map(|m| self.walk.scene.field(m).n2(end.x));
        let p = met.normal.dot(end.v).abs();
        let reflected = FresnelShare::reflected(p, n2);
        let probability = reflected.probability();
        let is_reflected = self.sampler.next_specular(self.events) < probability;
        let (share, probability) = if is_reflected {
            (reflected, probability)
        } else {
            (reflected.rest(), 1.0 - probability)
        };
        let [near, far] = n2.map(f64::sqrt);
        let (tint, _) = dielectric.crossing(p / end.v.length(), near, far, !is_reflected);
        self.throughput *= tint * (share.value / probability);
        self.events += 1;
        self.depth = self.depth.saturating_add(1);
        let rule = if is_reflected {
            Rule::Reflect
        } else {
            Rule::Refract
        };
        self.cross(end, met, Some((share, rule)))
    }

    /// Returns the medium behind a boundary.
    fn beyond(&self, met: &Met, v: DVec3) -> MediumId {
        let (object, hit) = &met.what;
        let scene = self.walk.scene;
        scene.medium_beside(*object, self.medium, hit.position, hit.normal, v)
    }

    /// Continues behind a boundary, or reflected by it.
    fn cross(
        &mut self,
        end: FlightPoint,
        met: &Met,
        shared: Option<(FresnelShare, Rule)>,
    ) -> ControlFlow<()> {
        let scene = self.walk.scene;
        let (object, hit) = &met.what;
        let far = self.beyond(met, end.v);
        let local = |medium| {
            let (n2, grad) = scene.field(medium).gradient(end.x);
            (n2, grad * 0.5)
        };
        let interface = Interface {
            normal: met.normal,
            shape: scene.objects()[*object]
                .shape
                .shape_operator(hit.position, hit.primitive),
            near: local(self.medium),
            far: local(far),
        };
        let rule = shared.map_or(Rule::Pass, |(_, rule)| rule);
        let Some(after) = interface.velocity(rule, end.v) else {
            return self.lose();
        };
        if rule == Rule::Pass {
            // L, not L/n², is conserved at declared index matches.
            self.throughput *= interface.far.0 / interface.near.0;
        }
        let crossing = FlightCrossing {
            x: end.x,
            interface,
            rule,
            before: end.v,
            after,
        };
        self.end(SegmentEnd::Crossed(Box::new(Crossed {
            end,
            crossing,
            far,
            share: shared.map(|(share, _)| share),
        })));
        let off = scene.ray_epsilon().copysign(met.normal.dot(after));
        self.x = end.x + met.normal * off;
        self.v = after;
        self.direction = None;
        if rule != Rule::Reflect {
            self.medium = far;
        }
        if self.throughput.is_zero() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Leaves the scene.
    pub(super) fn leave(&mut self, end: FlightPoint) -> ControlFlow<()> {
        let arrival = Arrival::Sky {
            direction: end.v.normalize(),
            medium: self.medium,
        };
        // The point of exit does not matter: use the start of the segment.
        let start = FlightPoint {
            x: self.x,
            v: self.v,
            length: 0.0,
        };
        self.arrive(arrival, 0..0, start)
    }

    /// Ends the path at light.
    fn arrive(
        &mut self,
        arrival: Arrival,
        spans: Range<usize>,
        end: FlightPoint,
    ) -> ControlFlow<()> {
        let depth = self.depth.saturating_add(1);
        if depth <= self.walk.max_depth {
            let light = arrival.light(self.walk.scene, end.x, end.v.normalize());
            self.end_after(spans, SegmentEnd::Arrived(end));
            self.path.found = Some(Found {
                arrival,
                throughput: self.throughput,
                value: self.throughput * light,
                depth,
            });
        }
        ControlFlow::Break(())
    }
}
