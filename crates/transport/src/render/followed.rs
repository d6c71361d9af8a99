//! Samples of estimators that follow Stokes vectors, or phase shifts from sound, along their paths.
//!
//! Theory: docs/theory.md#stokes-vectors, docs/theory.md#tagged-light.

use super::source::{ImageSample, LightSamples, SampledRay, Source};
use crate::Spectrum;
use crate::film::{Decomposition, LightParts};
use crate::integrator::{Contribution, Integrator, PathFinds};
use crate::observe::fold::Folded;
use crate::path::{PathLog, Workspace};
use crate::polarization::StokesFold;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;
use crate::sidebands::Sidebands;
use crate::tagging::{Representative, TaggedFold, representatives};

/// Takes samples for films whose layers have [parts](LightParts).
pub(super) struct FollowedSamples<'a> {
    source: &'a Source<'a>,
    integrator: Integrator,
    followed: Followed<'a>,
    decomposition: Decomposition,
    parts: FoundParts,
}

/// Quantity that is followed.
enum Followed<'a> {
    Stokes(Box<Folded<StokesFold<'a>>>),
    Tagged(Box<TaggedSamples>),
}

/// Parts of the light of one sample.
struct FoundParts {
    /// Layers of the light; a layer may occur several times.
    layers: Vec<FoundLayer>,
    /// Parts of the layers, one layer after the other.
    values: Vec<Spectrum>,
    /// Number of parts of a layer.
    count: usize,
}

/// Layer of a contribution of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FoundLayer {
    /// Number of the layer's first part.
    layer: usize,
    /// Position on the image: see [`Contribution::image`].
    image: Option<[f64; 2]>,
}

/// Part of the light of a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoundPart {
    /// Number of the part among all layers of the film.
    pub layer: usize,
    /// Position on the image: see [`Contribution::image`].
    pub image: Option<[f64; 2]>,
    pub value: Spectrum,
}

/// Separates the light of contributions by the phase shift from the sound.
struct TaggedSamples {
    folded: Folded<TaggedFold>,
    sidebands: Sidebands,
    /// Layers of contributions. `chosen` holds the contributions that represent others, with the
    /// places of their layers.
    layers: Vec<FoundLayer>,
    chosen: Vec<(usize, Representative)>,
}

/// Data of the sample that is taken.
struct Sample<'s, 'a> {
    scene: &'a Scene,
    ray: SensorRay,
    channels: usize,
    sampler: &'s mut Sampler,
    ws: &'s mut Workspace,
}

impl<'a> FollowedSamples<'a> {
    /// Returns `None` if the film keeps no parts, or if the integrator's light is unpolarised and
    /// untagged.
    pub(super) fn of(light: &LightSamples<'a>, decomposition: &Decomposition) -> Option<Self> {
        let source = light.source;
        let (scene, parts) = (source.scene, decomposition.parts?);
        if light.integrator.blurs() {
            return None;
        }
        let followed = match parts {
            LightParts::Stokes => {
                let fold = StokesFold::new(scene, source.channels());
                Followed::Stokes(Box::new(Folded::new(fold)))
            }
            LightParts::Sidebands(sidebands) => Followed::Tagged(Box::new(TaggedSamples {
                folded: Folded::new(TaggedFold::new(scene)),
                sidebands,
                layers: Vec::new(),
                chosen: Vec::new(),
            })),
        };
        Some(FollowedSamples {
            source,
            integrator: light.integrator,
            followed,
            decomposition: *decomposition,
            parts: FoundParts {
                layers: Vec::new(),
                values: Vec::new(),
                count: parts.count(),
            },
        })
    }

    /// Adds the contributions of one sample of a cell to `out`, which must be empty, like
    /// [`LightSamples::take`].
    pub(super) fn take(
        &mut self,
        cell: usize,
        sample: &ImageSample,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let SampledRay {
            ray,
            offset,
            weight,
            mut sampler,
        } = self.source.ray(cell, sample);
        ws.stats.paths += 1;
        // Turn off splitting: the two branches of a split edge have different factors, and only one
        // branch is followed at a time.
        ws.first_vertex.splitting = false;
        let channels = self.source.channels();
        let sample = Sample {
            scene: self.source.scene.at(sample.number),
            ray,
            channels,
            sampler: &mut sampler,
            ws,
        };
        let shown = |c: &Contribution| match c.image {
            _ if !self.source.shows(&c.path) => 0.0,
            Some(_) => 1.0,
            None => weight,
        };
        let layer_of = |c: &Contribution| FoundLayer {
            layer: self.decomposition.layer(&c.path),
            image: c.image,
        };
        let parts = &mut self.parts;
        parts.layers.clear();
        parts.values.clear();
        match &mut self.followed {
            Followed::Stokes(folded) => {
                folded.fold.begin(sample.scene, &sample.ray);
                folded.begin();
                sample.take(&self.integrator, &mut **folded, out);
                move_by(offset, out);
                for (c, [first, others @ ..]) in out.iter_mut().zip(folded.fold.found()) {
                    let (unpolarized, weight) = (c.weighted(), shown(c));
                    parts.layers.push(layer_of(c));
                    c.value *= *first;
                    c.value *= weight;
                    parts.values.push(c.weighted());
                    let others = others.map(|other| unpolarized * other * weight);
                    parts.values.extend(others);
                }
            }
            Followed::Tagged(tagged) => {
                tagged.folded.fold.begin();
                tagged.folded.begin();
                sample.take(&self.integrator, &mut tagged.folded, out);
                move_by(offset, out);
                for c in out.iter_mut() {
                    c.value *= shown(c);
                }
                tagged.layers.clear();
                tagged.layers.extend(out.iter().map(layer_of));
                tagged.separate_parts(out, channels, &mut sampler, parts);
            }
        }
    }

