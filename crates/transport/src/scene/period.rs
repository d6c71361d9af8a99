//! A scene at several instants of a period of sound.
//!
//! Light crosses a scene in much less time than a period of the sound, so that the index is
//! constant along each path. An exposure over many periods is the mean over a period.
//!
//! Theory: docs/theory.md#sound.

use super::Scene;
use super::check::{SceneProblem, Subject, error};
use super::parts::Parts;
use crate::sampling::Replicates;
use crate::stop::Stop;
use eikonal::field::Sound;
use std::f64::consts::TAU;

/// Relative difference of wavelengths or frequencies below which the periods are equal.
const PERIOD_TOLERANCE: f64 = 1e-9;

impl Scene {
    /// Builds the scene at `instants` ≥ 1 instants, evenly spaced over a period of the sound in its
    /// media: the phase ωt of instant i is 2πi/`instants`. All sound in the scene is assumed to
    /// have one period. A problem at some instant becomes a warning of the scene, once for each
    /// part of the scene and cause. The scene shares data with `alike` where possible, such as with
    /// the scene of another group of channels.
    ///
    /// # Errors
    /// The errors of [`Scene::new`], for any instant. With several instants, also: no sound, sound
    /// of several wavelengths in one medium, or sound of several frequencies in the scene. Once
    /// `stop` is raised, building ends with an error without problems.
    pub fn over_period(
        parts: Parts,
        instants: usize,
        alike: Option<&Scene>,
        stop: &Stop,
    ) -> Result<Self, Vec<SceneProblem>> {
        if instants > 1 {
            let problems = no_period(&parts);
            if !problems.is_empty() {
                return Err(problems);
            }
        }
        if instants <= 1 {
            return Scene::unless_stopped(parts, alike, stop);
        }
        let mut scene = Scene::unless_stopped(parts.clone(), alike, stop)?;
        let later = (1..instants).map(|i| {
            let mut parts = parts.clone();
            let phase = TAU * i as f64 / instants as f64;
            for medium in &mut parts.media {
                medium.index = medium.index.at_phase(phase);
            }
            Scene::unless_stopped(parts, Some(&scene), stop)
        });
        scene.later = later.collect::<Result<Vec<_>, _>>()?;
        scene.warnings = scene.at_all_instants(|scene| scene.warnings.clone());
        Ok(scene)
    }

    /// Returns the number of instants.
    pub fn instants(&self) -> usize {
        1 + self.later.len()
    }

    /// Returns the scene for sample (or particle) number `sample`; instants take turns.
    pub fn at(&self, sample: u64) -> &Scene {
        // Planted error "half of the instants of a period left out", found by morgana-transport/transport::period::averaged_fluence_is_the_mean_of_the_instants:
        // match (sample % self.instants() as u64 / 2) as usize {
        match (sample % self.instants() as u64) as usize {
            0 => self,
            i => &self.later[i - 1],
        }
    }

    /// Returns the problems that `problems` finds at all instants, once for each part of the scene
    /// and cause. If problems differ only by numbers in their messages, the first one is kept.
    pub fn at_all_instants(
        &self,
        problems: impl Fn(&Scene) -> Vec<SceneProblem>,
    ) -> Vec<SceneProblem> {
        let mut found = problems(self);
        for later in &self.later {
            for problem in problems(later) {
                if !found.iter().any(|earlier| earlier.has_cause_of(&problem)) {
                    found.push(problem);
                }
            }
        }
        found
    }

    /// Returns the smallest number of samples, at least `samples`, with equal numbers at each
    /// instant, in whole replicates.
    pub fn whole_periods(&self, samples: u64, replicates: Replicates) -> u64 {
        let instants = self.instants() as u64;
        // The least common multiple is among these multiples, because both numbers divide their
        // product.
        let multiples = (1..=replicates.size()).map(|i| i * instants);
        let unit = multiples.filter(|n| n.is_multiple_of(replicates.size()));
        let unit = unit.min().unwrap_or(instants);
        samples.div_ceil(unit).saturating_mul(unit)
    }
}

/// Returns the reasons why the scene has no period to average over.
fn no_period(parts: &Parts) -> Vec<SceneProblem> {
    let sounds: Vec<Vec<Sound>> = parts.media.iter().map(|m| m.index.sounds()).collect();
    if sounds.iter().all(Vec::is_empty) {
        let message = "the sampler has 'phases', but no medium has sound in it";
        return vec![error(
            Subject::Sensor,
            message.into(),
            "leave 'phases' out, or give a medium an index with sound in it",
        )];
    }
    let uneven = (0..sounds.len()).filter_map(|id| several_wavelengths(parts, id));
    let uneven: Vec<_> = uneven.collect();
    if uneven.is_empty() {
        several_frequencies(parts, &sounds).into_iter().collect()
    } else {
        uneven
    }
}

/// Checks for sounds of different wavelengths in one medium, which have different periods.
fn several_wavelengths(parts: &Parts, id: usize) -> Option<SceneProblem> {
    let medium = &parts.media[id];
    let [shortest, longest] = medium.index.sound_wavelengths()?;
    (longest > shortest * (1.0 + PERIOD_TOLERANCE)).then(|| {
        let message = format!(
            "the sound in medium '{}' has several wavelengths, {shortest} to {longest}, and no common \
             period to average over",
            medium.name
        );
        error(
            Subject::Medium(id),
            message,
            "give all modes the same wave number, or leave the sampler's 'phases' out",
        )
    })
}

/// Checks for sounds of different frequencies, as far as the frequencies are known.
fn several_frequencies(parts: &Parts, sounds: &[Vec<Sound>]) -> Option<SceneProblem> {
    let known = sounds.iter().enumerate().flat_map(|(id, sounds)| {
        let frequencies = sounds.iter().filter_map(|sound| sound.frequency);
        frequencies.map(move |hz| (id, hz))
    });
    let mut known = known.collect::<Vec<_>>().into_iter();
    let (first, reference) = known.next()?;
    let (id, hz) = known.find(|(_, hz)| (hz - reference).abs() > PERIOD_TOLERANCE * reference)?;
    let message = format!(
        "the sound in medium '{}' has {reference} Hz, that in medium '{}' has {hz} Hz: there is no common \
         period to average over",
        parts.media[first].name, parts.media[id].name
    );
    Some(error(
        Subject::Medium(id),
        message,
        "give all sounds the same frequency, or leave the sampler's 'phases' out",
    ))
}
