//! Spectrum files (`.spd`): a wavelength in nm and a value in each line. Lines that begin with `#`
//! are comments.

use std::path::Path;

use eikonal::Shown;

use crate::error::{FileError, Problem};
use crate::input;

/// Maximum size of a file, in bytes: ten thousand wavelengths take a hundredth of it.
const MAX_SIZE: usize = 16 << 20;

/// Pairs of wavelength in nm and value.
pub type Pairs = Vec<(f64, f64)>;

/// Reads a file: pairs of wavelength in nm and value, in increasing wavelength.
///
/// # Errors
///
/// A file that cannot be read, a line that is not two finite numbers, wavelengths that do not
/// increase, or fewer than two wavelengths.
pub fn read(path: &Path) -> Result<Pairs, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes).map_err(|(line, problem)| FileError {
        line,
        ..problem.at(path)
    })
}

/// Reads the bytes of a file.
///
/// # Errors
///
/// As for [`read`], with the line, from 1.
pub fn parse(bytes: &[u8]) -> Result<Pairs, (Option<usize>, Problem)> {
    if bytes.len() > MAX_SIZE {
        let message = format!("a spectrum of more than {MAX_SIZE} bytes");
        return Err((None, Problem::TooLarge(message)));
    }
    let text = String::from_utf8_lossy(bytes);
    let mut pairs = Pairs::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |message: String| (Some(i + 1), Problem::Malformed(message));
        let pair = pair(line)
            .ok_or_else(|| wrong("expected a wavelength in nm and a value".to_owned()))?;
        if let Some((previous, _)) = pairs.last().filter(|(w, _)| *w >= pair.0) {
            let [now, before] = [pair.0, *previous].map(Shown);
            return Err(wrong(format!(
                "wavelengths must increase: {now} after {before}"
            )));
        }
        pairs.push(pair);
    }
    if pairs.len() < 2 {
        let message = "a spectrum needs at least two wavelengths".to_owned();
        return Err((None, Problem::Malformed(message)));
    }
    Ok(pairs)
}

/// Returns the two numbers of a line; the rest of the line is a remark.
fn pair(line: &str) -> Option<(f64, f64)> {
    let mut words = line.split([' ', '\t', ',']).filter(|word| !word.is_empty());
    let mut number = || words.next()?.parse().ok().filter(|v: &f64| v.is_finite());
    let (wavelength, value) = (number()?, number()?);
    (wavelength > 0.0).then_some((wavelength, value))
}
