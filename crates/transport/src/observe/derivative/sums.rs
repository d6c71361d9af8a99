//! Sums of derivatives, parameter by parameter.

use super::Plan;
use super::tape::{EdgeEvent, Factor, Place, Segment, Tape};
use crate::Spectrum;
use crate::bsdf::{BsdfEvent, Surface};
use crate::emitter::{EmittedRay, Emitter};
use crate::path::surface_at;
use crate::scene::{MediumId, Scene};
use glam::DVec3;

/// Sums of derivatives, in rows of [`Plan::stride`] numbers. Each functional that is differentiated
/// has a row.
#[derive(Debug)]
pub(crate) struct Sums<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    values: &'a mut [f64],
    /// Start of the current row.
    row: usize,
    /// Sum of the weighted contributions from each factor of the path on.
    worth: Vec<Spectrum>,
}

impl<'a> Sums<'a> {
    /// Creates sums that add to `values`.
    pub(crate) fn new(scene: &'a Scene, plan: &'a Plan, values: &'a mut [f64]) -> Self {
        Sums {
            scene,
            plan,
            values,
            row: 0,
            worth: Vec::new(),
        }
    }

    /// Adds the derivative of Σ `worths` over the contributions of a path, by all parameters, to a
    /// row. One sweep backwards visits the path's factors, each with the sum of all weighted
    /// contributions after it (docs/theory.md#derivatives-of-light).
    pub(crate) fn add(&mut self, row: usize, tape: &Tape, worths: impl Iterator<Item = Spectrum>) {
        self.row = row * self.plan.stride();
        let mut worth = std::mem::take(&mut self.worth);
        worth.clear();
        worth.resize(tape.factors.len() + 1, Spectrum::ZERO);
        let mut all = Spectrum::ZERO;
        for (places, value) in tape.kept.iter().zip(worths) {
            all += value;
            places.iter().for_each(|p| worth[p.number()] += value);
        }
        for (i, placed) in tape.factors.iter().enumerate().rev() {
            let onward = worth[Place::after(i).number()];
            if !onward.is_zero() {
                // Planted error "derivatives of light that is found later left out", found by morgana-transport/transport::derivatives::media::derivatives_are_differences_where_rays_are_straight:
                // (no line)
                worth[placed.before.number()] += onward;
                self.factor(&placed.factor, onward);
            }
        }
        if let Some(start) = self.plan.exposure {
            self.put(start, 0, all);
        }
        self.worth = worth;
    }

    /// Adds to a row a derivative `worth` by the absorption coefficient at a position.
    pub(crate) fn absorb(&mut self, row: usize, id: MediumId, x: DVec3, worth: Spectrum) {
        self.row = row * self.plan.stride();
        self.absorption(id, x, worth);
    }

    fn absorption(&mut self, id: MediumId, x: DVec3, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let (plan, medium) = (&plan.media[id], scene.medium(id));
        if let Some(start) = plan.absorption {
            plan.chart
                .at(x, |i, weight| self.put(start, i, worth * weight));
        }
        // Use μ_a = σ_t (1 − α).
        if let Some(start) = plan.extinction {
            // Planted error "absorption that grows too fast with the extinction in derivatives", found by morgana-transport/transport::meters::emission_derivatives::derivatives_of_media_that_emit_conserve_power:
            // let share = worth * medium.albedo.at(x).map(|a| 2.0 - a);
            let share = worth * medium.albedo.at(x).map(|a| 1.0 - a);
            plan.chart
                .at(x, |i, weight| self.put(start, i, share * weight));
        }
        if let Some(start) = plan.albedo {
            let share = worth * medium.extinction(x);
            let chart = &plan.albedo_chart;
            chart.at(x, |i, weight| self.put(start, i, share * -weight));
        }
    }

