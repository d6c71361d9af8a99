//! Choice of the best estimator for a picture, by a pilot.
//!
//! A pilot takes samples of each candidate that are not part of the image. They give the relative
//! variance of a pixel's sample and the work of a sample. The candidate with the least product of
//! both is chosen. The choice does not bias the image, because the pilot's samples are independent
//! of the image's samples (docs/theory.md#choice-of-the-estimator).
//!
//! Work is counted, not timed. Equal scenes, seeds and limits lead to equal choices on any machine
//! and in all parts of a render.

use super::candidate_pilot::{PilotSums, relative_variances};
use super::source::{LightSamples, Source};
use super::{Handle, RenderOptions, prepare};
use crate::integrator::Integrator;
use crate::renderer::Renderer;
use crate::scene::{FilmSpec, NO_SCENE, Scene};

/// Maximum work of all candidates together, in the unit of
/// [`Stats::cost`](crate::stats::Stats::cost): about two seconds on one CPU core.
const MAX_WORK: f64 = 3e7;
/// Approximate work per second on one CPU core, in the unit of
/// [`Stats::cost`](crate::stats::Stats::cost).
const WORK_PER_SECOND: f64 = 1.5e7;
/// Fraction of the work or the time of a render that the pilot may take.
const PILOT_FRACTION: f64 = 0.1;
/// Pairs of samples from which the work of a sample is first estimated.
const FIRST_PAIRS: usize = 4;
/// Maximum number of pairs of one candidate.
const MAX_PAIRS: usize = 1 << 17;
/// Minimum number of pairs of a candidate. Variances from fewer pairs are too uncertain.
const MIN_PAIRS: usize = 16;
/// Assumed work of a sample until the pilot has measured it.
const INITIAL_WORK: f64 = 100.0;
/// Fraction of a candidate's pilot that its preparation may take before the first sample.
const PREPARATION_FRACTION: f64 = 0.3;
/// Relative variance below which differences are due to rounding.
const MIN_RELATIVE_VARIANCE: f64 = 1e-12;
/// Factor on the inefficiency of the first candidate. Another candidate must be better by this
/// factor to be chosen, because the inefficiencies have errors.
const FIRST_CANDIDATE_FACTOR: f64 = 0.9;

/// Limits of a render, from which the work of its pilot follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Samples per pixel of the whole render, if there is a limit.
    pub samples: Option<u64>,
    /// Time that the render may take in seconds, if there is a limit.
    pub seconds: Option<f64>,
}

/// Estimator with the results of its pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Estimator.
    pub integrator: Integrator,
    /// Relative variance of a pixel's sample: its variance over μ² + (0.05 μ̄)², the mean over
    /// pixels. μ is the pixel's brightness, μ̄ the image's.
    pub relative_variance: f64,
    /// Work of a sample, in the unit of [`Stats::cost`](crate::stats::Stats::cost).
    pub work: f64,
    /// Number of samples of pixels behind these values.
    pub samples: u64,
}

impl Candidate {
    /// Returns true if all samples are equal up to rounding.
    pub fn is_noiseless(&self) -> bool {
        self.relative_variance <= MIN_RELATIVE_VARIANCE
    }

    /// Returns the relative variance × work; lower is better.
    pub fn inefficiency(&self) -> f64 {
        self.relative_variance * self.work
    }
}

/// Reason for a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// There is only one candidate.
    Single,
    /// The render is too short for a pilot; the first candidate is chosen.
    TooShort,
    /// The handle ended the pilot; the first candidate is chosen.
    Ended,
    /// A pilot compared the candidates.
    Pilot,
}

/// Estimator that was chosen, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Chosen estimator.
    pub integrator: Integrator,
    /// Reason for the choice.
    pub basis: Basis,
    /// Candidates that the pilot compared; empty without a pilot.
    pub candidates: Vec<Candidate>,
}

impl Choice {
    /// Returns each other candidate with its inefficiency relative to the chosen candidate: the
    /// ratio of the work that both take to reach one error.
    pub fn gains(&self) -> impl Iterator<Item = (Integrator, f64)> {
        let is_chosen = |c: &&Candidate| c.integrator == self.integrator;
        let chosen = self.candidates.iter().find(is_chosen);
        let chosen = chosen.map_or(f64::NAN, Candidate::inefficiency);
        let others = self.candidates.iter().filter(move |c| !is_chosen(c));
        others.map(move |other| (other.integrator, other.inefficiency() / chosen))
    }

    /// Returns the number of samples per pixel of `scenes` that one typical CPU core takes in
    /// `seconds`. Returns `None` if no pilot measured the work of a sample.
    pub fn expected_samples(&self, scenes: &[Scene], seconds: f64) -> Option<f64> {
        let is_chosen = |c: &&Candidate| c.integrator == self.integrator;
        let work = self.candidates.iter().find(is_chosen)?.work;
        let FilmSpec { width, height, .. } = scenes[0].film();
        let samples = (width * height * scenes.len()) as f64;
        Some(seconds * WORK_PER_SECOND / (work * samples))
    }
}

