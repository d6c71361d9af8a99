//! Paths that end after they have been scattered once. Photons bring the light that is scattered more
//! often (docs/theory.md#previews).

use super::{PathFinds, PathRequest, PathTracer, SampledEdge, Tracing};
use crate::film::PathFacts;
use crate::integrator::Contribution;
use crate::path::{PathLog, Vertex, Workspace};
use crate::sampling::Sampler;

impl PathTracer {
    /// Samples contributions to the radiance along a sensor ray: light that is scattered at most
    /// once, by a path, and the other light by photons around the first vertex that scatters.
    /// Photons must be [indirect](crate::photons::is_indirect).
    pub(crate) fn sample_once(
        &self,
        request: PathRequest,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let finds = PathFinds { out, log: &mut () };
        self.sample_requested(request, sampler, ws, finds);
    }
}

impl<L: PathLog> Tracing<'_, L> {
    /// Returns true if a ray may find light that a path scatters once: light of emitters with an
    /// extent, or of volumes.
    pub(super) fn finds_emitters(&self) -> bool {
        self.scene.emitters_can_be_met() || self.scene.volume_lights().next().is_some()
    }

    /// Adds the light of photons around the vertex at the end of an edge, if the scene has photons.
    /// Photons have at most `budget` edges and events.
    pub(super) fn indirect(&mut self, vertex: &Vertex, edge: &SampledEdge, budget: u32) {
        let Some(photons) = self.photons else {
            return;
        };
        let throughput = edge.next.throughput * edge.edge.arrival(edge.channel_pdf);
        let length = edge.length;
        photons.each(self.scene, vertex, |photon, light| {
            if photon.depth > budget {
                return;
            }
            let [value, bias] = light.of(throughput, photon.power);
            self.out.push(Contribution {
                image: None,
                strategy: (0, 0),
                value,
                bias,
                weight: 1.0,
                shares: Default::default(),
                path: PathFacts {
                    optical_length: length.optical_length + photon.optical_length,
                    bounces: length.depth + photon.depth - 1,
                    emitter: photon.emitter,
                },
            });
        });
    }
}
