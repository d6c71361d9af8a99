//! Ending a render when its measured error is small enough.
//!
//! The error is looked at after fixed numbers of samples, whatever the passes and threads, so that a render
//! that stops is a render of just that many samples. Errors are measured, and may be too small by chance: the
//! first look is not early, two in a row must agree, and an error that [cannot be trusted](Film::few_in_all) is none. What is left is a small bias of the mean, for
//! renders stop a little too soon when bright samples happen to be missing (docs/theory.md#stopping).

use super::Debiased;
use crate::film::Film;
use serde::{Deserialize, Serialize};

/// Samples per pixel before the first look.
const FIRST: u64 = 32;
/// Factor between looks.
const GROWTH: f64 = 1.25;
/// So many looks in a row must find the error small enough.
const AGREEING: u32 = 2;

/// What is to become how exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// The error, > 0, relative to the mean of the image.
    pub error: f64,
    /// What it is the error of.
    pub measure: Measure,
}

/// What an error is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    /// The mean over the image and its channels: its standard error ([`Film::summary`]), and the size of its
    /// bias ([`Debiased::error`]).
    #[default]
    Image,
    /// Single pixels: the root of the mean square of their errors ([`Film::rms_error`],
    /// [`Debiased::rms_error`]).
    Pixel,
}

impl Measure {
    /// Names, as command lines use them, in the order of the variants.
    pub const NAMES: [&'static str; 2] = ["image", "pixel"];

    /// Name, as in [`Measure::NAMES`].
    pub fn name(self) -> &'static str {
        Measure::NAMES[self as usize]
    }

    /// The error of a film relative to its mean, with that by bias if there is any: infinite as long as it is
    /// not known.
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

/// Looks at the error from time to time.
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
            next: FIRST,
            met: 0,
        }
    }

    /// Samples per pixel before the next look.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// What is wanted.
    pub(super) fn target(&self) -> Target {
        self.target
    }

    /// Looks after `done` samples per pixel, if it is time to.
    pub(super) fn look(&mut self, done: u64, film: &Film, debiased: Option<&Debiased>) {
        if done < self.next {
            return;
        }
        self.next = (done as f64 * GROWTH).ceil() as u64;
        let error = self.target.measure.error(film, debiased);
        let is_met = error <= self.target.error && !film.few_in_all(None);
        self.met = if is_met { self.met + 1 } else { 0 };
    }

    /// Whether to stop.
    pub(super) fn is_over(&self) -> bool {
        self.met >= AGREEING
    }
}
