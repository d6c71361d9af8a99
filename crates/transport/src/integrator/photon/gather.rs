//! Gathering of photons along a sensor ray. In media, photons around the ray or around a sampled
//! point of the ray count. On surfaces, photons on the first surface that is not specular count.
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
use crate::photons::{Kernel, Photon, PhotonMap, PhotonsAround, Radii, ScatteredLight, pieces};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// Light found along a sensor ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gathered {
    /// Value of the light.
    pub value: Spectrum,
    /// Bias of the value, to second order in the radius.
    pub bias: Spectrum,
    /// Properties of the path.
    pub path: PathFacts,
}

/// State of a sensor ray.
struct Sight {
    start: Start,
    /// Throughput in basic radiance, including n² of the sensor.
    throughput: Spectrum,
    /// Number of edges and specular events.
    depth: u32,
    optical_length: f64,
}

/// Inputs of gathering.
pub(crate) struct Gathering<'a> {
    /// Scene that is viewed.
    pub scene: &'a Scene,
    /// Parameters of photon mapping.
    pub mapping: &'a PhotonMapping,
    /// Photons of the sample.
    pub map: &'a PhotonMap,
    /// Radii around a ray, or a point, within which photons contribute.
    pub radii: Radii,
    /// True if the light in media is smoothed over directions: see [`PhotonsAround`].
    pub smooths_directions: bool,
    /// Probabilities of the channels; zero for channels that are not in use.
    pub channel_pdf: Spectrum,
}

impl Gathering<'_> {
    /// Passes the light along a sensor ray to `found`: photons around the ray, or around a point.
    pub(in crate::integrator) fn by_photons(
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
        let is_beam = self.mapping.query == PhotonQuery::Beam;
        while let Some(sight) = next {
            // Trace γ to its next vertex: through media for beams, to a collision for points.
            let sampling = Sampling {
                mode: TransportMode::Radiance,
                channel_pdf: self.channel_pdf,
                extend: false,
                collides: !is_beam,
                spans: is_beam,
                parts: false,
                forced: false,
                differentials: false,
                splitting: false,
            };
            let mut edge = trace(scene, sight.start, sampling, sampler, ws);
            edge.tabulate();
            // Sum over the photons in media.
            if is_beam {
                self.beside(&sight, &edge, ws, &mut found);
            } else if let End::Collision(point) = &edge.end {
                self.around(&sight, &edge, point, &mut found);
            }
            // Sum over the photons on the surface, and continue if it is smooth.
            next = self.arrive(sight, &edge, sampler, &mut found);
        }
    }

    /// Sums over the photons beside an edge. Each photon counts at the point of the edge closest to
    /// it.
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
                    // Compute the foot γ(s_p) of the perpendicular from x_p.
                    let Some((theta, squared)) = piece.foot(photon.x) else {
                        return;
                    };
                    let point = span.at(theta);
                    // Compute T e^{−τ(s_p)} F̄.
                    let seen = Seen {
                        throughput: sight.throughput * point.weight * point.depth.exp_neg(),
                        depth: sight.depth + 1 + span.events_before,
                        optical_length: optical_length + span.arc.optical_length(theta),
                    };
                    // Compute p(ω_p, −γ′) K₂.
                    let scattered = photon.phase(self.scene, point.direction);
                    if let Some((kernel, bias)) = kernel.weigh(squared) {
                        let light = ScatteredLight {
                            scattered,
                            sharp: None,
                            kernel,
                            bias,
                        };
                        self.count(photon, &seen, light, found);
                    }
                };
                self.map
                    .volume
                    .visit(|bounds| piece.touches(bounds), photon);
            }
            optical_length += span.arc.optical_length(span.theta_end);
        }
    }

    /// Sums over the photons around a collision.
    fn around(&self, sight: &Sight, edge: &Edge, point: &Point, found: &mut impl FnMut(Gathered)) {
        let seen = Seen {
            throughput: sight.throughput * edge.arrival(self.channel_pdf),
            depth: sight.depth + 1 + edge.geometry.events,
            optical_length: sight.optical_length + edge.optical_length,
        };
        self.at_vertex(&seen, &Vertex::volume(point), found);
    }

    /// Adds the light emitted at the end of an edge, and the light on the surface there. The ray
    /// continues only along a specular lobe.
    fn arrive(
        &self,
        sight: Sight,
        edge: &Edge,
        sampler: &mut Sampler,
        found: &mut impl FnMut(Gathered),
    ) -> Option<Sight> {
        // Compute T e^{−τ} F̄/P; P = 1 for beams.
        let chance = if self.mapping.query == PhotonQuery::Beam {
            1.0
        } else {
            edge.geometry.survival(self.channel_pdf)
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
        // Add the light that environments or the surface emit.
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
        // Add the light that falls on the surface, from its photons.
        self.at_vertex(&seen, &vertex, found);
        // Continue only along a specular lobe.
        let scatter = vertex.scatter(self.scene, TransportMode::Radiance, sampler)?;
        scatter.delta.then(|| Sight {
            start: scatter.start,
            throughput: seen.throughput * scatter.weight,
            depth: seen.depth,
            optical_length: seen.optical_length,
        })
    }

    /// Sums over the photons around a vertex.
    fn at_vertex(&self, seen: &Seen, vertex: &Vertex, found: &mut impl FnMut(Gathered)) {
        let photons = PhotonsAround {
            map: self.map,
            radii: self.radii,
            smooths_directions: false,
            is_within_medium: false,
        };
        photons.each(self.scene, vertex, |photon, light| {
            self.count(photon, seen, light, found);
        });
    }

    /// Passes the contribution of a photon to `found`, given its scattered light.
    fn count(
        &self,
        photon: &Photon,
        seen: &Seen,
        light: ScatteredLight,
        found: &mut impl FnMut(Gathered),
    ) {
        let depth = seen.depth + photon.depth;
        if self.mapping.max_depth.is_some_and(|limit| depth > limit) {
            return;
        }
        let [value, bias] = light.of(seen.throughput, photon.power);
        found(Gathered {
            value,
            bias,
            path: PathFacts {
                optical_length: seen.optical_length + photon.optical_length,
                bounces: depth - 1,
                emitter: photon.emitter,
            },
        });
    }

    /// Passes radiance that is emitted where the index is `n` to `found`.
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

/// A point on a sensor ray.
struct Seen {
    throughput: Spectrum,
    /// Number of edges and specular events up to the point.
    depth: u32,
    optical_length: f64,
}
