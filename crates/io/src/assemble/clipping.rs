//! Values outside their limits. Values within rounding of a limit are clipped, with a note.

use super::texture_role::{RequestedValues, Role};
use crate::diagnostic::{Diagnostic, lints};
use crate::volume::place;
use eikonal::Shown;
use transport::Spectrum;
use transport::volume::GridSamples;

/// Distance beyond a limit within which a number counts as rounded: a few units in the last place
/// of single precision. It is relative to the largest allowed value, or to the largest value if
/// there is no upper limit.
pub(super) const ROUNDING: f64 = 1e-6;
/// Largest error of an image's values caused by half precision or lossy compression, relative to
/// the image's largest value. Negative values of this size count as rounded zeros. They may remove
/// at most this fraction of the image's light.
const MAX_NEGATIVE: f64 = 1e-4;
/// Maximum fraction of the light of an image that its negative values may remove.
const MAX_LOST: f64 = 0.1;

/// Clips values of a reflectance that rounding puts outside [0, 1]. Returns a note if there are
/// any.
pub(super) fn reflectance(value: &mut Spectrum) -> Option<Diagnostic> {
    let mut note = None;
    for v in &mut value.0 {
        let limit = v.clamp(0.0, 1.0);
        if *v != limit && (*v - limit).abs() <= ROUNDING {
            let message = format!("{} is clipped to {limit}: rounding", Shown(*v));
            note = Some(lints::note(lints::CLIPPED_VALUES, message));
            *v = limit;
        }
    }
    note
}

/// Returns a value of an image for a role: negative values become 0, and for roles limited to 1,
/// values that rounding puts above 1 become 1.
pub(super) fn without_rounding(value: f64, role: Role) -> f64 {
    let most = matches!(role, Role::Reflectance | Role::Number);
    if most && value > 1.0 && value <= 1.0 + ROUNDING {
        1.0
    } else {
        value.max(0.0)
    }
}

/// Statistics of the values of an image that are outside their limits.
pub(super) struct Pixels {
    count: usize,
    /// Number of pixels with a negative value.
    negative: usize,
    /// Least value, at most 0.
    least: f64,
    /// Weighted sum of the magnitudes of the negative values.
    lost: f64,
    /// Number of pixels with a value above 1.
    above: usize,
    /// Largest value, at least 0.
    largest: f64,
    /// Weighted sum of the positive values.
    light: f64,
}

impl Pixels {
    pub(super) fn new() -> Self {
        Pixels {
            count: 0,
            negative: 0,
            least: 0.0,
            lost: 0.0,
            above: 0,
            largest: 0.0,
            light: 0.0,
        }
    }

    /// Adds the values of a pixel. Its light counts with `weight`.
    pub(super) fn see(&mut self, values: impl Iterator<Item = f64>, weight: f64) {
        let (mut least, mut largest) = (0.0_f64, 0.0_f64);
        for v in values {
            (least, largest) = (least.min(v), largest.max(v));
            self.lost += (-v).max(0.0) * weight;
            self.light += v.max(0.0) * weight;
        }
        self.count += 1;
        self.negative += usize::from(least < 0.0);
        self.above += usize::from(largest > 1.0);
        self.least = self.least.min(least);
        self.largest = self.largest.max(largest);
    }

    /// Returns true if no value is positive.
    pub(super) fn are_black(&self) -> bool {
        self.light == 0.0
    }