    /// Adds the derivative of a factor's logarithm, times `worth`: the sum of the weighted
    /// contributions after the factor.
    fn factor(&mut self, factor: &Factor, worth: Spectrum) {
        match factor {
            Factor::Attenuation(segment) => self.attenuation(segment, worth),
            Factor::Scattering { medium, x } => self.scattering(*medium, *x, worth),
            Factor::Phase { medium, x, cos } => self.phase(*medium, *x, *cos, worth),
            Factor::Surface {
                object,
                surface,
                event,
            } => self.surface(*object, surface, event, worth),
            Factor::EdgeEvent(edge_event) => self.edge_event(edge_event, worth),
            Factor::Connection { segment, bounded } => {
                self.attenuation(segment, worth);
                if self.plan.has_panes {
                    self.panes(segment, *bounded, worth);
                }
            }
            Factor::Emission(ray) => self.emission(ray, worth),
        }
    }

    /// Adds ∂ log e^−∫σ_t ds = −∫∂σ_t ds.
    fn attenuation(&mut self, segment: &Segment, worth: Spectrum) {
        let plan: &'a Plan = self.plan;
        let plan = &plan.media[segment.medium];
        let Some(start) = plan.attenuation else {
            return;
        };
        let (arc, theta) = (&segment.arc, segment.theta);
        if self.plan.channels > 1 {
            return plan.chart.along(arc, theta, |i, length| {
                self.put(start, i, worth * -length);
            });
        }
        let sums = &mut self.values[self.row + start..];
        plan.chart.along(arc, theta, |i, length| {
            sums[i] -= worth[0] * length;
        });
    }

    /// Adds ∂ log σ_s, where σ_s = σ_t α.
    fn scattering(&mut self, id: MediumId, x: DVec3, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let (plan, medium) = (&plan.media[id], scene.medium(id));
        if let Some(start) = plan.extinction {
            let share = over(worth, medium.extinction(x));
            plan.chart
                .at(x, |i, weight| self.put(start, i, share * weight));
        }
        if let Some(start) = plan.scattering {
            // Planted error "scores of scattering over the extinction", found by morgana-transport/transport::derivatives::identities::coefficients_obey_the_chain_rule:
            // let share = over(worth, medium.extinction(x));
            let share = over(worth, medium.scattering(x));
            plan.chart
                .at(x, |i, weight| self.put(start, i, share * weight));
        }
        if let Some(start) = plan.albedo {
            let share = over(worth, medium.albedo.at(x));
            let chart = &plan.albedo_chart;
            chart.at(x, |i, weight| self.put(start, i, share * weight));
        }
    }

    /// Adds ∂ log p.
    fn phase(&mut self, id: MediumId, x: DVec3, cos: f64, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let plan = &plan.media[id];
        if let Some(start) = plan.mean_cosine {
            let share = worth * scene.medium(id).phase.log_derivative(x, cos);
            let chart = &plan.mean_cosine_chart;
            chart.at(x, |i, weight| self.put(start, i, share * weight));
        }
    }

    /// Adds ∂ log f of a surface, by its colours.
    fn surface(&mut self, object: usize, surface: &Surface, event: &BsdfEvent, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        for by in &plan.objects[object] {
            let bsdf = &scene.objects()[object].bsdf;
            let share = worth * bsdf.tint_derivative(by.tint, surface, event);
            by.colours.weights(&surface.site, |i, weight| {
                // Planted error "derivatives by colours of pixels that count twice with their weights", found by morgana-transport/transport::derivatives::surfaces::derivatives_by_colours_of_a_wall_are_differences:
                // self.put(by.start, i, share * (weight * weight));
                self.put(by.start, i, share * weight);
            });
        }
    }

    /// Adds ∂ log f of a surface at which an edge continues.
    fn edge_event(&mut self, edge_event: &EdgeEvent, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let object = edge_event.object;
        if plan.objects[object].is_empty() {
            return;
        }
        let hit = scene.hit(object, &edge_event.intersection);
        let surface = surface_at(scene, object, &hit, edge_event.medium);
        let event = BsdfEvent {
            toward: -edge_event.from,
            direction: edge_event.to,
            delta: true,
        };
        self.surface(object, &surface, &event, worth);
    }

