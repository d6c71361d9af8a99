//! Light subpaths that all pixels share: one set for each sample of the whole image, for vertex connection and merging.
//!
//! Theory: docs/theory.md#vertex-merging.

use super::source::{LightSamples, PILOT, Source};
use crate::integrator::{
    Bdpt, Contribution, Integrator, LightMap, Merging, Vcm, VcmSample, even_channel_pdf,
};
use crate::path::Workspace;
use crate::photons::{Followed, Radii};

/// The light subpaths of a sample of the whole image.
#[derive(Debug)]
pub(super) struct SharedLight {
    pub vcm: Vcm,
    pub light: LightMap,
    pub radii: Radii,
}

impl SharedLight {
    /// Whether an estimator has any.
    pub(super) fn is_used(integrator: &Integrator) -> bool {
        matches!(integrator, Integrator::Vcm(_))
    }

    /// Those of a sample; `None` if the estimator has none.
    pub(super) fn trace(light: &LightSamples, sample: u64) -> Option<Followed<Self>> {
        let (source, Integrator::Vcm(vcm)) = (light.source, light.integrator) else {
            return None;
        };
        let Followed {
            found,
            stats,
            balance,
        } = light_map(source, &vcm, sample);
        let found = SharedLight {
            vcm,
            light: found,
            radii: Vcm::radii(source.prepared.radius, sample),
        };
        Some(Followed {
            found,
            stats,
            balance,
        })
    }

    /// As [`LightSamples::take`], with these light subpaths, of which the one with the pixel's number is connected.
    pub(super) fn take(
        &self,
        light: &LightSamples,
        pixel: usize,
        sample: u64,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let merging = Merging {
            light: &self.light,
            radii: self.radii,
        };
        let vcm = VcmSample {
            vcm: &self.vcm,
            scene: light.source.scene.at(sample),
            merging: &merging,
            number: pixel,
            channel_pdf: even_channel_pdf(light.source.channels()),
        };
        light.take_by(pixel, sample, ws, out, |ray, sampler, ws, out| {
            vcm.take(ray, sampler, ws, out);
        });
    }
}

fn light_map(source: &Source, vcm: &Vcm, sample: u64) -> Followed<LightMap> {
    let bounds = vcm.bounds(even_channel_pdf(source.channels()));
    let count = Vcm::paths(source.scene);
    source.with_light_paths(sample, bounds, count, LightMap::trace)
}

/// What vertex connection and merging does besides merging.
pub(super) fn connecting(vcm: &Vcm) -> Bdpt {
    Bdpt {
        max_depth: vcm.max_depth,
        rr_depth: vcm.rr_depth,
        heuristic: vcm.heuristic,
        connections: vcm.connections,
    }
}

/// Radius of the first sample.
pub(super) fn first_radius(source: &Source, vcm: &Vcm) -> f64 {
    let automatic = || {
        let pilot = light_map(source, vcm, PILOT).found;
        pilot.photons.first_radius(source.scene)
    };
    vcm.radius.unwrap_or_else(automatic)
}
