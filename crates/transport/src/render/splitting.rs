//! Choice whether to follow both branches of a path, refracted and reflected, from its first smooth
//! surface.
//!
//! Split samples give the variances with and without splitting. Each sample gives the contributions
//! of both branches, and the probability with which a path without splitting takes either branch.
//! Rare bright reflections are therefore seen on every split sample.
//!
//! Theory: docs/theory.md#first-vertex-techniques.

use super::Prepared;
use super::pilot_pixels::{FIRST_SAMPLE, Pairs, spread, weights};
use super::source::LightSamples;
use crate::integrator::Contribution;
use crate::path::Workspace;

/// Number of pixels, spread over the image. Each has two samples.
const PIXELS: usize = 1024;
/// First number of the samples, beyond the numbers of the other pilots.
const FIRST_SPLIT: u64 = FIRST_SAMPLE + (1 << 40);

/// Returns true if splitting reduces variance × work, both with less weight for bright pixels and
/// with equal weights.
pub(super) fn pays(light: &LightSamples, prepared: &Prepared) -> bool {
    let mut prepared = prepared.clone();
    prepared.first_vertex.splitting = true;
    let mut ws = light.source.workspace_of(&prepared);
    let most = light.source.pilot_work;
    let film = light.source.scene.film();
    let mut pixels: Vec<[SplitPath; 2]> = Vec::with_capacity(PIXELS);
    while pixels.len() < PIXELS && (pixels.is_empty() || ws.stats().cost() < most) {
        let i = pixels.len();
        pixels.push([0, 1].map(|k| {
            let number = light.source.replicates.size() * (2 * i as u64 + k);
            SplitPath::take(light, spread(i, film), FIRST_SPLIT + number, &mut ws)
        }));
    }
    let pairs: Pairs = pixels
        .iter()
        .map(|pair| pair.each_ref().map(SplitPath::sum))
        .collect();
    let alike = vec![1.0; pairs.len()];
    [weights(&[&pairs]), alike].iter().all(|weights| {
        let mut both = Efficiency::default();
        let mut one = Efficiency::default();
        for (pair, weight) in pixels.iter().zip(weights) {
            let scatter = (pair[0].sum() - pair[1].sum()).powi(2);
            let chance: f64 = pair.iter().map(SplitPath::chance).sum();
            both.add(
                weight * scatter,
                pair.iter().map(|path| path.work.iter().sum::<f64>()).sum(),
            );
            one.add(
                // Planted error "splitting judged without the variance of the choice", found by morgana-transport/transport::first_vertex::pilots_choose_what_pays:
                // weight * (scatter + 0.0 * chance),
                weight * (scatter + chance),
                pair.iter().map(SplitPath::work_of_one).sum(),
            );
        }
        both.product() < one.product()
    })
}

/// Path that was split, or that met no surface to split at.
struct SplitPath {
    /// Contributions of the refracted and of the reflected branch.
    values: [f64; 2],
    /// Work of each branch.
    work: [f64; 2],
    /// Probability with which a path without splitting is reflected.
    reflectance: f64,
}

impl SplitPath {
    fn take(light: &LightSamples, pixel: usize, sample: u64, ws: &mut Workspace) -> Self {
        let scene = light.source.scene.at(sample);
        let channels = light.source.channels();
        let start = ws.stats().cost();
        let mut path = SplitPath {
            values: [0.0; 2],
            work: [0.0; 2],
            reflectance: 0.0,
        };
        ws.split = None;
        light.take_by(
            light.source.cells.of_pixel(pixel),
            &light.source.image_sample(sample),
            ws,
            &mut Vec::new(),
            |ray, sampler, ws, out| {
                light
                    .integrator
                    .sample(scene, ray, channels, sampler, ws, out);
                let sum = |found: &[Contribution]| found.iter().map(|c| c.weighted().sum()).sum();
                let end = ws.stats().cost();
                match ws.split {
                    Some(split) => {
                        let (refracted, reflected) = out.split_at(split.before);
                        path.values = [refracted, reflected].map(sum);
                        path.work = [split.cost - start, end - split.cost];
                        path.reflectance = split.reflectance;
                    }
                    None => {
                        path.values[0] = sum(out);
                        path.work[0] = end - start;
                    }
                }
            },
        );
        path
    }

    fn sum(&self) -> f64 {
        self.values.iter().sum()
    }

    /// Returns the variance that the random choice of one branch adds: A²/(1 − F) + B²/F − (A +
    /// B)².
    fn chance(&self) -> f64 {
        if self.reflectance == 0.0 {
            return 0.0;
        }
        let odds = (self.reflectance / (1.0 - self.reflectance)).sqrt();
        (odds * self.values[0] - self.values[1] / odds).powi(2)
    }

    /// Returns the mean work of a path that takes one branch.
    fn work_of_one(&self) -> f64 {
        (1.0 - self.reflectance) * self.work[0] + self.reflectance * self.work[1]
    }
}

/// Variance, up to a factor, and work.
#[derive(Default)]
struct Efficiency {
    scatter: f64,
    work: f64,
}

impl Efficiency {
    fn add(&mut self, scatter: f64, work: f64) {
        self.scatter += scatter;
        self.work += work;
    }

    fn product(&self) -> f64 {
        self.scatter * self.work
    }
}
