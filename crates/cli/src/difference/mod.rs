//! Differences of two images, as text and as JSON.

pub mod map;

use crate::args::CompareArgs;
use crate::load::file_name;
use crate::numbers::{percent, plain};
use io::compare::{Comparison, ZScores};
use io::image::ImageLayers;
use io::image::denoised::DENOISED;
use serde_json::{Value, json};
use std::fmt::Write;

/// A finished comparison.
#[derive(Debug)]
pub struct Difference<'a> {
    /// Arguments of the command.
    pub args: &'a CompareArgs,
    /// Image and reference.
    pub images: [&'a ImageLayers; 2],
    /// Numbers of the comparison.
    pub numbers: &'a Comparison,
    /// Map of visible differences.
    pub flip: &'a [f32],
}

impl Difference<'_> {
    fn mean_flip(&self) -> f64 {
        let sum: f64 = self.flip.iter().map(|v| f64::from(*v)).sum();
        sum / self.flip.len().max(1) as f64
    }

    fn largest_z(&self) -> Option<f64> {
        let worst = self.numbers.z.as_ref()?.worst.as_ref()?;
        Some(worst.z.abs())
    }

    /// Returns names, values and limits of numbers that exceed their limit. NaN exceeds every
    /// limit.
    pub fn exceeded(&self) -> Vec<(&'static str, f64, f64)> {
        let (limits, numbers) = (&self.args.limits, self.numbers);
        let most = [
            ("RMSE", limits.max_rmse, numbers.rmse),
            (
                "relative MSE",
                limits.max_relative_mse,
                numbers.relative_mse,
            ),
            ("FLIP", limits.max_flip, self.mean_flip()),
            ("largest |z|", limits.max_z, self.largest_z().unwrap_or(0.0)),
        ];
        let above = most.into_iter().filter_map(|(name, limit, value)| {
            let limit = limit?;
            (value > limit || value.is_nan()).then_some((name, value, limit))
        });
        let psnr = limits
            .min_psnr
            .filter(|least| numbers.psnr < *least || numbers.psnr.is_nan());
        above
            .chain(psnr.map(|least| ("PSNR", numbers.psnr, least)))
            .collect()
    }

    /// Returns the comparison as text for people.
    pub fn text(&self) -> String {
        let numbers = self.numbers;
        let [image, reference] = [&self.args.image, &self.args.reference].map(|p| file_name(p));
        let mut out = String::new();
        // Writing to a string cannot fail.
        let mut line = |name: &str, value: String| {
            let _ = writeln!(out, "{name:<14} {value}");
        };
        let [a, b] = numbers.means;
        line(
            "mean",
            format!("{} in {image}, {} in {reference}", plain(a), plain(b)),
        );
        line("RMSE", plain(numbers.rmse));
        line("relative MSE", plain(numbers.relative_mse));
        line("PSNR", format!("{} dB", plain(numbers.psnr)));
        line("largest", plain(numbers.largest));
        line("FLIP", plain(self.mean_flip()));
        match &numbers.z {
            Some(z) => {
                line(
                    "mean z²",
                    format!("{} of {}", plain(z.mean_square), z.count),
                );
                line("|z| > 3", percent(z.beyond_three));
                line("largest |z|", worst(z));
            }
            None => line("z", "unknown: both images need variances".into()),
        }
        for note in self.notes() {
            line("note", note);
        }
        for (name, value, limit) in self.exceeded() {
            let which = if name == "PSNR" { "below" } else { "above" };
            line(
                "differs",
                format!("{name} {} is {which} {}", plain(value), plain(limit)),
            );
        }
        out
    }

    /// Returns notes on the validity of z and of the images.
    fn notes(&self) -> Vec<String> {
        let known = |name: &str| self.images.map(|image| image.attribute(name));
        let mut notes = Vec::new();
        for (image, path) in self
            .images
            .iter()
            .zip([&self.args.image, &self.args.reference])
        {
            if image.attribute(DENOISED).is_some() {
                notes.push(format!(
                    "{} is denoised, which adds an unknown bias: compare the image from before denoising",
                    file_name(path)
                ));
            }
        }
        if self.numbers.z.is_none() {
            return notes;
        }
        if let ([Some(a), Some(b)], [Some(i), Some(j)]) = (known("seed"), known("integrator"))
            && (a, i) == (b, j)
        {
            notes.push(format!(
                "both images have the seed {a}: if they share random numbers, z is too small; render one with another --seed"
            ));
        }
        let shared = |i: &&str| !["path", "aov"].contains(i);
        let shared = known("integrator").into_iter().flatten().find(shared);
        if let Some(integrator) = shared.filter(|_| self.args.block > 1) {
            notes.push(format!(
                "pixels by {integrator} share paths: z of blocks may be too large; use --block 1"
            ));
        }
        notes
    }

    /// Returns the comparison as JSON for programs.
    pub fn json(&self) -> Value {
        let numbers = self.numbers;
        let exceeded = self.exceeded();
        let exceeded: Vec<Value> = exceeded
            .iter()
            .map(|(name, value, limit)| json!({ "name": name, "value": value, "limit": limit }))
            .collect();
        json!({
            "image": file_name(&self.args.image),
            "reference": file_name(&self.args.reference),
            "means": numbers.means,
            "rmse": numbers.rmse,
            "relative_mse": numbers.relative_mse,
            "psnr": numbers.psnr,
            "largest": numbers.largest,
            "flip": self.mean_flip(),
            "z": numbers.z.as_ref().map(|z| json!({
                "block": self.args.block,
                "count": z.count,
                "mean_square": z.mean_square,
                "beyond_three": z.beyond_three,
                "limit": z.limit,
                "largest": z.worst.as_ref().map(|w| json!({
                    "z": w.z,
                    "channel": w.channel,
                    "pixel": w.pixel,
                })),
            })),
            "notes": self.notes(),
            "exceeded": exceeded,
        })
    }
}

fn worst(z: &ZScores) -> String {
    let Some(worst) = &z.worst else {
        return "none is known".into();
    };
    let [x, y] = worst.pixel;
    let (size, channel, limit) = (plain(worst.z.abs()), &worst.channel, plain(z.limit));
    format!("{size} in {channel} at {x},{y}; noise alone exceeds {limit} in 1 of 1000 comparisons")
}
