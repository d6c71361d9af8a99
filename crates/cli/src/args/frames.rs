//! Frame numbers of a sequence.

use std::str::FromStr;

/// Largest number of frames of a sequence.
const MAX_FRAMES: u64 = 1_000_000;

/// Placeholder for the frame number in names and values.
pub const PLACEHOLDER: &str = "{frame}";

/// Frame numbers from `first` to `last` in steps of `step`, as texts of at least `digits` digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    first: u64,
    last: u64,
    step: u64,
    digits: usize,
}

impl Frames {
    /// Returns the frame numbers as texts for names.
    pub fn numbers(self) -> impl Iterator<Item = String> {
        let numbers = (self.first..=self.last).step_by(self.step as usize);
        numbers.map(move |number| format!("{number:0digits$}", digits = self.digits))
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            "expected FIRST..LAST or FIRST..LAST:STEP, for example 0..47 or 000..240:10".to_owned()
        };
        let (range, step) = text.split_once(':').unwrap_or((text, "1"));
        let (first, last) = range.split_once("..").ok_or_else(wrong)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| wrong());
        let frames = Frames {
            first: number(first)?,
            last: number(last)?,
            step: number(step)?,
            digits: first.len(),
        };
        if frames.step == 0 || frames.last < frames.first {
            return Err(wrong());
        }
        if (frames.last - frames.first) / frames.step >= MAX_FRAMES {
            return Err(format!(
                "the sequence has too many frames: give at most {MAX_FRAMES}"
            ));
        }
        Ok(frames)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_the_first() {
        let numbers = |text: &str| {
            text.parse::<Frames>()
                .unwrap()
                .numbers()
                .collect::<Vec<_>>()
        };
        assert_eq!(numbers("8..11"), ["8", "9", "10", "11"]);
        assert_eq!(numbers("007..12:2"), ["007", "009", "011"]);
        assert_eq!(numbers("3..3"), ["3"]);
        for wrong in ["3", "3..", "5..4", "0..9:0", "-1..3", "0..99999999", "a..b"] {
            assert!(wrong.parse::<Frames>().is_err(), "{wrong}");
        }
    }
}
