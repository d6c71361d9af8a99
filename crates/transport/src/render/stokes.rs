//! Samples of pixels as Stokes vectors.
//!
//! Theory: docs/theory.md#stokes-vectors.

use super::source::{LightSamples, SampledRay, Source};
use crate::Spectrum;
use crate::film::Decomposition;
use crate::integrator::{Contribution, Integrator, PathFinds, PathTracer};
use crate::path::Workspace;
use crate::polarization::StokesRecorder;

/// Takes samples of polarised light.
pub(super) struct PolarizedSamples<'a> {
    source: &'a Source<'a>,
    path: PathTracer,
    recorder: StokesRecorder<'a>,
    /// Stokes parameters but for the first of all contributions of a sample.
    found: Vec<[Spectrum; 3]>,
}

impl<'a> PolarizedSamples<'a> {
    /// `None` if the film does not ask for them, or the integrator does not follow polarisation.
    pub(super) fn of(light: &LightSamples<'a>, decomposition: &Decomposition) -> Option<Self> {
        let source = light.source;
        match light.integrator {
            Integrator::Path(path) if decomposition.stokes => Some(PolarizedSamples {
                source,
                path,
                recorder: StokesRecorder::new(source.scene, source.channels()),
                found: Vec::new(),
            }),
            _ => None,
        }
    }

    /// Adds the contributions of one sample of a pixel to `out`, which is empty, as [`LightSamples::take`] does.
    pub(super) fn take(
        &mut self,
        [pixel, sample]: [u64; 2],
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let SampledRay {
            ray,
            weight,
            mut sampler,
            ..
        } = self.source.ray(pixel as usize, sample);
        ws.stats.paths += 1;
        // Both ways of an edge that is split have matrices of their own: one is followed at a time.
        ws.first_vertex.splitting = false;
        let scene = self.source.scene.at(sample);
        let up = scene.sensor().to_world().matrix3.y_axis;
        self.recorder.begin(scene, &ray, up);
        let finds = PathFinds {
            out,
            recorder: &mut self.recorder,
        };
        let channels = self.source.channels();
        self.path
            .sample(scene, ray, channels, &mut sampler, ws, finds);
        self.found.clear();
        for (c, [first, others @ ..]) in out.iter_mut().zip(self.recorder.found()) {
            let weight = if self.source.shows(&c.path) {
                weight
            } else {
                0.0
            };
            let unpolarized = c.weighted() * weight;
            self.found.push(others.map(|other| unpolarized * other));
            c.value = c.value * *first * weight;
        }
    }

    /// The second to fourth Stokes parameter of a contribution of the last sample.
    pub(super) fn parameters(&self, contribution: usize) -> [Spectrum; 3] {
        self.found[contribution]
    }
}