    /// Adds ∂ log f of the panes and filters along an arc of a connection, and of the boundary at
    /// its end.
    fn panes(&mut self, segment: &Segment, bounded: bool, worth: Spectrum) {
        let Segment { medium, arc, theta } = segment;
        let boundary = bounded.then(|| self.scene.first_boundary(arc, None));
        let within = self.scene.filters_along(arc, *theta);
        // Planted error "boundaries of panes that connections pass left out of derivatives", found by morgana-transport/transport::derivatives::colours::derivatives_by_the_colours_of_what_light_passes_are_differences:
        // for (object, intersection) in within.into_iter().chain(boundary.flatten().filter(|_| false)) {
        // Planted error "panes that connections pass left out of derivatives", found by morgana-transport/transport::derivatives::colours::derivatives_by_the_colours_of_what_light_passes_are_differences:
        // for (object, intersection) in within.into_iter().take(0).chain(boundary.flatten()) {
        for (object, intersection) in within.into_iter().chain(boundary.flatten()) {
            let along = arc.velocity(intersection.theta).normalize();
            let edge_event = EdgeEvent {
                object,
                intersection,
                medium: *medium,
                from: along,
                to: along,
            };
            self.edge_event(&edge_event, worth);
        }
    }

    /// Adds ∂ log of the emission along a ray.
    fn emission(&mut self, ray: &EmittedRay, worth: Spectrum) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let (plan, emitter) = (&plan.emitters[ray.emitter], &scene.emitters()[ray.emitter]);
        if let Some(start) = plan.factor {
            self.put(start, 0, worth);
        }
        if let Emitter::Volume(volume) = emitter
            && let Some(id) = volume.medium()
        {
            return self.emission_of_medium(id, ray, plan.values, worth);
        }
        if let Some(start) = plan.values {
            let values = emitter.values();
            let share = over(worth, values.at(emitter, ray, |_, _| {}));
            values.at(emitter, ray, |i, weight| {
                self.put(start, i, share * weight);
            });
        }
    }

    /// Adds ∂ log (μ_a n² B).
    fn emission_of_medium(
        &mut self,
        id: MediumId,
        ray: &EmittedRay,
        start: Option<usize>,
        worth: Spectrum,
    ) {
        let (plan, scene): (&'a Plan, &'a Scene) = (self.plan, self.scene);
        let (plan, medium) = (&plan.media[id], scene.medium(id));
        if let (Some(start), Some(emission)) = (start, &medium.emission) {
            let share = over(worth, emission.at(ray.x));
            let chart = &plan.emission_chart;
            chart.at(ray.x, |i, weight| self.put(start, i, share * weight));
        }
        let absorption = medium.extinction(ray.x) * medium.albedo.at(ray.x).map(|a| 1.0 - a);
        // Planted error "media that emit whatever they absorb in derivatives", found by morgana-transport/transport::derivatives::emitters::media_that_emit_change_with_their_absorption:
        // let _ = absorption;
        self.absorption(id, ray.x, over(worth, absorption));
    }

    /// Adds to the sums of one number of a parameter, in the current row.
    #[inline]
    fn put(&mut self, start: usize, number: usize, value: Spectrum) {
        let channels = self.plan.channels;
        let first = self.row + start + number * channels;
        let sums = &mut self.values[first..first + channels];
        sums.iter_mut().zip(value.0).for_each(|(sum, v)| *sum += v);
    }
}

/// Returns a quotient, zero in channels where `worth` is zero.
fn over(worth: Spectrum, by: Spectrum) -> Spectrum {
    worth.zip(by, |w, b| if w == 0.0 { 0.0 } else { w / b })
}
