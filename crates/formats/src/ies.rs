//! Photometric files of the Illuminating Engineering Society, LM-63 (editions from 1986 to 2002).
//!
//! Supported is photometry of type C, with angles and intensities of one luminaire. Keywords are
//! ignored.

use std::path::Path;

use crate::error::{FileError, Problem};
use crate::input;

/// Maximum size of a file, in bytes: a direction in each square degree takes a tenth of it.
const MAX_SIZE: usize = 4 << 20;

/// Intensities over the directions around a luminaire.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// Vertical angles in degrees, ascending from 0, which is downwards.
    pub vertical: Vec<f64>,
    /// Horizontal angles in degrees: from 0 to 360, or only 0.
    pub horizontal: Vec<f64>,
    /// Intensities in candela: for each horizontal angle, one at each vertical angle.
    pub candela: Vec<f64>,
}

/// Reads a file.
///
/// # Errors
///
/// A file that cannot be read or is not an LM-63 file. Photometry of type A or B, or a tilt in
/// another file. Too few or inconsistent numbers.
pub fn read(path: &Path) -> Result<Photometry, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes).map_err(|problem| problem.at(path))
}

/// Reads the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8]) -> Result<Photometry, Problem> {
    if bytes.len() > MAX_SIZE {
        let message = format!("photometry of more than {MAX_SIZE} bytes");
        return Err(Problem::TooLarge(message));
    }
    // Decode leniently: names of manufacturers may have any encoding.
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines();
    let tilt = lines.find_map(|line| line.trim().strip_prefix("TILT="));
    let tilt = tilt.ok_or_else(|| malformed("there is no line TILT="))?;
    let rest = lines.flat_map(|line| line.split([' ', '\t', ',']));
    let mut numbers = Numbers(rest.filter(|word| !word.is_empty()));
    match tilt.trim() {
        "NONE" => {}
        "INCLUDE" => numbers.pass_tilt()?,
        file => {
            let message =
                format!("TILT={file}, a tilt in another file: include it, or use TILT=NONE");
            return Err(Problem::Unsupported(message));
        }
    }
    numbers.photometry(text.len())
}

fn malformed(message: impl Into<String>) -> Problem {
    Problem::Malformed(message.into())
}

/// Numbers after the header.
struct Numbers<I>(I);

impl<'t, I: Iterator<Item = &'t str>> Numbers<I> {
    fn next(&mut self, what: &str) -> Result<f64, Problem> {
        let word = self.0.next();
        let word = word.ok_or_else(|| malformed(format!("the file ends before {what}")))?;
        let value: Option<f64> = word.parse().ok();
        value
            .filter(|v| v.is_finite())
            .ok_or_else(|| malformed(format!("{what}: '{word}' is not a number")))
    }

    fn many(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Problem> {
        (0..count).map(|_| self.next(what)).collect()
    }

    /// Reads a count of at most `most`, the number of items for which the file has room.
    fn count(&mut self, most: usize, what: &str) -> Result<usize, Problem> {
        let value = self.next(what)?;
        let whole = value >= 1.0 && value <= most as f64 && value.fract() == 0.0;
        whole
            .then_some(value as usize)
            .ok_or_else(|| malformed(format!("{what}: {value}")))
    }

    /// Skips the dependence of the output on the tilt: the luminaire has the tilt of the
    /// measurement.
    fn pass_tilt(&mut self) -> Result<(), Problem> {
        self.next("the luminaire's geometry")?;
        let pairs = self.count(1000, "number of tilts")?;
        self.many(2 * pairs, "tilts").map(drop)
    }

    fn photometry(&mut self, size: usize) -> Result<Photometry, Problem> {
        self.many(2, "number and lumens of its sources")?;
        let multiplier = self.next("multiplier")?;
        let vertical = self.count(size, "number of vertical angles")?;
        let horizontal = self.count(size, "number of horizontal angles")?;
        if self.next("type of photometry")? != 1.0 {
            let message = "photometry of type A or B: convert it to type C";
            return Err(Problem::Unsupported(message.into()));
        }
        self.many(4, "unit and size of the luminaire")?;
        let factors = self.many(2, "ballast factors")?;
        self.next("watts")?;
        let vertical = self.many(vertical, "vertical angles")?;
        let horizontal = self.many(horizontal, "horizontal angles")?;
        let count = vertical.len().saturating_mul(horizontal.len());
        let factor = multiplier * factors[0] * factors[1];
        let mut candela = self.many(count, "candela")?;
        candela.iter_mut().for_each(|c| *c *= factor);
        whole_turn(vertical, horizontal, candela)
    }
}

/// Completes photometry to all horizontal angles. By symmetry, a file may have only 0°, a quarter,
/// a half or the full turn.
fn whole_turn(
    vertical: Vec<f64>,
    mut horizontal: Vec<f64>,
    mut candela: Vec<f64>,
) -> Result<Photometry, Problem> {
    let n = vertical.len();
    let (first, last) = (horizontal[0], horizontal[horizontal.len() - 1]);
    if horizontal.len() == 1 {
        horizontal = vec![0.0];
    } else if first == 90.0 && last == 270.0 {
        // Use the symmetry about the plane through 90° and 270°: 270° − a equals 270° + a, and 0°
        // equals 180°.
        return half_turn(&vertical, &horizontal, &candela);
    } else if first != 0.0 || ![90.0, 180.0, 360.0].contains(&last) {
        let message = format!("horizontal angles from {first} to {last}");
        return Err(Problem::Malformed(message));
    }
    while horizontal.len() > 1 && horizontal[horizontal.len() - 1] < 360.0 {
        // Mirror the angles at the last one.
        let end = horizontal[horizontal.len() - 1];
        for k in (0..horizontal.len() - 1).rev() {
            horizontal.push(2.0 * end - horizontal[k]);
            candela.extend_from_within(k * n..(k + 1) * n);
        }
    }
    Ok(Photometry {
        vertical,
        horizontal,
        candela,
    })
}

/// Completes photometry as [`whole_turn`], for horizontal angles from 90 to 270.
fn half_turn(vertical: &[f64], horizontal: &[f64], candela: &[f64]) -> Result<Photometry, Problem> {
    let n = vertical.len();
    let row = |k: usize| &candela[k * n..(k + 1) * n];
    let mut turned: Vec<(f64, &[f64])> = Vec::new();
    for (k, angle) in horizontal.iter().enumerate() {
        turned.push((*angle, row(k)));
        let mirrored = (540.0 - angle) % 360.0;
        if *angle != 90.0 && *angle != 270.0 {
            turned.push((mirrored, row(k)));
        }
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(0.0, south)) = turned.first() else {
        return Err(malformed("horizontal angles from 90 to 270 without 180"));
    };
    turned.push((360.0, south));
    Ok(Photometry {
        vertical: vertical.to_vec(),
        horizontal: turned.iter().map(|(angle, _)| *angle).collect(),
        candela: turned
            .iter()
            .flat_map(|(_, row)| row.iter().copied())
            .collect(),
    })
}
