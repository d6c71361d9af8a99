//! Comparison of two images.
//!
//! All numbers refer to linear values, over all pixels and channels of the main layers. The second
//! image is the reference.

pub mod flip;
mod zscores;

pub use zscores::{Worst, ZScores};

use crate::error::Problem;
use crate::image::{ImageLayers, Layer};

/// Fraction of the reference's mean that is added to its values, so that errors in dark regions
/// stay finite.
const OFFSET_FRACTION: f64 = 0.05;

/// Differences of two images.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Means over pixels and channels of the image and of the reference.
    pub means: [f64; 2],
    /// Root mean square difference.
    pub rmse: f64,
    /// Mean squared difference, each divided by the square of |b| + 0.05 times the mean of |b|,
    /// where b is the reference's value. NaN if the reference is black and the image is not.
    pub relative_mse: f64,
    /// Peak signal-to-noise ratio in decibels, 10 log₁₀ of the square of the reference's largest
    /// value divided by the mean squared difference; infinite for equal images.
    pub psnr: f64,
    /// Largest absolute difference.
    pub largest: f64,
    /// Differences divided by their standard errors, if both images have variances.
    pub z: Option<ZScores>,
}

/// Compares the main layers of an image and a reference. Their channels must have the same names;
/// an alpha channel of only one of them is ignored. Layers `variance` give the variances of values.
/// z refers to means over blocks of `block` × `block` pixels.
///
/// # Errors
///
/// Different sizes or channels, and values that are not finite.
///
/// # Panics
///
/// If `block` is zero.
pub fn compare(
    image: &ImageLayers,
    reference: &ImageLayers,
    block: usize,
) -> Result<Comparison, Problem> {
    let pairs = pairs(image, reference)?;
    let values = || pairs.iter().flat_map(|p| p.a.iter().zip(p.b));
    let values = || values().map(|(a, b)| (f64::from(*a), f64::from(*b)));
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        let sum: f64 = values().map(|(a, b)| f(a, b)).sum();
        sum / (pairs.len() * image.width * image.height) as f64
    };
    let mse = mean(&|a, b| (a - b).powi(2));
    let dark = OFFSET_FRACTION * mean(&|_, b| b.abs());
    let relative = |a: f64, b: f64| {
        if a == b {
            0.0
        } else {
            ((a - b) / (b.abs() + dark)).powi(2)
        }
    };
    let peak = values().fold(0.0f64, |peak, (_, b)| peak.max(b));
    Ok(Comparison {
        means: [mean(&|a, _| a), mean(&|_, b| b)],
        rmse: mse.sqrt(),
        relative_mse: mean(&relative),
        psnr: match mse {
            0.0 => f64::INFINITY,
            mse => 10.0 * (peak * peak / mse).log10(),
        },
        largest: values().fold(0.0, |most, (a, b)| (a - b).abs().max(most)),
        z: ZScores::of(&pairs, [image.width, image.height], block),
    })
}

/// Channel of two images.
struct Pair<'a> {
    name: &'a str,
    a: &'a [f32],
    b: &'a [f32],
    /// Variances of both images.
    variances: Option<[&'a [f32]; 2]>,
}

fn pairs<'a>(a: &'a ImageLayers, b: &'a ImageLayers) -> Result<Vec<Pair<'a>>, Problem> {
    let size = |image: &ImageLayers| format!("{} x {} pixels", image.width, image.height);
    if (a.width, a.height) != (b.width, b.height) {
        return Err(Problem::Mismatch {
            expected: format!("{} as the other image has", size(a)),
            found: size(b),
        });
    }
    let (main, other) = (main(a)?, main(b)?);
    let mut names = [names(main), names(other)];
    if names[0].contains(&"A") != names[1].contains(&"A") {
        names.iter_mut().for_each(|n| n.retain(|name| *name != "A"));
    }
    if names[0] != names[1] || names[0].is_empty() {
        let list = |names: &[&str]| format!("channels {}", names.join(", "));
        return Err(Problem::Mismatch {
            expected: format!("{} as the other image has", list(&names[0])),
            found: list(&names[1]),
        });
    }
    let variance = |image: &'a ImageLayers, name: &str| image.layer("variance")?.channel(name);
    let pair = |name: &'a str| {
        let variances = variance(a, name).zip(variance(b, name));
        Ok(Pair {
            name,
            a: finite(a, main, name)?,
            b: finite(b, other, name)?,
            variances: variances.map(|(a, b)| [a, b]),
        })
    };
    names[0].iter().copied().map(pair).collect()
}

fn main(image: &ImageLayers) -> Result<&Layer, Problem> {
    let none = || Problem::Empty("the image has no main layer".into());
    image.layer("").ok_or_else(none)
}

/// Returns the names of channels, sorted.
fn names(layer: &Layer) -> Vec<&str> {
    let mut names: Vec<&str> = layer.channels.iter().map(|(n, _)| n.as_str()).collect();
    names.sort_unstable();
    names
}

fn finite<'a>(image: &ImageLayers, layer: &'a Layer, name: &str) -> Result<&'a [f32], Problem> {
    let values = layer.channel(name).unwrap_or_default();
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(values),
        Some(i) => Err(Problem::NotFinite {
            place: format!(
                "pixel ({}, {}) of channel {name}",
                i % image.width,
                i / image.width
            ),
            value: values[i].into(),
        }),
    }
}
