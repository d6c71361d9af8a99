//! Reports on a render: as text, in image attributes, and as JSON.

use crate::balance;
use crate::job::Job;
use crate::load::file_name;
use crate::numbers;
use io::clock::Stopped;
use io::rendered::Naming;
use io::{Run, report};
use serde_json::{Value, json};
use std::time::Duration;
use transport::integrator::Integrator;
use transport::render::Rendering;
use transport::renderer::Renderer;
use transport::stats::ConnectionCounts;

/// Least effect of tolerances that is reported, relative to the noise of a pixel.
const MIN_EFFECT: f64 = 0.1;

/// Finished run, with its result.
#[derive(Debug)]
pub struct Report<'a, T> {
    /// Job that was requested.
    pub job: &'a Job,
    /// Run, with its scene.
    pub run: &'a Run<'a>,
    /// Result.
    pub result: &'a T,
    /// Requested samples per pixel, or particles, if limited.
    pub requested: Option<u64>,
    /// Duration of the run.
    pub elapsed: Duration,
    /// Number of threads; `None` if parts were merged.
    pub threads: Option<usize>,
    /// Reason why the run ended early, if it did.
    pub stopped: Option<Stopped>,
}

impl<'a, T> Report<'a, T> {
    /// Returns the report with a part of the result.
    pub fn of<U>(&self, result: &'a U) -> Report<'a, U> {
        Report {
            job: self.job,
            run: self.run,
            result,
            requested: self.requested,
            elapsed: self.elapsed,
            threads: self.threads,
            stopped: self.stopped,
        }
    }
}

impl Report<'_, Rendering> {
    /// Returns the number of samples taken per second.
    fn rate(&self) -> f64 {
        self.result.film.samples() as f64 / self.elapsed.as_secs_f64().max(1e-9)
    }

    /// Formats the number of samples per pixel. If it varies, formats the mean with its limits.
    fn spp(&self) -> String {
        let mean = self.result.samples;
        match self.result.film.least_and_most() {
            [least, most] if least < most => format!("{mean} spp ({least} to {most})"),
            _ => format!("{mean} spp"),
        }
    }