    /// Returns the parts of the layers of the last sample. A layer may occur several times.
    pub(super) fn parts(&self) -> impl Iterator<Item = FoundPart> {
        let FoundParts {
            layers,
            values,
            count,
        } = &self.parts;
        let each = layers.iter().zip(values.chunks(*count));
        each.flat_map(|(found, values)| {
            values.iter().enumerate().map(|(k, value)| FoundPart {
                layer: found.layer + k,
                image: found.image,
                value: *value,
            })
        })
    }
}

/// Shifts the image positions of contributions to other pixels.
fn move_by(offset: [f64; 2], out: &mut [Contribution]) {
    let splats = out.iter_mut().filter_map(|c| c.image.as_mut());
    splats.for_each(|[s, t]| {
        *s += offset[0];
        *t += offset[1];
    });
}

impl FoundParts {
    /// Adds a layer without light. Returns the place of its first part.
    fn push(&mut self, layer: FoundLayer) -> usize {
        self.layers.push(layer);
        let place = self.values.len();
        self.values.resize(place + self.count, Spectrum::ZERO);
        place
    }
}

impl TaggedSamples {
    /// Computes the parts of each layer of light.
    fn separate_parts(
        &mut self,
        contributions: &[Contribution],
        channels: usize,
        sampler: &mut Sampler,
        parts: &mut FoundParts,
    ) {
        let (layers, chosen) = (&self.layers, &mut self.chosen);
        chosen.clear();
        let own = layers.iter().filter(|found| found.image.is_none());
        let own = own.map(|found| found.layer);
        let mut next = own.clone().min();
        while let Some(layer) = next {
            next = own.clone().filter(|other| *other > layer).min();
            let wanted = FoundLayer { layer, image: None };
            let place = parts.push(wanted);
            let light = |(i, c): (usize, &Contribution)| (i, c.weighted());
            let all = contributions.iter().enumerate();
            let lights = all.filter(|(i, _)| layers[*i] == wanted).map(light);
            let sum = |sum, (_, light)| sum + light;
            parts.values[place] = lights.clone().fold(Spectrum::ZERO, sum);
            representatives(lights, channels, sampler.next_1d(), |representative| {
                chosen.push((place, representative));
            });
        }
        // Contributions to other pixels represent themselves.
        for (contribution, found) in layers.iter().enumerate() {
            let light = contributions[contribution].weighted();
            if found.image.is_some() && !light.is_zero() {
                let place = parts.push(*found);
                parts.values[place] = light;
                chosen.extend((0..channels).map(|channel| {
                    let light = light[channel];
                    (
                        place,
                        Representative {
                            contribution,
                            channel,
                            light,
                        },
                    )
                }));
            }
        }
        chosen.sort_by_key(|(_, r)| r.contribution);
        let same = || chosen.chunk_by(|a, b| a.1.contribution == b.1.contribution);
        let wanted = same().map(|same| same[0].1.contribution);
        for (same, modulation) in same().zip(self.folded.fold.modulations(wanted)) {
            let shares = self.sidebands.shares(modulation);
            for (place, r) in same {
                let values = &mut parts.values[*place..][..parts.count];
                for (value, share) in values[1..].iter_mut().zip(&shares) {
                    value[r.channel] += r.light * share;
                }
            }
        }
    }
}

impl Sample<'_, '_> {
    fn take(self, integrator: &Integrator, log: &mut impl PathLog, out: &mut Vec<Contribution>) {
        let finds = PathFinds { out, log };
        let (sampler, ws) = (self.sampler, self.ws);
        integrator.log(self.scene, self.ray, self.channels, sampler, ws, finds);
    }
}
