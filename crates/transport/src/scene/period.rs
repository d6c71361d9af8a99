//! A scene at several instants of a period of sound.
//!
//! Light crosses a scene in far less time than sound takes for a period, so that each path sees an index
//! that stands still; an exposure of many periods sees the mean over all of them.
//!
//! Theory: docs/theory.md#sound.

use super::Scene;
use super::check::{ProblemSeverity, SceneProblem, Subject};
use super::parts::Parts;
use std::f64::consts::TAU;

/// Wavelengths that differ by less, relatively, have the same period.
const SAME: f64 = 1e-9;

impl Scene {
    /// The scene at `instants` ≥ 1 instants, evenly spaced over a period of the sound in its media: the phase
    /// ωt of instant i is 2πi/`instants`. Every sound in the scene is taken to have the same period.
    ///
    /// # Errors
    /// As [`Scene::new`], for any instant; if there is no sound, or sound of several wavelengths in one
    /// medium.
    pub fn over_period(parts: Parts, instants: usize) -> Result<Self, Vec<SceneProblem>> {
        if instants > 1 {
            let problems = no_period(&parts);
            if !problems.is_empty() {
                return Err(problems);
            }
        }
        let later = (1..instants).map(|i| {
            let mut parts = parts.clone();
            let phase = TAU * i as f64 / instants as f64;
            for medium in &mut parts.media {
                medium.index = medium.index.at_phase(phase);
            }
            Scene::new(parts)
        });
        let later = later.collect::<Result<Vec<_>, _>>()?;
        let mut scene = Scene::new(parts)?;
        scene.later = later;
        Ok(scene)
    }

    /// Number of instants.
    pub fn instants(&self) -> usize {
        1 + self.later.len()
    }

    /// The scene that sample (or particle) number `sample` sees: instants take turns.
    pub fn at(&self, sample: u64) -> &Scene {
        match (sample % self.instants() as u64) as usize {
            0 => self,
            i => &self.later[i - 1],
        }
    }

    /// The least number of samples, at least `samples`, that are the same number at each instant, in whole
    /// [replicates](Scene::replicates).
    pub fn whole_periods(&self, samples: u64) -> u64 {
        let instants = self.instants() as u64;
        // Both divide their product, the least common multiple is no larger.
        let multiples = (1..=self.replicates().size()).map(|i| i * instants);
        let unit = multiples.filter(|n| n.is_multiple_of(self.replicates().size()));
        let unit = unit.min().unwrap_or(instants);
        samples.div_ceil(unit).saturating_mul(unit)
    }
}

/// Why there is nothing to take a mean over.
fn no_period(parts: &Parts) -> Vec<SceneProblem> {
    let error = |subject, message: String, help: &str| SceneProblem {
        severity: ProblemSeverity::Error,
        subject,
        message,
        help: help.into(),
    };
    let lengths = parts.media.iter().map(|m| m.index.sound_wavelengths());
    let lengths: Vec<_> = lengths.collect();
    if lengths.iter().all(Option::is_none) {
        let message = "the sampler has 'phases', but no medium has sound in it";
        return vec![error(
            Subject::Sensor,
            message.into(),
            "leave 'phases' out, or give a medium an 'acoustic' index",
        )];
    }
    let uneven = |(id, lengths): (usize, &Option<[f64; 2]>)| {
        let [shortest, longest] = (*lengths)?;
        (longest > shortest * (1.0 + SAME)).then(|| {
            let message = format!(
                "the sound in medium '{}' has several wavelengths, {shortest} to {longest}, and no common \
                 period to average over",
                parts.media[id].name
            );
            error(
                Subject::Medium(id),
                message,
                "give all modes the same wave number, or leave the sampler's 'phases' out",
            )
        })
    };
    lengths.iter().enumerate().filter_map(uneven).collect()
}
