//! Samples of pixels by a path tracer that follows more than light along its paths: their Stokes vectors, or what sound does to their phases.
//!
//! Theory: docs/theory.md#stokes-vectors, docs/theory.md#tagged-light.

use super::source::{LightSamples, SampledRay, Source};
use crate::Spectrum;
use crate::derivative::FactorRecorder;
use crate::film::{Decomposition, LightParts};
use crate::integrator::{Contribution, Integrator, PathFinds, PathTracer};
use crate::path::Workspace;
use crate::polarization::StokesRecorder;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;
use crate::sidebands::Sidebands;
use crate::tagging::TaggedRecorder;

/// Takes samples whose layers have [parts](LightParts).
pub(super) struct FollowedSamples<'a> {
    source: &'a Source<'a>,
    path: PathTracer,
    recorder: Recorder<'a>,
    /// All parts but for the first of all contributions of a sample.
    found: Vec<Spectrum>,
    /// Number of them in each contribution.
    others: usize,
}

/// What is followed.
enum Recorder<'a> {
    Stokes(Box<StokesRecorder<'a>>),
    Tagged(Box<TaggedRecorder>, Sidebands),
}

/// A sample of a pixel that is about to be taken.
struct Sample<'s, 'a> {
    scene: &'a Scene,
    ray: SensorRay,
    channels: usize,
    sampler: &'s mut Sampler,
    ws: &'s mut Workspace,
}

impl<'a> FollowedSamples<'a> {
    /// `None` if the film asks for no parts, or the integrator follows nothing but light.
    pub(super) fn of(light: &LightSamples<'a>, decomposition: &Decomposition) -> Option<Self> {
        let source = light.source;
        let (scene, parts) = (source.scene, decomposition.parts?);
        let Integrator::Path(path) = light.integrator else {
            return None;
        };
        let recorder = match parts {
            LightParts::Stokes => {
                Recorder::Stokes(Box::new(StokesRecorder::new(scene, source.channels())))
            }
            LightParts::Sidebands(sidebands) => {
                Recorder::Tagged(Box::new(TaggedRecorder::new(scene)), sidebands)
            }
        };
        Some(FollowedSamples {
            source,
            path,
            recorder,
            found: Vec::new(),
            others: parts.count() - 1,
        })
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
        // Both ways of an edge that is split have factors of their own: one is followed at a time.
        ws.first_vertex.splitting = false;
        let sample = Sample {
            scene: self.source.scene.at(sample),
            ray,
            channels: self.source.channels(),
            sampler: &mut sampler,
            ws,
        };
        self.found.clear();
        match &mut self.recorder {
            Recorder::Stokes(recorder) => {
                let up = sample.scene.sensor().to_world().matrix3.y_axis;
                recorder.begin(sample.scene, &sample.ray, up);
                sample.trace(&self.path, &mut **recorder, out);
                for (c, [first, others @ ..]) in out.iter_mut().zip(recorder.found()) {
                    let unpolarized = c.weighted();
                    self.found.extend(others.map(|other| unpolarized * other));
                    c.value *= *first;
                }
            }
            Recorder::Tagged(recorder, sidebands) => {
                recorder.begin();
                sample.trace(&self.path, &mut **recorder, out);
                for (c, modulation) in out.iter().zip(recorder.found()) {
                    let shares = sidebands.shares(*modulation).into_iter();
                    self.found.extend(shares.map(|share| c.weighted() * share));
                }
            }
        }
        for (c, others) in out.iter_mut().zip(self.found.chunks_mut(self.others)) {
            let weight = if self.source.shows(&c.path) {
                weight
            } else {
                0.0
            };
            c.value *= weight;
            for other in others {
                *other *= weight;
            }
        }
    }

    /// All parts but for the first of a contribution of the last sample.
    pub(super) fn others(&self, contribution: usize) -> &[Spectrum] {
        &self.found[contribution * self.others..][..self.others]
    }
}

impl Sample<'_, '_> {
    fn trace(
        self,
        path: &PathTracer,
        recorder: &mut impl FactorRecorder,
        out: &mut Vec<Contribution>,
    ) {
        let finds = PathFinds { out, recorder };
        path.sample(
            self.scene,
            self.ray,
            self.channels,
            self.sampler,
            self.ws,
            finds,
        );
    }
}