    /// Returns the line at the end of a render, with the exposure chosen for its PNG files. A line
    /// with the energy balance follows, if there is one.
    pub fn line(&self, exposure: Option<f64>) -> String {
        let stopped = match self.stopped {
            Some(Stopped::Interrupted) => "interrupted: ",
            _ => "",
        };
        let mut parts = vec![
            format!("{stopped}{}", numbers::duration(self.elapsed)),
            self.spp(),
            format!("{} samples/s", numbers::count(self.rate())),
            self.outcome(),
        ];
        parts.extend(self.choice());
        parts.extend(self.photon_line());
        parts.extend(self.target_line());
        parts.extend(self.tolerance_line());
        parts.extend(self.warning());
        let stats = &self.result.stats;
        if stats.connections.capped > 0 {
            parts.push(bias(stats.connections.capped));
        }
        parts.extend(report::possible_bias(stats));
        let naming = Naming::of(self.run.loaded);
        let outside = naming.map_or(0.0, |n| n.outside(&self.result.film));
        if outside > 0.0 {
            parts.push(format!("{} outside of all bins", numbers::percent(outside)));
        }
        let quantities = self.result.quantities.as_ref();
        let lost = quantities.map_or(0, |quantities| quantities.stats.lost);
        for (count, what) in [
            (stats.lost, "rays lost"),
            (stats.not_finite, "samples not finite"),
            (lost, "rays of quantities lost"),
        ] {
            if count > 0 {
                parts.push(format!("{} {what}", numbers::count(count as f64)));
            }
        }
        // An exposure of 0 changes nothing.
        parts.extend(
            exposure
                .filter(|stops| *stops != 0.0)
                .map(numbers::exposure),
        );
        let balance = self.result.balance.iter().map(balance::text);
        let lines = std::iter::once(parts.join(" · ")).chain(balance);
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Describes which integrator was chosen and why, if there was a choice.
    fn choice(&self) -> Option<String> {
        let reason = self.run.reason.as_ref()?;
        Some(format!("integrator {}: {reason}", self.run.renderer.name()))
    }

    /// Summarises the image.
    fn outcome(&self) -> String {
        if self.result.samples == 0 {
            return "the image is empty: no sample of the whole image was completed; allow more time".into();
        }
        if !self.run.renderer.is_light() {
            let stats = &self.result.stats;
            let valid = stats.paths.saturating_sub(stats.lost);
            return format!(
                "{} of the rays valid",
                numbers::percent(valid as f64 / stats.paths.max(1) as f64)
            );
        }
        let (mean, error) = self.result.film.summary();
        let mean = numbers::with_error(mean, error);
        let connections = failures(&self.result.stats.connections);
        format!("mean {mean} · {connections}")
    }

    /// Describes why the error of the mean is unreliable, if it is, with advice.
    fn warning(&self) -> Option<String> {
        let film = &self.result.film;
        if self.run.renderer.is_light() && self.result.samples > 0 && film.summary().0 == 0.0 {
            let advice = "morgana check lists what may keep light from the sensor";
            return Some(format!("the picture is black: {advice}"));
        }
        // An unknown error is reported as unknown elsewhere.
        let is_known = film.summary().1.is_finite();
        (self.run.renderer.is_light() && is_known && film.few_in_all(None)).then(|| {
            let advice = match self.run.renderer {
                // Advise another integrator only if no pilot has tried it, and if it can separate
                // the light.
                Renderer::Light(Integrator::Path(_))
                    if self.run.reason.is_none()
                        && self.run.loaded.layering.decomposition.parts.is_none() =>
                {
                    "take more samples, or try the integrator bdpt"
                }
                _ => "take more samples",
            };
            let tail = film.tail(None);
            let reason = if tail.is_heavy() {
                format!(
                    "a single sample contributes {} of it",
                    numbers::percent(tail.share())
                )
            } else {
                "too few samples contribute to it".into()
            };
            format!("the error is unreliable: {reason}; {advice}")
        })
    }

    /// Returns attributes for images. They depend on the computation, not on its time, place or
    /// speed: equal renders give equal files.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let stats = &self.result.stats;
        let pairs = [
            ("scene", file_name(&self.job.scene)),
            ("scene_hash", self.run.loaded.hash.to_string()),
            ("morgana_version", env!("CARGO_PKG_VERSION").into()),
            ("integrator", self.run.renderer.name().into()),
            ("seed", self.job.seed.to_string()),
            ("spp", self.result.samples.to_string()),
            ("options", self.job.command_line()),
            (
                "branches",
                report::branches(self.run.loaded.scene()).to_string(),
            ),
            (
                "connections",
                report::connections(stats, self.result.search).to_string(),
            ),
            ("lost", stats.lost.to_string()),
            ("over_budget", report::over_budget(stats).to_string()),
            ("not_finite", stats.not_finite.to_string()),
        ];
        let naming = Naming::of(self.run.loaded);
        let axes = naming.map(|n| ("decomposition", Value::from(n.axes()).to_string()));
        let trust = report::trust(self.run.loaded, &self.result.film);
        let trust = trust.map(|trust| ("trust", trust.to_string()));
        let choice = self
            .run
            .reason
            .clone()
            .map(|reason| ("integrator_choice", reason));
        let pairs = pairs.into_iter().chain(choice).chain(trust).chain(axes);
        pairs
            .map(|(name, value)| (name.to_owned(), value))
            .collect()
    }

    /// Returns the target error and its outcome.
    fn target(&self) -> Option<Value> {
        let measure = self.job.target.unwrap_or_default();
        self.job.target_error.map(|wanted| {
            let error = self.result.error(measure);
            json!({
                "measure": measure.name(),
                "wanted": wanted,
                "error": error.is_finite().then_some(error),
                "reached": self.result.reached,
                "possible_bias": self.result.reached.then_some("stopping by measured error"),
            })
        })
    }