    /// Checks the image called `name`. Returns a note or a warning if its values must be clipped by
    /// [`without_rounding`], and `None` if there is nothing to clip.
    ///
    /// # Errors
    ///
    /// Values farther beyond the limits of the role than rounding explains. Images of light may
    /// have some negative values.
    pub(super) fn verdict(
        &self,
        name: &str,
        RequestedValues { role, factor }: RequestedValues,
    ) -> Result<Option<Diagnostic>, Diagnostic> {
        if matches!(role, Role::Vector | Role::Height) {
            return Ok(None);
        }
        if role == Role::Reflectance && self.largest * factor.min(1.0) > 1.0 + ROUNDING {
            let message = format!(
                "{name}: {} of {} pixels exceed 1, up to {}; a fraction of light must lie in [0, 1]",
                self.above,
                self.count,
                Shown::rounded(self.largest)
            );
            let help = format!(
                "nest it in a texture 'scale' with a scale of at most {}",
                Shown::rounded(1.0 / self.largest)
            );
            return Err(Diagnostic::error(message).help(help));
        }
        if self.negative > 0 {
            return self.verdict_on_negative(name, role).map(Some);
        }
        let is_rounded = role == Role::Reflectance || role == Role::Number;
        let above = is_rounded && self.above > 0 && self.largest <= 1.0 + ROUNDING;
        Ok(above.then(|| {
            lints::note(
                lints::CLIPPED_VALUES,
                format!(
                    "{name}: {} of {} pixels exceed 1, up to {}: rounding, clipped to 1",
                    self.above,
                    self.count,
                    Shown(self.largest)
                ),
            )
        }))
    }

    /// Checks an image with negative values. Returns the note or warning with which they are
    /// clipped to 0, or an error.
    fn verdict_on_negative(&self, name: &str, role: Role) -> Result<Diagnostic, Diagnostic> {
        let found = format!(
            "{name}: {} of {} pixels are negative, down to {}",
            self.negative,
            self.count,
            Shown::rounded(self.least)
        );
        let share = self.lost / self.light;
        if self.least >= -MAX_NEGATIVE * self.largest && share <= MAX_NEGATIVE {
            return Ok(lints::note(
                lints::CLIPPED_VALUES,
                format!("{found}: rounding, clipped to 0"),
            ));
        }
        if role == Role::Emission && share <= MAX_LOST {
            let percent = Shown(
                format!("{:.1e}", 100.0 * share)
                    .parse()
                    .unwrap_or(100.0 * share),
            );
            let message = format!("{found}: clipped to 0, which adds {percent} % to its light");
            let help = "the filters 'lanczos', 'mitchell' and 'catmullrom' make negative pixels: render the image with 'gaussian'";
            return Ok(lints::warning(lints::CLIPPED_VALUES, message).help(help.to_owned()));
        }
        let help = match role {
            Role::Emission => {
                "at most a tenth of an image's light may be negative: an image of differences or logarithms is not light"
            }
            _ => "clip the values in the file at 0",
        };
        Err(Diagnostic::error(found).help(help.to_owned()))
    }
}

/// Clips samples of a grid that rounding puts outside the two `allowed` values. Returns a note if
/// there are any.
///
/// # Errors
///
/// Samples farther outside; the message names the grid.
pub(super) fn samples(
    samples: &mut GridSamples,
    name: &str,
    [low, high]: [f64; 2],
) -> Result<Option<Diagnostic>, Diagnostic> {
    let is_outside = |v: &f32| !(low..=high).contains(&f64::from(*v));
    let (size, channels) = (samples.size, samples.channels);
    let data = &mut samples.data;
    let Some(first) = data.iter().position(is_outside) else {
        return Ok(None);
    };
    let count = data.iter().filter(|v| is_outside(v)).count();
    let wide = || data.iter().copied().map(f64::from);
    let (least, most) = wide().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
    let found = format!(
        "{name}: {count} of {} samples are outside of {}: {} is {}, and all lie in [{}, {}]",
        data.len(),
        range(low, high),
        place(size, channels, first),
        Shown(f64::from(data[first])),
        Shown(least),
        Shown(most)
    );
    let scale = if high < f64::MAX {
        low.abs().max(high.abs())
    } else {
        most
    };
    let rounding = ROUNDING * scale;
    if !(least >= low - rounding && most <= high + rounding) {
        let help = "change them in the file, or by 'scale' and 'offset' of the volume".to_owned();
        return Err(Diagnostic::error(found).help(help));
    }
    for v in data.iter_mut() {
        *v = v.clamp(low as f32, high as f32);
    }
    Ok(Some(lints::note(
        lints::CLIPPED_VALUES,
        format!("{found}: rounding, clipped"),
    )))
}

/// Formats the allowed range of values.
fn range(low: f64, high: f64) -> String {
    if high < f64::MAX {
        format!("[{low}, {high}]")
    } else {
        format!("[{low}, ∞)")
    }
}
