//! Which estimator is the best for a picture: a pilot tells.
//!
//! Of each candidate a pilot takes samples that are not part of the image. They tell the relative variance of a pixel's
//! sample and the work that it takes, and the candidate with the least product of both is chosen. The choice depends on the
//! pilot's samples only, which are independent of the image's: it does not bias the image, whatever it is
//! (docs/theory.md#choice-of-the-estimator).
//!
//! Work is counted rather than timed: equal scenes, seeds and limits lead to equal choices, on any machine and in all parts of a render.

use super::candidate_pilot::{PilotSums, relative_variances};
use super::source::{LightSamples, Source};
use super::{Handle, RenderOptions, prepare};
use crate::integrator::Integrator;
use crate::renderer::Renderer;
use crate::scene::{FilmSpec, NO_SCENE, Scene};

/// Work of all candidates together at most, some two seconds of one processor, in the unit of [`Stats::cost`](crate::stats::Stats::cost).
const MOST_WORK: f64 = 3e7;
/// About as much work is done in a second by one processor.
const WORK_PER_SECOND: f64 = 1.5e7;
/// The pilot's share of the work of a render, or of its time.
const SHARE: f64 = 0.1;
/// Pairs of samples that tell what one costs.
const FIRST_PAIRS: usize = 4;
/// No more pairs than these are ever taken of one candidate.
const MOST_PAIRS: usize = 1 << 17;
/// Fewer pairs tell nothing of a candidate.
const LEAST_PAIRS: usize = 16;
/// About what a sample takes, as long as that is not known.
const USUAL_WORK: f64 = 100.0;
/// What a candidate finds out before its first sample is this share of its pilot.
const PREPARATION: f64 = 0.3;
/// Relative variances below this are those of rounding.
const NOISELESS: f64 = 1e-12;
/// Others must be better than the first candidate by this factor: pilots err.
const BETTER: f64 = 0.9;

/// What limits the work of a pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Samples per pixel of the whole render, if there is a limit.
    pub samples: Option<u64>,
    /// Time that the render may take in seconds, if there is a limit.
    pub seconds: Option<f64>,
}

/// An estimator, and what a pilot says of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The estimator.
    pub integrator: Integrator,
    /// Variance of a pixel's sample, relative to the square of the pixel's brightness plus 5 % of the image's: the mean over pixels.
    pub relative_variance: f64,
    /// Work of a sample, in the unit of [`Stats::cost`](crate::stats::Stats::cost).
    pub work: f64,
    /// Samples of pixels that tell so.
    pub samples: u64,
}

impl Candidate {
    /// Whether its samples are alike but for rounding.
    pub fn is_noiseless(&self) -> bool {
        self.relative_variance <= NOISELESS
    }

    /// Relative variance × work: the less, the better.
    pub fn inefficiency(&self) -> f64 {
        self.relative_variance * self.work
    }
}

/// What a choice rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// There is one candidate only.
    Single,
    /// The render is too short for a pilot: it is the first candidate.
    TooShort,
    /// The handle ended the pilot: it is the first candidate.
    Ended,
    /// A pilot.
    Pilot,
}

/// The estimator that was chosen, and from what.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The one that was chosen.
    pub integrator: Integrator,
    /// What the choice rests on.
    pub basis: Basis,
    /// The candidates that a pilot has seen; none without one.
    pub candidates: Vec<Candidate>,
}

impl Choice {
    /// How many times less work the chosen one takes for the same error than each of the others.
    pub fn gains(&self) -> impl Iterator<Item = (Integrator, f64)> {
        let is_chosen = |c: &&Candidate| c.integrator == self.integrator;
        let chosen = self.candidates.iter().find(is_chosen);
        let chosen = chosen.map_or(f64::NAN, Candidate::inefficiency);
        let others = self.candidates.iter().filter(move |c| !is_chosen(c));
        others.map(move |other| (other.integrator, other.inefficiency() / chosen))
    }

    /// Samples per pixel of `scenes` that one processor of usual speed takes in so many seconds, if a pilot tells what one costs.
    pub fn expected_samples(&self, scenes: &[Scene], seconds: f64) -> Option<f64> {
        let is_chosen = |c: &&Candidate| c.integrator == self.integrator;
        let work = self.candidates.iter().find(is_chosen)?.work;
        let FilmSpec { width, height, .. } = scenes[0].film();
        let samples = (width * height * scenes.len()) as f64;
        Some(seconds * WORK_PER_SECOND / (work * samples))
    }
}

/// Chooses one of the `candidates` for a render of `scenes` with `options` (but for their renderer). The
/// first is chosen if the render is too short for a pilot, or the handle ends it.
///
/// # Panics
/// Without scenes or candidates.
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
    // Groups of channels are alike but for spectra and indices: the one with the most light speaks for all.
    let group = brightest(scenes);
    let (scene, film) = (&scenes[group..=group], scenes[group].film());
    let budget = Budget::new(extent, film, candidates.len());
    if budget.samples < (2 * LEAST_PAIRS) as f64 {
        return first(Basis::TooShort);
    }
    let preparation = PREPARATION * budget.work(USUAL_WORK);
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
        *sum += PilotSums::take(light, FIRST_PAIRS..pairs.clamp(FIRST_PAIRS, MOST_PAIRS));
    }
    if handle.stop().is_raised() {
        return first(Basis::Ended);
    }
    // Those whose samples take too long for a judgement are out.
    let judged = candidates.iter().zip(sums);
    let judged = judged.filter(|(_, sum)| sum.pairs() >= LEAST_PAIRS as f64);
    let (integrators, sums): (Vec<Integrator>, Vec<PilotSums>) = judged.unzip();
    if sums.is_empty() {
        return first(Basis::TooShort);
    }
    let told = sums.iter().zip(relative_variances(&sums, film));
    let told = told
        .zip(integrators)
        .map(|((sum, variance), integrator)| Candidate {
            integrator,
            relative_variance: variance.max(NOISELESS),
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

/// The group of channels in which emitters have the most power.
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

/// What the pilot of a candidate may take.
#[derive(Clone, Copy, Debug)]
struct Budget {
    /// Samples of pixels.
    samples: f64,
    /// Work.
    work: f64,
}

impl Budget {
    fn new(extent: Extent, film: &FilmSpec, candidates: usize) -> Self {
        let pixels = (film.width * film.height) as f64;
        let samples = extent.samples.map(|spp| SHARE * spp as f64 * pixels);
        let time = extent.seconds.map(|s| SHARE * s * WORK_PER_SECOND);
        let each = |limit: f64| limit / candidates as f64;
        Budget {
            samples: each(samples.unwrap_or(f64::INFINITY)),
            work: each(time.map_or(MOST_WORK, |time| time.min(MOST_WORK))),
        }
    }

    /// The work if a sample takes so much.
    fn work(&self, sample: f64) -> f64 {
        self.work.min(self.samples * sample)
    }
}

/// The candidate with the least relative variance × work: the `first` one unless another is clearly better.
fn best(candidates: &[Candidate], first: Integrator) -> Integrator {
    let rated = candidates.iter().map(|candidate| {
        let handicap = if candidate.integrator == first {
            BETTER
        } else {
            1.0
        };
        (candidate.integrator, handicap * candidate.inefficiency())
    });
    let sound = rated.filter(|(_, inefficiency)| inefficiency.is_finite());
    let best = sound.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(first, |(integrator, _)| integrator)
}