    /// Describes the target error and its outcome in a few words.
    fn target_line(&self) -> Option<String> {
        let wanted = self.job.target_error?;
        let measure = self.job.target.unwrap_or_default();
        let error = self.result.error(measure);
        let outcome = if self.result.reached {
            "reached (stopping adds a slight bias)".into()
        } else if error <= wanted {
            // The error is small enough, but this may be a random fluctuation.
            format!(
                "of {} not confirmed by two checks",
                numbers::percent(wanted)
            )
        } else {
            format!("of {} not reached", numbers::percent(wanted))
        };
        Some(format!(
            "{} error {}, target {outcome}",
            measure.name(),
            numbers::percent(error)
        ))
    }

    /// Describes the bias from the tolerance of rays, if it matters beside the noise.
    fn tolerance_line(&self) -> Option<String> {
        let accuracy = self.result.accuracy;
        let effect = accuracy.effect_beside_noise(self.result.samples);
        (effect > MIN_EFFECT).then(|| {
            format!(
                "tolerance {:e}: bias up to {} of the noise of pixels; set a smaller 'tolerance' in the scene",
                accuracy.tolerance,
                numbers::percent(effect)
            )
        })
    }

    /// Describes the bias from photons in a few words.
    fn photon_line(&self) -> Option<String> {
        let debiased = self.result.debiased.as_ref()?;
        let photons = &self.result.stats.photons;
        if self.result.samples == 0 {
            return None;
        }
        if photons.in_media + photons.on_surfaces == 0 {
            let only = match self.run.renderer.integrator() {
                Some(Integrator::Vcm(_)) => "light that connections find is visible",
                _ => "emitters are seen",
            };
            return Some(format!(
                "no photon reached a surface or medium: only {only}"
            ));
        }
        let film = &self.result.film;
        Some(about_bias(debiased.bias(film), film.summary().0))
    }

    /// Returns the whole report as JSON.
    pub fn json(&self) -> Value {
        let (mean, error) = self.result.film.summary();
        let film = &self.result.film;
        let run = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": file_name(&self.job.scene),
            "integrator": self.run.renderer.name(),
            "integrator_choice": self.run.reason,
            "options": self.job.command_line(),
            "seed": self.job.seed,
            "spp_requested": self.requested,
            "stopped": self.stopped.map(Stopped::name),
            "threads": self.threads,
            "seconds": self.elapsed.as_secs_f64(),
            "samples_per_second": self.rate(),
            "width": film.width(),
            "height": film.height(),
            "channels": self.run.loaded.channel_names,
            "mean": mean,
            "standard_error": error,
            "target": self.target(),
        });
        report::render(self.run.loaded, self.result, run)
    }
}

fn failures(connections: &ConnectionCounts) -> String {
    match connections.attempts {
        0 => "no connections".into(),
        n => format!(
            "{} of {} connections failed",
            numbers::percent(connections.failure_rate()),
            numbers::count(n as f64)
        ),
    }
}

/// Describes the bias from photons relative to the mean. For a mean of 0 it is unknown.
fn about_bias(bias: f64, mean: f64) -> String {
    let share = bias / mean;
    if share.is_finite() {
        format!("bias about {}", numbers::percent(share))
    } else {
        "bias unknown, because the mean is 0".to_owned()
    }
}

/// Describes the bias from branches with capped weights, which makes the picture too dark.
fn bias(capped: u64) -> String {
    let branches = match capped {
        1 => "1 branch counts".into(),
        n => format!("{} branches count", numbers::count(n as f64)),
    };
    format!("possible bias: {branches} with too small a weight")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bias_of_a_picture_without_light_is_unknown() {
        assert_eq!(about_bias(-0.01, 2.0), "bias about -0.5%");
        for bias in [0.0, 0.01] {
            assert_eq!(about_bias(bias, 0.0), "bias unknown, because the mean is 0");
        }
    }

    #[test]
    fn a_branch_cut_off_is_a_possible_bias() {
        assert_eq!(
            bias(1),
            "possible bias: 1 branch counts with too small a weight"
        );
        assert_eq!(
            bias(2300),
            "possible bias: 2.30 k branches count with too small a weight"
        );
    }
}
