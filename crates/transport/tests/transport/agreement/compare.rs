//! Comparison of renders of one scene by several estimators.
//!
//! Pixels of a splatting estimator are correlated, so that errors cannot be taken from the film.
//! Every estimator renders batches of independent seeds. Welch's t-test compares the batches' means
//! over the image and over its four quarters.

use crate::agreement::pooled::Pooled;
use crate::common::{Batches, path_tracer, samples};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::Rendering;
use morgana_transport::scene::Parts;
use testkit::batches::{critical_t, moments, welch};
use testkit::{Family, sidak};

/// The whole image and its quarters.
pub const AREAS: usize = 5;
/// Relative differences below this are round-off of rays and solver, and do not count.
pub const ROUND_OFF: f64 = 1e-5;

/// Effort of a comparison.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Number of independent batches per estimator.
    pub batches: u64,
    /// Evaluations of the index, edges and connections in all batches together; they determine the
    /// time.
    pub work: u64,
}

/// Default runs have half of the batches, and do the work divided by this number. All the work is
/// done where planted errors are searched.
const SHARE: u64 = 3;
/// Fewest batches of a default run. The means of fewer batches with a few bright samples are not
/// nearly normal: with 6 batches, Welch's test fails for correct estimators.
const MIN_BATCHES: u64 = 12;

/// Samples of the render that measures the work per sample.
const PROBE: u64 = 4;

impl Effort {
    /// Returns the effort for equally many batches that are `factor` times as large.
    pub fn times(self, factor: u64) -> Self {
        Effort {
            work: self.work * factor,
            ..self
        }
    }

    /// Returns the effort of this run.
    fn of_run(self) -> Self {
        let few = (self.batches / 2).max(MIN_BATCHES).min(self.batches);
        Effort {
            batches: samples(self.batches, few),
            work: self.work * samples(SHARE, 1) / SHARE,
        }
    }

    /// Samples per pixel of a batch. They follow from counts, not times, and are therefore equal on
    /// every machine.
    fn samples(&self, all: &Batches) -> u64 {
        let stats = all.render(1 << 20, PROBE).stats;
        let events = stats.edges + stats.connections.attempts + stats.connections.trials;
        let work = (stats.work.evaluations + 20 * events) / PROBE;
        (self.work / (self.batches * work.max(1))).clamp(PROBE, 2048)
    }
}

/// Means of one estimator: one mean per batch, for each area.
pub type Means = [Vec<f64>; AREAS];

/// Result of a comparison.
pub struct Row {
    pub name: String,
    /// Means over the image, with standard errors: path, particle, bdpt.
    pub image: [Option<(f64, f64)>; 3],
    /// Names and p-values: path against bdpt, and particle against bdpt.
    pub p_values: Vec<(String, f64)>,
    /// Error of the difference path − bdpt, relative to the mean.
    pub error: f64,
    /// Means of the batches over the image: path, particle, bdpt.
    pub batches: [Option<Vec<f64>>; 3],
}

pub fn particle() -> Integrator {
    Integrator::Particle(ParticleTracer::default())
}

pub fn bdpt() -> Integrator {
    Integrator::Bdpt(Bdpt::default())
}

pub fn render(integrator: Integrator, parts: &Parts, effort: Effort, seed: u64) -> Means {
    let effort = effort.of_run();
    let all = Batches::new(integrator, parts.clone(), seed.wrapping_mul(1 << 20));
    let samples = effort.samples(&all);
    let mut means: Means = Default::default();
    for batch in 0..effort.batches {
        for (area, mean) in means.iter_mut().zip(areas(&all.render(batch, samples))) {
            area.push(mean);
        }
    }
    means
}

fn areas(rendering: &Rendering) -> [f64; AREAS] {
    let film = &rendering.film;
    let (w, h) = (film.width(), film.height());
    let mut sums = [0.0; AREAS];
    for (i, pixel) in film.pixels(0).enumerate() {
        let quarter = usize::from(2 * (i % w) >= w) + 2 * usize::from(2 * (i / w) >= h);
        let value = pixel.mean()[0];
        sums[0] += value / (w * h) as f64;
        sums[1 + quarter] += value * 4.0 / (w * h) as f64;
    }
    sums
}

/// Compares the path tracer and, with the effort it is given, the particle tracer with bidirectional path
/// tracing.
pub fn compare(
    name: &str,
    parts: &Parts,
    effort: Effort,
    seed: u64,
    particles: Option<Effort>,
) -> Row {
    let estimators = [
        Some((path_tracer(), effort)),
        particles.map(|effort| (particle(), effort)),
        Some((bdpt(), effort)),
    ];
    let means: Vec<Option<Means>> = (0..3)
        .map(|k| estimators[k].map(|(e, effort)| render(e, parts, effort, 3 * seed + k as u64)))
        .collect();
    let reference = means[2].as_ref().unwrap();
    let mut p_values = Vec::new();
    for (k, label) in ["path", "particle"].into_iter().enumerate() {
        let Some(means) = &means[k] else { continue };
        for area in 0..AREAS {
            let p = welch(&means[area], &reference[area], ROUND_OFF);
            p_values.push((format!("{name}, {label}, area {area}"), p));
        }
    }
    let whole = |m: &Option<Means>| {
        let m = moments(&m.as_ref()?[0]);
        Some((m.mean(), m.standard_error()))
    };
    let image = [whole(&means[0]), whole(&means[1]), whole(&means[2])];
    let [Some(path), _, Some(bdpt)] = image else {
        unreachable!("both are always rendered");
    };
    Row {
        name: name.into(),
        image,
        p_values,
        error: path.1.hypot(bdpt.1) / bdpt.0,
        batches: [0, 1, 2].map(|k| means[k].as_ref().map(|m| m[0].clone())),
    }
}

/// Judges all comparisons as one family at a false-alarm rate.
pub fn judge(rows: &[Row], pooled: &[Pooled], rate: f64) -> Result<(), String> {
    let mut family = Family::new(rate);
    for (name, p) in rows.iter().flat_map(|r| &r.p_values) {
        family.push(name, *p);
    }
    for (name, p) in pooled.iter().flat_map(Pooled::p_values) {
        family.push(name, p);
    }
    family.check()
}

/// Smallest relative deviation of an image's mean that a family of `comparisons` comparisons finds
/// with a probability of 95 %.
pub fn detectable(row: &Row, comparisons: usize, rate: f64, effort: Effort) -> f64 {
    let freedom = (effort.of_run().batches - 1) as f64;
    (critical_t(sidak(rate, comparisons), freedom) + critical_t(0.1, freedom)) * row.error
}

/// Formats a table with one line per row.
pub fn table(rows: &[Row], rate: f64, effort: Effort) -> String {
    let comparisons = rows.iter().map(|r| r.p_values.len()).sum();
    let mut out = String::from(
        "| scene | path | particle | bdpt | smallest p | detectable |\n|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let show = |v: Option<(f64, f64)>| match v {
            Some((m, e)) => format!("{m:.4} ± {:.2} %", 100.0 * e / m),
            None => "–".into(),
        };
        let least = row.p_values.iter().fold(1.0, |a: f64, (_, p)| a.min(*p));
        let [path, particle, bdpt] = row.image.map(show);
        let deviation = 100.0 * detectable(row, comparisons, rate, effort);
        let name = &row.name;
        out += &format!(
            "| {name} | {path} | {particle} | {bdpt} | {least:.1e} | {deviation:.1} % |\n"
        );
    }
    out
}
