//! Previews: paths find the light that is scattered once, photons the light that is scattered more
//! often. Light that arrives at a vertex is thus shared by all paths nearby, as in a radiance cache
//! (docs/theory.md#previews).

use super::path::PathRequest;
use super::photon::{Gathered, Gathering, PhotonQuery};
use super::{Contribution, PathTracer};
use crate::path::Workspace;
use crate::photons::PhotonsAround;
use crate::sampling::Sampler;
use crate::sensor::SensorRay;

impl Gathering<'_> {
    /// Passes the light along a sensor ray to `found`.
    pub(crate) fn along(
        &self,
        ray: SensorRay,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        mut found: impl FnMut(Gathered),
    ) {
        if self.mapping.query != PhotonQuery::Indirect {
            return self.by_photons(ray, sampler, ws, found);
        }
        let tracer = PathTracer {
            max_depth: self.mapping.max_depth,
            rr_depth: self.mapping.rr_depth,
        };
        let photons = PhotonsAround {
            map: self.map,
            radii: self.radii,
            smooths_directions: self.smooths_directions,
            is_within_medium: true,
        };
        let channels = self.channel_pdf.0.iter().filter(|p| **p > 0.0).count();
        let mut out: Vec<Contribution> = Vec::new();
        let request = PathRequest {
            scene: self.scene,
            ray,
            channels,
            photons: Some(photons),
        };
        tracer.sample_once(request, sampler, ws, &mut out);
        for light in out {
            found(Gathered {
                value: light.value * light.weight,
                bias: light.bias * light.weight,
                path: light.path,
            });
        }
    }
}
