//! Interaction of an edge with a surface: transmission, refraction, reflection, or the end of the
//! edge.
//!
//! Theory: docs/theory.md#connectable-edges, docs/theory.md#declared-index-matches,
//! docs/theory.md#masks-and-panes.

use super::trace::Walk;
use crate::bsdf::{Bsdf, BsdfSample, PartialTransmission, Surface};
use crate::budget::EVENTS_PER_EDGE;
use crate::path::segment::{End, Split, Start, TransportMode, leave, share, surface_at};
use crate::scene::MediumId;
use crate::shape::{Hit, Intersection};
use eikonal::connect::{Pattern, World};
use eikonal::interface::{Interface, Rule};
use eikonal::ray::Variation;
use glam::{DMat3, DVec3};
use std::ops::ControlFlow;

/// Continuation of a ray at a surface.
struct Turn {
    direction: DVec3,
    /// Medium in which the ray continues.
    beyond: MediumId,
    rule: Rule,
    /// Normal of the equivalent flat mirror, if a shading normal determines the reflection.
    mirror: Option<DVec3>,
}

impl Walk<'_, '_> {
    /// Passes a surface, is reflected, or ends there. Breaks if the edge ends.
    pub(super) fn surface(
        &mut self,
        object: usize,
        intersection: Intersection,
        v: DVec3,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let bsdf = &scene.objects()[object].bsdf;
        if self.events.collided && !bsdf.is_null() {
            // Beyond a collision, pass only index-matched boundaries.
            return ControlFlow::Break(());
        }
        let hit = &scene.hit(object, &intersection);
        if bsdf.is_null() {
            return self.pass(object, hit, v);
        }
        let shape = &scene.objects()[object].shape;
        let direction = v.normalize();
        let through = || bsdf.through(&shape.site(hit), hit.normal.dot(direction));
        if let Some(through) = bsdf.is_partial().then(through).flatten() {
            if self.sampler.next_1d() < through.probability {
                return self.pass_by_chance(object, hit, v, through);
            }
            if bsdf.is_delta() {
                self.edge.geometry.choice *= 1.0 - through.probability;
            }
        }
        if bsdf.is_delta() && self.edge.geometry.events < EVENTS_PER_EDGE {
            return self.specular(object, hit, v, direction);
        }
        if bsdf.is_delta() {
            self.events.over_budget = true;
            return self.absorb(true);
        }
        self.edge.geometry.geometry_term = self.ray.differentials.at_point(v, self.travelled.jump);
        self.edge.end = End::Surface {
            object,
            hit: *hit,
            direction,
            medium: self.ray.medium,
        };
        ControlFlow::Break(())
    }

    /// Passes straight through a boundary that is declared index-matched. If the indices
    /// nevertheless differ, power and L are conserved, rather than L/n²: the declared match loses
    /// no energy. See docs/theory.md#declared-index-matches.
    fn pass(&mut self, object: usize, hit: &Hit, v: DVec3) -> ControlFlow<()> {
        let direction = v.normalize();
        let beyond = self.beyond(object, hit, direction);
        let ratio =
            self.scene.n(beyond, hit.position) / self.scene.n(self.ray.medium, hit.position);
        if self.sampling.mode == TransportMode::Radiance {
            // Planted error "index jump at a declared match scored as if matched", found by morgana-transport/transport::furnace::transparent_lens_behind_a_matched_boundary:
            // (no line)
            self.edge.weight *= ratio * ratio;
        }
        self.travelled.jump *= ratio;
        let turn = Turn {
            direction,
            beyond,
            rule: Rule::Pass,
            mirror: None,
        };
        self.continue_walk(object, hit, v, turn)
    }

    /// Passes straight through a surface that transmits part of the light. If the surface separates
    /// media, it is index-matched.
    fn pass_by_chance(
        &mut self,
        object: usize,
        hit: &Hit,
        v: DVec3,
        through: PartialTransmission,
    ) -> ControlFlow<()> {
        self.events.passed_by_chance = true;
        self.edge.weight *= through.factor;
        self.edge.geometry.choice *= through.probability;
        self.pass(object, hit, v)
    }

    /// Refracts or reflects the ray at a smooth surface, at random.
    fn specular(
        &mut self,
        object: usize,
        hit: &Hit,
        v: DVec3,
        direction: DVec3,
    ) -> ControlFlow<()> {
        let bsdf = &self.scene.objects()[object].bsdf;
        let surface = surface_at(self.scene, object, hit, self.ray.medium);
        // Planted error "refraction computed from the chord of the last arc", found by morgana-transport/transport::edges::refraction_uses_the_tangent_of_the_ray:
        // let toward = self.edge.spans.last().map_or(-direction, |s| (s.arc.start() - hit.position).normalize());let Some(sample) = self.sample(object, hit, &surface, toward) else {
        let Some(sample) = self.sample(object, hit, &surface, -direction) else {
            return self.absorb(false);
        };
        self.edge.connectable &= matches!(bsdf, Bsdf::Dielectric(_));
        if !sample.transmitted && sample.pdf < 1.0 {
            self.travelled.reflections += 1;
            // Connections search for patterns of at most this many encounters.
            self.edge.connectable &= self.edge.geometry.events < Pattern::MAX_ENCOUNTERS;
        }
        self.edge.geometry.reflections += u32::from(!sample.transmitted);
        self.edge.geometry.events += 1;
        self.edge.geometry.choice *= sample.pdf;
        self.edge.weight *= sample.weight;
        let is_mirror = !sample.transmitted && bsdf.uses_perturbed_normal(&surface);
        let turn = Turn {
            direction: sample.direction,
            beyond: self.beyond(object, hit, sample.direction),
            rule: if sample.transmitted {
                Rule::Refract
            } else {
                Rule::Reflect
            },
            mirror: is_mirror
                .then(|| (sample.direction - direction).try_normalize())
                .flatten(),
        };
        self.continue_walk(object, hit, v, turn)
    }

