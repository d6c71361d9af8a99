//! Choice of the emitters to which connections lead, and from which light subpaths start.

use super::group::{EmitterChoice, Group, UNIFORM_FRACTION};
use super::light_bounds::{LightBounds, Receiver};
use super::parts::Parts;
use crate::emitter::{Class, Emitter, Surroundings};
use crate::sampling::Discrete;

/// Distributions for the choice of emitters.
#[derive(Clone, Debug)]
pub(super) struct Lights {
    /// Groups of emitters, in the order of [`Class::ALL`].
    groups: [Group; Class::ALL.len()],
    /// True if some emitter of the class is an image, in the order of [`Class::ALL`].
    images: [bool; Class::ALL.len()],
    /// Position of each emitter in its group.
    places: Vec<usize>,
    /// Distribution of the emitters from which light subpaths start.
    sources: Option<Discrete>,
}

impl Lights {
    pub(super) fn new(parts: &Parts, around: &Surroundings) -> Self {
        let emitters = parts.emitters.iter().enumerate();
        let group = |class: Class| {
            let own = emitters.clone().filter(|(_, e)| e.class() == class);
            let bounded = |(i, e)| (i, LightBounds::new(e, around, &parts.objects));
            Group::new(own.map(bounded).collect())
        };
        let groups = Class::ALL.map(group);
        let mut places = vec![0; parts.emitters.len()];
        for group in &groups {
            for (place, member) in group.members.iter().enumerate() {
                places[member.emitter] = place;
            }
        }
        let has_image = |class: Class| {
            emitters
                .clone()
                .any(|(_, e)| e.class() == class && e.is_image())
        };
        Lights {
            groups,
            images: Class::ALL.map(has_image),
            places,
            sources: sources(parts, around),
        }
    }

    /// Returns the classes that have emitters.
    pub(crate) fn classes(&self) -> impl Iterator<Item = Class> + '_ {
        let present = |class: &Class| !self.groups[*class as usize].members.is_empty();
        Class::ALL.into_iter().filter(present)
    }

    /// Returns true if some emitter of a class is an image.
    pub(super) fn has_image(&self, class: Class) -> bool {
        self.images[class as usize]
    }

    /// Returns the choice among the emitters of a class that has some, for a receiver.
    pub(super) fn choice<'a>(
        &'a self,
        class: Class,
        emitters: &'a [Emitter],
        receiver: &'a Receiver,
    ) -> EmitterChoice<'a> {
        EmitterChoice::new(&self.groups[class as usize], emitters, receiver)
    }

    /// Returns the probability with which [`Lights::choice`] chooses an emitter within its class.
    pub(super) fn probability(
        &self,
        emitter: usize,
        emitters: &[Emitter],
        receiver: &Receiver,
    ) -> f64 {
        let choice = self.choice(emitters[emitter].class(), emitters, receiver);
        choice.probability(self.places[emitter])
    }

    /// Returns the distribution of the emitters from which light subpaths start.
    pub(super) fn sources(&self) -> Option<&Discrete> {
        self.sources.as_ref()
    }
}

/// Weights emitters by their powers, with a uniform fraction, because only a part of the scene may
/// matter.
fn sources(parts: &Parts, around: &Surroundings) -> Option<Discrete> {
    let shape = |object: usize| &parts.objects[object].shape;
    let emitters = parts.emitters.iter();
    let powers: Vec<f64> = emitters.map(|e| e.power(around, shape).sum()).collect();
    let mean = powers.iter().sum::<f64>() / powers.len() as f64;
    let floor = if mean > 0.0 {
        UNIFORM_FRACTION * mean
    } else {
        1.0
    };
    let weights: Vec<f64> = powers
        .iter()
        .map(|p| (1.0 - UNIFORM_FRACTION) * p + floor)
        .collect();
    Discrete::new(&weights).ok()
}
