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
use crate::tagging::{Representative, TaggedRecorder, representatives};

/// Takes samples whose layers have [parts](LightParts).
pub(super) struct FollowedSamples<'a> {
    source: &'a Source<'a>,
    path: PathTracer,
    recorder: Recorder<'a>,
    decomposition: Decomposition,
    parts: FoundParts,
}

/// What is followed.
enum Recorder<'a> {
    Stokes(Box<StokesRecorder<'a>>),
    Tagged(Box<TaggedSamples>),
}

/// All parts of what a sample has found.
struct FoundParts {
    /// The first layer of each, which may come up several times.
    layers: Vec<usize>,
    /// Its parts, one after the other.
    values: Vec<Spectrum>,
    /// Number of parts of a layer.
    count: usize,
}

/// Tells apart the light of contributions by what sound does to its phase.
struct TaggedSamples {
    recorder: TaggedRecorder,
    sidebands: Sidebands,
    /// Layers of contributions, and those that stand for others, with the places of their layers.
    layers: Vec<usize>,
    chosen: Vec<(usize, Representative)>,
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
            LightParts::Sidebands(sidebands) => Recorder::Tagged(Box::new(TaggedSamples {
                recorder: TaggedRecorder::new(scene),
                sidebands,
                layers: Vec::new(),
                chosen: Vec::new(),
            })),
        };
        Some(FollowedSamples {
            source,
            path,
            recorder,
            decomposition: *decomposition,
            parts: FoundParts {
                layers: Vec::new(),
                values: Vec::new(),
                count: parts.count(),
            },
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
        let channels = self.source.channels();
        let sample = Sample {
            scene: self.source.scene.at(sample),
            ray,
            channels,
            sampler: &mut sampler,
            ws,
        };
        let shown = |c: &Contribution| {
            if self.source.shows(&c.path) {
                weight
            } else {
                0.0
            }
        };
        let parts = &mut self.parts;
        parts.layers.clear();
        parts.values.clear();
        match &mut self.recorder {
            Recorder::Stokes(recorder) => {
                let up = sample.scene.sensor().to_world().matrix3.y_axis;
                recorder.begin(sample.scene, &sample.ray, up);
                sample.trace(&self.path, &mut **recorder, out);
                for (c, [first, others @ ..]) in out.iter_mut().zip(recorder.found()) {
                    let (unpolarized, weight) = (c.weighted(), shown(c));
                    parts.layers.push(self.decomposition.layer(&c.path));
                    c.value *= *first;
                    c.value *= weight;
                    parts.values.push(c.weighted());
                    let others = others.map(|other| unpolarized * other * weight);
                    parts.values.extend(others);
                }
            }
            Recorder::Tagged(tagged) => {
                tagged.recorder.begin();
                sample.trace(&self.path, &mut tagged.recorder, out);
                for c in out.iter_mut() {
                    c.value *= shown(c);
                }
                tagged.tell_apart(out, &self.decomposition, channels, &mut sampler, parts);
            }
        }
    }

    /// All parts of layers of the last sample, which may come up several times.
    pub(super) fn parts(&self) -> impl Iterator<Item = (usize, &[Spectrum])> {
        let FoundParts {
            layers,
            values,
            count,
        } = &self.parts;
        layers.iter().copied().zip(values.chunks(*count))
    }
}

impl TaggedSamples {
    /// Finds the parts of each layer of light.
    fn tell_apart(
        &mut self,
        contributions: &[Contribution],
        decomposition: &Decomposition,
        channels: usize,
        sampler: &mut Sampler,
        parts: &mut FoundParts,
    ) {
        let (layers, chosen) = (&mut self.layers, &mut self.chosen);
        layers.clear();
        chosen.clear();
        layers.extend(contributions.iter().map(|c| decomposition.layer(&c.path)));
        let mut next = layers.iter().min();
        while let Some(layer) = next {
            next = layers.iter().filter(|other| *other > layer).min();
            let place = parts.layers.len();
            parts.layers.push(*layer);
            let light = |(i, c): (usize, &Contribution)| (i, c.weighted());
            let all = contributions.iter().enumerate();
            let lights = all.filter(|(i, _)| layers[*i] == *layer).map(light);
            let sum = |sum, (_, light)| sum + light;
            parts.values.push(lights.clone().fold(Spectrum::ZERO, sum));
            let end = parts.layers.len() * parts.count;
            parts.values.resize(end, Spectrum::ZERO);
            representatives(lights, channels, sampler.next_1d(), |representative| {
                chosen.push((place, representative));
            });
        }
        chosen.sort_by_key(|(_, r)| r.contribution);
        let same = || chosen.chunk_by(|a, b| a.1.contribution == b.1.contribution);
        let wanted = same().map(|same| same[0].1.contribution);
        for (same, modulation) in same().zip(self.recorder.modulations(wanted)) {
            let shares = self.sidebands.shares(modulation);
            for (place, r) in same {
                let values = &mut parts.values[place * parts.count..][..parts.count];
                for (value, share) in values[1..].iter_mut().zip(&shares) {
                    value[r.channel] += r.light * share;
                }
            }
        }
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
