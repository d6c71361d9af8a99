//! Light subpaths that all pixels share, one set for each sample of the whole image, for vertex
//! connection and merging.
//!
//! Theory: docs/theory.md#vertex-merging.

use super::source::{ImageSample, LightSamples, PILOT_SAMPLE, Source};
use crate::film::Decomposition;
use crate::integrator::{
    Bdpt, Contribution, Integrator, LightMap, Merging, Vcm, VcmSample, even_channel_pdf,
};
use crate::path::Workspace;
use crate::photons::{Followed, LightPaths};

/// Follows the light subpaths of a sample of the whole image. Returns `None` if the estimator's
/// pixels share none.
pub(super) fn trace(
    light: &LightSamples,
    sample: u64,
    decomposition: Decomposition,
) -> Option<Followed<Merging>> {
    let (source, Integrator::Vcm(vcm)) = (light.source, light.integrator) else {
        return None;
    };
    let Followed {
        found,
        stats,
        balance,
    } = with_paths(source, &vcm, sample, LightMap::trace);
    Some(Followed {
        found: Merging {
            light: found,
            radii: Vcm::radii(source.prepared.radius, sample),
            decomposition,
        },
        stats,
        balance,
    })
}

/// Adds the contributions of one sample of a cell to `out`, like [`LightSamples::take`]. If there
/// are shared light subpaths, it connects the one with the cell's number.
pub(super) fn take(
    light: &LightSamples,
    merging: Option<&Merging>,
    cell: usize,
    sample: &ImageSample,
    ws: &mut Workspace,
    out: &mut Vec<Contribution>,
) {
    let (Integrator::Vcm(vcm), Some(merging)) = (&light.integrator, merging) else {
        return light.take(cell, sample, ws, out);
    };
    let vcm = VcmSample {
        vcm,
        scene: light.source.scene.at(sample.number),
        merging,
        number: cell,
        channel_pdf: even_channel_pdf(light.source.channels()),
    };
    light.take_by(cell, sample, ws, out, |ray, sampler, ws, out| {
        vcm.take(ray, sampler, ws, out);
    });
}

fn with_paths<T>(
    source: &Source,
    vcm: &Vcm,
    sample: u64,
    follow: impl FnOnce(&LightPaths) -> T,
) -> T {
    let bounds = vcm.bounds(even_channel_pdf(source.channels()));
    source.with_light_paths(sample, bounds, source.cells.count(), follow)
}

/// Returns bidirectional path tracing with the settings of vertex connection and merging, without
/// merging.
pub(super) fn connecting(vcm: &Vcm) -> Bdpt {
    Bdpt {
        max_depth: vcm.max_depth,
        rr_depth: vcm.rr_depth,
        heuristic: vcm.heuristic,
        connections: vcm.connections,
    }
}

/// Determines the radius of the first sample.
pub(super) fn first_radius(source: &Source, vcm: &Vcm) -> f64 {
    with_paths(source, vcm, PILOT_SAMPLE, |paths| vcm.first_radius(paths))
}