/// Chooses one of the `candidates` for a render of `scenes` with `options`, whose renderer is
/// ignored. The first candidate is chosen if the render is too short for a pilot, or if the handle
/// ends the pilot.
///
/// # Panics
/// If there are no scenes or no candidates.
pub fn choose(
    scenes: &[Scene],
    candidates: &[Integrator],
    options: &RenderOptions,
    extent: Extent,
    handle: &Handle,
) -> Choice {
    assert!(!scenes.is_empty(), "{NO_SCENE}");
    assert!(!candidates.is_empty(), "there is no estimator to choose");
    let first = |basis| Choice {
        integrator: candidates[0],
        basis,
        candidates: Vec::new(),
    };
    if candidates.len() < 2 {
        return first(Basis::Single);
    }
    // Judge by the group with the most light: groups of channels are alike except for spectra and
    // indices.
    let group = brightest(scenes);
    let (scene, film) = (&scenes[group..=group], scenes[group].film());
    let budget = Budget::new(extent, film, candidates.len());
    if budget.samples < (2 * MIN_PAIRS) as f64 {
        return first(Basis::TooShort);
    }
    let preparation = PREPARATION_FRACTION * budget.work(INITIAL_WORK);
    let sources = candidates.iter().map(|integrator| {
        let options = RenderOptions {
            renderer: Renderer::Light(*integrator),
            loosens_tolerance: false,
            ..*options
        };
        let mut prepared = prepare(scene, &options, Some(preparation), handle);
        Source::new(&scene[0], group, &options, prepared.remove(0), handle)
    });
    let sources: Vec<Source> = sources.collect();
    let lights = sources.iter().zip(candidates);
    let lights: Vec<LightSamples> = lights.map(|(source, i)| source.light(*i)).collect();
    let few = lights
        .iter()
        .map(|light| PilotSums::take(light, 0..FIRST_PAIRS));
    let mut sums: Vec<PilotSums> = few.collect();
    let works = sums.iter().map(PilotSums::work_per_sample);
    let most = budget.work(works.fold(f64::INFINITY, f64::min));
    for (sum, light) in sums.iter_mut().zip(&lights) {
        let pairs = (most / sum.work * FIRST_PAIRS as f64) as usize;
        *sum += PilotSums::take(light, FIRST_PAIRS..pairs.clamp(FIRST_PAIRS, MAX_PAIRS));
    }
    if handle.stop().is_raised() {
        return first(Basis::Ended);
    }
    // Exclude candidates whose samples take too long to be judged.
    let judged = candidates.iter().zip(sums);
    let judged = judged.filter(|(_, sum)| sum.pairs() >= MIN_PAIRS as f64);
    let (integrators, sums): (Vec<Integrator>, Vec<PilotSums>) = judged.unzip();
    if sums.is_empty() {
        return first(Basis::TooShort);
    }
    let told = sums.iter().zip(relative_variances(&sums, film));
    let told = told
        .zip(integrators)
        .map(|((sum, variance), integrator)| Candidate {
            integrator,
            relative_variance: variance.max(MIN_RELATIVE_VARIANCE),
            work: sum.work_per_sample(),
            samples: sum.paths as u64,
        });
    let told: Vec<Candidate> = told.collect();
    Choice {
        integrator: best(&told, candidates[0]),
        basis: Basis::Pilot,
        candidates: told,
    }
}

/// Returns the group of channels in which emitters have the most power.
fn brightest(scenes: &[Scene]) -> usize {
    let power = |group: &usize| -> f64 {
        let scene = &scenes[*group];
        let powers = scene.powers(scene.film().channels_of(*group));
        powers.map(|power| power.sum()).sum()
    };
    let groups = (0..scenes.len()).rev();
    groups
        .max_by(|a, b| power(a).total_cmp(&power(b)))
        .unwrap_or(0)
}

/// Limits of a candidate's pilot.
#[derive(Clone, Copy, Debug)]
struct Budget {
    /// Maximum number of samples of pixels.
    samples: f64,
    /// Maximum work.
    work: f64,
}

impl Budget {
    fn new(extent: Extent, film: &FilmSpec, candidates: usize) -> Self {
        let pixels = (film.width * film.height) as f64;
        let samples = extent
            .samples
            .map(|spp| PILOT_FRACTION * spp as f64 * pixels);
        let time = extent.seconds.map(|s| PILOT_FRACTION * s * WORK_PER_SECOND);
        let each = |limit: f64| limit / candidates as f64;
        Budget {
            samples: each(samples.unwrap_or(f64::INFINITY)),
            work: each(time.map_or(MAX_WORK, |time| time.min(MAX_WORK))),
        }
    }

    /// Returns the maximum work if one sample takes the work `sample`.
    fn work(&self, sample: f64) -> f64 {
        self.work.min(self.samples * sample)
    }
}

/// Returns the candidate with the least relative variance × work: `first`, unless another one is
/// clearly better.
fn best(candidates: &[Candidate], first: Integrator) -> Integrator {
    let rated = candidates.iter().map(|candidate| {
        let handicap = if candidate.integrator == first {
            FIRST_CANDIDATE_FACTOR
        } else {
            1.0
        };
        (candidate.integrator, handicap * candidate.inefficiency())
    });
    let sound = rated.filter(|(_, inefficiency)| inefficiency.is_finite());
    let best = sound.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(first, |(integrator, _)| integrator)
}
