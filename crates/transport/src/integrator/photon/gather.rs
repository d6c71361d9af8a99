//! What a sensor ray sees in a photon map: the photons around it, or around a place that it samples, and
//! those on the first surface that is not specular.
//!
//! Theory: docs/theory.md#photon-maps.

use super::{PhotonMapping, PhotonQuery};
use crate::Spectrum;
use crate::budget::PHOTONS_PER_GATHER;
use crate::film::PathFacts;
use crate::path::Point;
use crate::path::{
    Edge, End, Sampling, Start, TransportMode, Vertex, Workspace, gather_in_view, trace,
};
use crate::photons::{Kernel, Photon, PhotonMap, Radii, pieces};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// Light that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gathered {
    /// Its value.
    pub value: Spectrum,
    /// The part of it that is bias, to second order in the radius.
    pub bias: Spectrum,
    /// What is known of the path.
    pub path: PathFacts,
}

/// Where a sensor ray has got to.
struct Sight {
    start: Start,
    /// In basic radiance: n² of the sensor included.
    throughput: Spectrum,
    /// Edges and specular events.
    depth: u32,
    optical_length: f64,
}

/// What gathering needs to know.
pub(crate) struct Gathering<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// How it is seen.
    pub mapping: &'a PhotonMapping,
    /// The photons.
    pub map: &'a PhotonMap,
    /// How far around a ray, or a place, they count.
    pub radii: Radii,
    /// Probabilities of the channels; none of those that are not in use.
    pub channel_pdf: Spectrum,
}

