//! Hair of Mitsuba 0.6: strands of points, as text or in binary.

use std::path::Path;

use glam::DVec3;

use super::curves::ControlPoint;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Beginning of binary files.
const MAGIC: &[u8] = b"BINARY_HAIR";
/// Maximum memory for a point while its piece of a tube is made, in bytes.
const BYTES_PER_POINT: u64 = 2_000;

/// Points of strands, strand after strand.
struct Strands {
    strands: Vec<Vec<DVec3>>,
    count: u64,
    most: u64,
}

/// Reads strands. Text files have a point in each line, x, y and z, and empty lines between
/// strands. Binary files have the header `BINARY_HAIR`, a number of points (32 bits), and the
/// points in single precision, little-endian. The number +∞ precedes the first point of a strand.
///
/// # Errors
///
/// A file that cannot be read, or has no strand of two points. A number of points that differs from
/// the header. Points that are not finite.
pub fn read(path: &Path, limits: Limits) -> Result<Vec<Vec<DVec3>>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, limits).map_err(|(problem, line)| FileError {
        path: path.to_owned(),
        line,
        problem,
    })
}

/// Reads strands from the bytes of a file. Errors have a line number if there is one.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8], limits: Limits) -> Result<Vec<Vec<DVec3>>, (Problem, Option<usize>)> {
    let mut strands = Strands {
        strands: Vec::new(),
        count: 0,
        most: limits.most(bytes.len() as u64) / BYTES_PER_POINT,
    };
    match bytes.strip_prefix(MAGIC) {
        Some(rest) => binary(rest, &mut strands).map_err(|problem| (problem, None))?,
        None => text(bytes, &mut strands)?,
    }
    strands.strands.retain(|strand| strand.len() > 1);
    if strands.strands.is_empty() {
        return Err((Problem::Malformed("no strand of two points".into()), None));
    }
    Ok(strands.strands)
}

/// Makes curves of strands, with a constant radius.
pub fn with_radius(strands: Vec<Vec<DVec3>>, radius: f64) -> Vec<Vec<ControlPoint>> {
    let point = |position| ControlPoint { position, radius };
    let curves = strands.into_iter();
    curves
        .map(|strand| strand.into_iter().map(point).collect())
        .collect()
}

impl Strands {
    fn begin(&mut self) {
        self.strands.push(Vec::new());
    }

    /// Adds a point to the last strand, unless it equals the previous point.
    fn add(&mut self, point: DVec3) -> Result<(), Problem> {
        if !point.is_finite() {
            return Err(Problem::Malformed("a point is not finite".into()));
        }
        self.count += 1;
        if self.count > self.most {
            let message = format!("more than {} points of hair", self.most);
            return Err(Problem::Unsupported(message));
        }
        if let Some(strand) = self.strands.last_mut()
            && strand.last() != Some(&point)
        {
            strand.push(point);
        }
        Ok(())
    }
}

fn text(bytes: &[u8], strands: &mut Strands) -> Result<(), (Problem, Option<usize>)> {
    let text = String::from_utf8_lossy(bytes);
    let mut is_new = true;
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            is_new = true;
            continue;
        }
        if std::mem::take(&mut is_new) {
            strands.begin();
        }
        let mut words = line.split_whitespace();
        let numbers = [(); 3].map(|()| words.next().and_then(|word| word.parse::<f64>().ok()));
        let [Some(x), Some(y), Some(z)] = numbers else {
            let problem = Problem::Malformed("expected x, y and z".into());
            return Err((problem, Some(index + 1)));
        };
        let added = strands.add(DVec3::new(x, y, z));
        added.map_err(|problem| (problem, Some(index + 1)))?;
    }
    Ok(())
}

fn binary(bytes: &[u8], strands: &mut Strands) -> Result<(), Problem> {
    let words = bytes.chunks_exact(4);
    let mut words = words.map(|word| <[u8; 4]>::try_from(word).unwrap_or_default());
    let count = words.next().map_or(0, u32::from_le_bytes);
    let mut numbers = words.map(f32::from_le_bytes);
    let truncated = || Problem::Truncated {
        expected: (MAGIC.len() + 4) as u64 + 12 * u64::from(count),
        found: (MAGIC.len() + bytes.len()) as u64,
    };
    strands.begin();
    for _ in 0..count {
        let mut first = numbers.next().ok_or_else(truncated)?;
        if first == f32::INFINITY {
            strands.begin();
            first = numbers.next().ok_or_else(truncated)?;
        }
        let [y, z] = [numbers.next(), numbers.next()];
        let (y, z) = (y.ok_or_else(truncated)?, z.ok_or_else(truncated)?);
        strands.add(DVec3::new(first.into(), y.into(), z.into()))?;
    }
    match numbers.next() {
        None => Ok(()),
        Some(_) => Err(Problem::Malformed(format!(
            "more than the {count} points that it says"
        ))),
    }
}
