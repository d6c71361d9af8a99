//! Values that lie outside of what they may be: those within rounding are clipped, with a note.

use super::texture_role::{Asked, Role};
use crate::diagnostic::{Diagnostic, lints};
use crate::volume::place;
use eikonal::Shown;
use transport::Spectrum;
use transport::volume::GridSamples;

/// How far a number may lie beyond a limit and count as rounded, as a share of the largest that is allowed, or that there is: some
/// units in the last place of single precision.
pub(super) const ROUNDING: f64 = 1e-6;
/// How far below 0 values of an image may lie and count as rounded, as a share of its largest value, and how much of its light they
/// may take away: what half precision and lossy compression leave.
const NEGATIVE: f64 = 1e-4;
/// How much of the light of an image its negative values may take away.
const MOST_LOST: f64 = 0.1;

/// Clips those values of a reflectance that are outside of [0, 1] by rounding; a note if there are any.
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

/// A value of an image for this role: not negative, and without what rounding adds to 1 where that is the most.
pub(super) fn without_rounding(value: f64, role: Role) -> f64 {
    let most = matches!(role, Role::Reflectance | Role::Number);
    if most && value > 1.0 && value <= 1.0 + ROUNDING {
        1.0
    } else {
        value.max(0.0)
    }
}

/// What is outside of its limits among the pixels of an image.
pub(super) struct Pixels {
    count: usize,
    /// Pixels with a negative value, the least value, and their sum.
    negative: usize,
    least: f64,
    lost: f64,
    /// Pixels with a value above 1, and the largest value.
    above: usize,
    largest: f64,
    /// The sum of the positive values.
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

    /// Takes the values of a pixel into account, whose light has a weight.
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

    /// Whether no value is positive.
    pub(super) fn are_black(&self) -> bool {
        self.light == 0.0
    }

    /// What to say of an image, by its name, whose values are then to be clipped ([`without_rounding`]); `None` if there is nothing
    /// to clip.
    ///
    /// # Errors
    ///
    /// Values that are farther beyond the limits of the role than rounding explains; light may be negative in places.
    pub(super) fn verdict(
        &self,
        name: &str,
        Asked { role, factor }: Asked,
    ) -> Result<Option<Diagnostic>, Diagnostic> {
        if matches!(role, Role::Vector | Role::Height) {
            return Ok(None);
        }
        if role == Role::Reflectance && self.largest * factor.min(1.0) > 1.0 + ROUNDING {
            let message = format!(
                "{name}: {} of {} pixels exceed 1, up to {}; a share of light lies in [0, 1]",
                self.above,
                self.count,
                Shown::rounded(self.largest)
            );
            let help = format!(
                "put it into a texture 'scale' of {} or less",
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

    fn verdict_on_negative(&self, name: &str, role: Role) -> Result<Diagnostic, Diagnostic> {
        let found = format!(
            "{name}: {} of {} pixels are negative, down to {}",
            self.negative,
            self.count,
            Shown::rounded(self.least)
        );
        let share = self.lost / self.light;
        if self.least >= -NEGATIVE * self.largest && share <= NEGATIVE {
            return Ok(lints::note(
                lints::CLIPPED_VALUES,
                format!("{found}: rounding, clipped to 0"),
            ));
        }
        if role == Role::Emission && share <= MOST_LOST {
            let percent = Shown(
                format!("{:.1e}", 100.0 * share)
                    .parse()
                    .unwrap_or(100.0 * share),
            );
            let message = format!("{found}: clipped to 0, which adds {percent} % to its light");
            let help = "pictures by the filters 'lanczos', 'mitchell' and 'catmullrom' have such pixels, those by \
                        'gaussian' have none";
            return Ok(lints::warning(lints::CLIPPED_VALUES, message).help(help.to_owned()));
        }
        let help = match role {
            Role::Emission => {
                "less than a tenth of an image's light may be negative: is it one of differences, or of logarithms?"
            }
            _ => "clip the values in the file at 0",
        };
        Err(Diagnostic::error(found).help(help.to_owned()))
    }
}

/// The samples of a grid with what rounding puts outside of the two `allowed` values clipped, and what to say of it.
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

fn range(low: f64, high: f64) -> String {
    if high < f64::MAX {
        format!("[{low}, {high}]")
    } else {
        format!("[{low}, ∞)")
    }
}