    /// Samples refraction or reflection at a smooth surface. If the edge is split, the ray is
    /// refracted.
    fn sample(
        &mut self,
        object: usize,
        hit: &Hit,
        surface: &Surface,
        toward: DVec3,
    ) -> Option<BsdfSample> {
        let bsdf = &self.scene.objects()[object].bsdf;
        let mode = self.sampling.mode;
        let sample = |u| match mode {
            TransportMode::Radiance => bsdf.sample(surface, toward, [u, 0.5, 0.5]),
            TransportMode::Importance => bsdf.sample_importance(surface, toward, [u, 0.5, 0.5]),
        };
        let is_first = self.edge.geometry.events == 0 && matches!(bsdf, Bsdf::Dielectric(_));
        if self.sampling.splitting && is_first {
            let (one, other) = (sample(0.0)?, sample(1.0f64.next_down())?);
            if !one.transmitted && other.transmitted {
                self.edge.split = Some(Box::new(self.split(object, hit, &one)));
                // Planted error "splitting that leave refracted light as it is", found by morgana-transport/transport::first_vertex::parts_add_up:
                // return Some(other);
                return Some(certain(other));
            }
        }
        sample(self.sampler.next_specular(self.edge.geometry.events))
    }

    /// Returns the reflected branch, which is not followed here
    /// (docs/theory.md#first-vertex-techniques).
    fn split(&self, object: usize, hit: &Hit, left_aside: &BsdfSample) -> Split {
        let (scene, direction) = (self.scene, left_aside.direction);
        // Planted error "splitting without what media took before", found by morgana-transport/transport::first_vertex::splitting_keeps_means:
        // let so_far = self.edge.weight;
        let so_far = share(self.sampling.channel_pdf, self.edge.geometry.depth) * self.edge.weight;
        Split {
            start: Start {
                start_object: scene.start_object(object, hit.normal, direction),
                ..Start::point(
                    leave(scene, hit.position, hit.normal, direction),
                    direction,
                    self.beyond(object, hit, direction),
                )
            },
            throughput: so_far * certain(*left_aside).weight,
            optical_length: self.edge.optical_length,
            probability: left_aside.pdf,
        }
    }

    /// Returns the medium on the side of a surface to which a direction points.
    fn beyond(&self, object: usize, hit: &Hit, direction: DVec3) -> MediumId {
        let (x, normal) = (hit.position, hit.normal);
        self.scene
            .medium_beside(object, self.ray.medium, x, normal, direction)
    }

    /// Continues from a surface, given the velocity before the surface.
    fn continue_walk(&mut self, object: usize, hit: &Hit, v: DVec3, turn: Turn) -> ControlFlow<()> {
        let Turn {
            direction,
            beyond,
            rule,
            mirror,
        } = turn;
        self.ray.x = leave(self.scene, hit.position, hit.normal, direction);
        self.ray.start_object = self.scene.start_object(object, hit.normal, direction);
        let (near, far) = (self.scene.field(self.ray.medium), self.scene.field(beyond));
        let alike = || near.n2(hit.position) == far.n2(hit.position);
        if rule == Rule::Pass && near.is_constant() && far.is_constant() && alike() {
            // Equal constant indices change neither the ray nor its differentials.
            self.ray.medium = beyond;
            return ControlFlow::Continue(());
        }
        let local = |field| {
            let (n2, a, ()) = <() as Variation>::local(field, hit.position);
            (n2, a)
        };
        let shape = &self.scene.objects()[object].shape;
        let (normal, shape) = match mirror {
            Some(normal) => (normal, DMat3::ZERO),
            None => (
                hit.normal,
                shape.shape_operator(hit.position, hit.primitive),
            ),
        };
        let interface = Interface {
            normal,
            shape,
            near: local(near),
            far: local(far),
        };
        if let Some(tangents) = self.ray.differentials.tangents() {
            match interface.tangents(rule, v, &tangents) {
                Some(tangents) => self.ray.differentials = tangents.into(),
                None => self.edge.connectable = false,
            }
        }
        self.ray.v = direction * interface.far.0.sqrt();
        self.ray.medium = beyond;
        ControlFlow::Continue(())
    }
}

/// Converts a random sample to a sample with probability 1.
fn certain(sample: BsdfSample) -> BsdfSample {
    BsdfSample {
        weight: sample.weight * sample.pdf,
        pdf: 1.0,
        ..sample
    }
}