impl Gathering<'_> {
    /// Hands over what is found along a sensor ray.
    pub(crate) fn along(
        &self,
        ray: SensorRay,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        mut found: impl FnMut(Gathered),
    ) {
        let scene = self.scene;
        // Start at the sensor, with throughput n_s².
        let start = Start::point(
            ray.origin,
            ray.direction,
            scene.medium_of_sensor_ray(ray.origin),
        );
        let n = scene.n(start.medium, start.x);
        let white = self.channel_pdf.map(|p| if p > 0.0 { n * n } else { 0.0 });
        gather_in_view(
            scene,
            start,
            self.channel_pdf,
            sampler,
            ws,
            |along, _, _| {
                if self
                    .mapping
                    .max_depth
                    .is_none_or(|limit| along.depth <= limit)
                {
                    found(Gathered {
                        value: along.light * white,
                        bias: Spectrum::ZERO,
                        path: PathFacts {
                            optical_length: along.optical_length,
                            bounces: along.depth - 1,
                            emitter: along.emitter,
                        },
                    });
                }
            },
        );
        let mut next = Some(Sight {
            start,
            throughput: white,
            depth: 0,
            optical_length: 0.0,
        });
        while let Some(sight) = next {
            // Follow γ to its next vertex: through media for beams, to a collision for points.
            let sampling = Sampling {
                mode: TransportMode::Radiance,
                channel_pdf: self.channel_pdf,
                extend: false,
                collides: self.mapping.query == PhotonQuery::Point,
                spans: self.mapping.query == PhotonQuery::Beam,
                parts: false,
                forced: false,
                differentials: false,
                splitting: false,
            };
            let mut edge = trace(scene, sight.start, sampling, sampler, ws);
            edge.tabulate();
            // Sum over the photons in media.
            match (self.mapping.query, &edge.end) {
                (PhotonQuery::Beam, _) => self.beside(&sight, &edge, ws, &mut found),
                (PhotonQuery::Point, End::Collision(point)) => {
                    self.around(&sight, &edge, point, &mut found)
                }
                (PhotonQuery::Point, _) => {}
            }
            // Sum over those on the surface, and go on where it is smooth.
            next = self.arrive(sight, &edge, sampler, &mut found);
        }
    }

    /// The photons beside an edge: each counts where the edge is closest.
    fn beside(
        &self,
        sight: &Sight,
        edge: &Edge,
        ws: &mut Workspace,
        found: &mut impl FnMut(Gathered),
    ) {
        let kernel = Kernel::disc(self.radii.volume);
        let mut looked_at = 0;
        let mut optical_length = sight.optical_length;
        for span in &edge.spans {
            for piece in pieces(span, kernel.radius()) {
                if looked_at > PHOTONS_PER_GATHER || ws.stop.is_raised() {
                    ws.stats.over_budget.gathers += 1;
                    return;
                }
                let photon = |photon: &Photon| {
                    looked_at += 1;
                    // The foot γ(s_p) of the perpendicular from x_p.
                    let Some((theta, squared)) = piece.foot(photon.x) else {
                        return;
                    };
                    let point = span.at(theta);
                    // T e^{−τ(s_p)} F̄.
                    let seen = Seen {
                        throughput: sight.throughput * point.weight * point.depth.exp_neg(),
                        depth: sight.depth + 1 + span.events_before,
                        optical_length: optical_length + span.arc.optical_length(theta),
                    };
                    // p(ω_p, −γ′) K₂.
                    let scattered = photon.phase(self.scene, point.direction);
                    self.count(photon, &seen, scattered, kernel.weigh(squared), found);
                };
                self.map
                    .volume
                    .visit(|bounds| piece.touches(bounds), photon);
            }
            optical_length += span.arc.optical_length(span.theta_end);
        }
    }

    /// The photons around a collision.
    fn around(&self, sight: &Sight, edge: &Edge, point: &Point, found: &mut impl FnMut(Gathered)) {
        let kernel = Kernel::ball(self.radii.volume);
        // T e^{−τ(s)} F̄/p(s).
        let density = edge.collision_density(self.channel_pdf, point);
        let seen = Seen {
            throughput: sight.throughput * point.weight * point.depth.exp_neg() / density,
            depth: sight.depth + 1 + edge.geometry.events,
            optical_length: sight.optical_length + edge.optical_length,
        };
        self.map.volume.visit(
            |bounds| bounds.nearest_distance(point.x) < kernel.radius(),
            |photon| {
                // p(ω_p, −γ′) K₃.
                let weighed = kernel.between(photon.x, point.x);
                let scattered = photon.phase(self.scene, point.direction);
                self.count(photon, &seen, scattered, weighed, found);
            },
        );
    }

    /// At the end of an edge: light that is emitted there, and light on the surface. Goes on only along a
    /// specular lobe.
    fn arrive(
        &self,
        sight: Sight,
        edge: &Edge,
        sampler: &mut Sampler,
        found: &mut impl FnMut(Gathered),
    ) -> Option<Sight> {
        // T e^{−τ} F̄/P; P = 1 for beams.
        let chance = match self.mapping.query {
            PhotonQuery::Beam => 1.0,
            PhotonQuery::Point => edge.geometry.survival(self.channel_pdf),
        };
        let seen = Seen {
            throughput: sight.throughput * edge.weight * edge.geometry.depth.exp_neg() / chance,
            depth: sight.depth + 1 + edge.geometry.events,
            optical_length: sight.optical_length + edge.optical_length,
        };
        if self
            .mapping
            .max_depth
            .is_some_and(|limit| seen.depth > limit)
        {
            return None;
        }
        // Light that is emitted: by environments, or by the surface.
        if let End::Escaped { direction, medium } = edge.end {
            let n = self.scene.n(medium, edge.start.x);
            for (emitter, environment) in self.scene.environments() {
                self.emission(&seen, emitter, environment.radiance(direction), n, found);
            }
        }
        let vertex = Vertex::of(self.scene, edge)?;
        let Vertex::Surface { x, .. } = vertex else {
            return None;
        };
        if let Some((emitter, radiance, _)) = vertex.emitted(self.scene) {
            self.emission(
                &seen,
                emitter,
                radiance,
                self.scene.n(vertex.medium(), x),
                found,
            );
        }
        // Light that falls on the surface, by its photons.
        self.on_surface(&seen, &vertex, found);
        // Go on along a specular lobe only.
        let scatter = vertex.scatter(self.scene, TransportMode::Radiance, sampler)?;
        scatter.delta.then(|| Sight {
            start: scatter.start,
            throughput: seen.throughput * scatter.weight,
            depth: seen.depth,
            optical_length: seen.optical_length,
        })
    }

    /// The photons on a surface around a vertex.
    fn on_surface(&self, seen: &Seen, vertex: &Vertex, found: &mut impl FnMut(Gathered)) {
        let (x, kernel) = (vertex.position(), Kernel::disc(self.radii.surface));
        self.map.surface.visit(
            |bounds| bounds.nearest_distance(x) < kernel.radius(),
            |photon| {
                // f̃(ω_p, −γ′) K₂.
                if let Some(scattered) = photon.reflected(self.scene, vertex) {
                    let weighed = kernel.between(photon.x, x);
                    self.count(photon, seen, scattered, weighed, found);
                }
            },
        );
    }

    /// Hands over what a photon brings, given the kernel there.
    fn count(
        &self,
        photon: &Photon,
        seen: &Seen,
        scattered: Spectrum,
        weighed: Option<(f64, f64)>,
        found: &mut impl FnMut(Gathered),
    ) {
        let depth = seen.depth + photon.depth;
        let (Some((kernel, bias)), false) = (
            weighed,
            self.mapping.max_depth.is_some_and(|limit| depth > limit),
        ) else {
            return;
        };
        let light = seen.throughput * scattered * photon.power;
        found(Gathered {
            value: light * kernel,
            bias: light * bias,
            path: PathFacts {
                optical_length: seen.optical_length + photon.optical_length,
                bounces: depth - 1,
                emitter: photon.emitter,
            },
        });
    }

    /// Hands over radiance that is emitted where the index is `n`.
    fn emission(
        &self,
        seen: &Seen,
        emitter: usize,
        radiance: Spectrum,
        n: f64,
        found: &mut impl FnMut(Gathered),
    ) {
        found(Gathered {
            value: seen.throughput * radiance / (n * n),
            bias: Spectrum::ZERO,
            path: PathFacts {
                optical_length: seen.optical_length,
                bounces: seen.depth - 1,
                emitter,
            },
        });
    }
}

/// A place that a sensor ray sees.
struct Seen {
    throughput: Spectrum,
    /// Edges and specular events up to there.
    depth: u32,
    optical_length: f64,
}
