//! End of a render at a target error.
//!
//! The error is examined after fixed numbers of samples, independent of passes and threads. A
//! render that stops therefore equals a render of that number of samples. Random fluctuations may
//! make measured errors too small. Therefore the first examination is not early, two consecutive
//! examinations must agree, and [unreliable](Film::few_in_all) errors are ignored. A small bias of
//! the mean remains: renders stop slightly too early when bright samples happen to be missing
//! (docs/theory.md#stopping).

use super::Debiased;
use crate::film::Film;
use serde::{Deserialize, Serialize};

/// Samples per pixel before the first examination of the error.
const FIRST_EXAMINATION: u64 = 32;
/// Factor between the sample numbers of consecutive examinations.
const GROWTH: f64 = 1.25;
/// Number of consecutive examinations with an error below the target that end the render.
const AGREEING_EXAMINATIONS: u32 = 2;

/// Target error of a render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Error, > 0, relative to the mean of the image.
    pub error: f64,
    /// Quantity whose error is measured.
    pub measure: Measure,
}

/// Quantity whose error is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    /// Mean over the image and its channels. The error is its standard error ([`Film::summary`]),
    /// together with the magnitude of its bias if it has any ([`Debiased::error`]).
    #[default]
    Image,
    /// Single pixels. The error is the root mean square of their errors ([`Film::rms_error`],
    /// [`Debiased::rms_error`]).
    Pixel,
}

impl Measure {
    /// Names for command lines, in the order of the variants.
    pub const NAMES: [&'static str; 2] = ["image", "pixel"];

    /// Returns the name, one of [`Measure::NAMES`].
    pub fn name(self) -> &'static str {
        Measure::NAMES[self as usize]
    }

    /// Returns the error of a film relative to its mean, including the bias if there is any;
    /// infinite as long as it is unknown.
    pub fn error(self, film: &Film, debiased: Option<&Debiased>) -> f64 {
        let (mean, error) = film.summary();
        let error = match (self, debiased) {
            (Measure::Image, None) => error,
            (Measure::Pixel, None) => film.rms_error(),
            (Measure::Image, Some(debiased)) => debiased.error(film),
            (Measure::Pixel, Some(debiased)) => debiased.rms_error(film),
        };
        match error / mean {
            relative if relative.is_finite() => relative,
            _ => f64::INFINITY,
        }
    }
}

/// Examines the error after certain numbers of samples.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Watch {
    target: Target,
    next: u64,
    met: u32,
}

impl Watch {
    pub(super) fn new(target: Target) -> Self {
        Watch {
            target,
            next: FIRST_EXAMINATION,
            met: 0,
        }
    }

    /// Returns the samples per pixel at the next examination.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// Returns the target of the render.
    pub(super) fn target(&self) -> Target {
        self.target
    }

    /// Examines the error after `done` samples per pixel, if it is due.
    pub(super) fn look(&mut self, done: u64, film: &Film, debiased: Option<&Debiased>) {
        if done < self.next {
            return;
        }
        self.next = (done as f64 * GROWTH).ceil() as u64;
        let error = self.target.measure.error(film, debiased);
        let is_met = error <= self.target.error && !film.few_in_all(None);
        self.met = if is_met { self.met + 1 } else { 0 };
    }

    /// Returns true if the render should stop.
    pub(super) fn is_over(&self) -> bool {
        self.met >= AGREEING_EXAMINATIONS
    }
}
