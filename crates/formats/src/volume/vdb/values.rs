//! Values of a node. A file may store only some of them, in compressed form.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::ZlibDecoder;

use super::blosc;
use super::bytes::{Bytes, Cut};
use super::grid::Descriptor;
use super::tree::is_on;
use crate::element::{Element, Encoding};
use crate::error::Problem;

const ZIP: u32 = 1;
const ACTIVE_MASK: u32 = 2;
const BLOSC: u32 = 4;

/// Encoding of stored values.
pub(super) struct Coding<'a> {
    grid: &'a Descriptor,
    compression: u32,
}

impl<'a> Coding<'a> {
    /// Number of voxels of a leaf.
    pub(super) const LEAF: usize = 512;

    pub(super) fn new(grid: &'a Descriptor, compression: u32) -> Result<Self, Problem> {
        match compression & !(ZIP | ACTIVE_MASK | BLOSC) {
            0 => Ok(Coding { grid, compression }),
            _ => Err(Problem::Unsupported(format!(
                "an OpenVDB grid with compression {compression:#x}"
            ))),
        }
    }

    /// Reads a single number, never in half precision.
    pub(super) fn number(&self, cursor: &mut Bytes) -> Result<f64, Cut> {
        match self.grid.tree {
            Element::F64 => cursor.f64(),
            _ => Ok(f64::from(f32::from_le_bytes(cursor.array()?))),
        }
    }

    /// Reads the `count` values of a node. If inactive voxels have only one or two different
    /// values, a selection distinguishes them, and only the values of active voxels are stored.
    pub(super) fn values(
        &self,
        cursor: &mut Bytes,
        count: usize,
        active: &[u8],
        background: f64,
    ) -> Result<Vec<f64>, Problem> {
        let [kind] = cursor.array()?;
        let (mut first, mut second) = (background, background);
        match kind {
            0 | 6 => {}
            1 | 3 => first = -background,
            2 | 4 => first = self.number(cursor)?,
            5 => (first, second) = (self.number(cursor)?, self.number(cursor)?),
            other => return Err(Problem::Malformed(format!("a node of kind {other}"))),
        }
        let selection: &[u8] = match kind {
            3..=5 => cursor.take(count / 8)?,
            _ => &[],
        };
        if self.compression & ACTIVE_MASK == 0 || kind == 6 {
            return self.numbers(cursor, count);
        }
        let stored = (0..count).filter(|i| is_on(active, *i)).count();
        let mut stored = self.numbers(cursor, stored)?.into_iter();
        let value = |i: usize| {
            if is_on(active, i) {
                stored.next().unwrap_or(background)
            } else if !selection.is_empty() && is_on(selection, i) {
                second
            } else {
                first
            }
        };
        Ok((0..count).map(value).collect())
    }

    fn numbers(&self, cursor: &mut Bytes, count: usize) -> Result<Vec<f64>, Problem> {
        let element = self.grid.element;
        // Return early: nothing is stored for zero numbers in half precision.
        if count == 0 && element == Element::F16 {
            return Ok(Vec::new());
        }
        let size = count * element.size();
        let bytes = match self.compression & (ZIP | BLOSC) {
            0 => cursor.take(size)?.into(),
            _ => self.unpack(cursor, size)?,
        };
        let mut numbers = Vec::with_capacity(count);
        let sink = |v| numbers.push(v);
        Encoding::little(element)
            .read(&mut &bytes[..], count, sink)
            .map_err(|_| Cut)?;
        Ok(numbers)
    }

    /// Reads bytes. They are compressed, unless a negative size indicates that compression was not
    /// worthwhile.
    fn unpack<'b>(&self, cursor: &mut Bytes<'b>, size: usize) -> Result<Cow<'b, [u8]>, Problem> {
        let packed = cursor.i64()?;
        let length = usize::try_from(packed.unsigned_abs()).map_err(|_| Cut)?;
        let bytes = cursor.take(length)?;
        if packed <= 0 {
            return Ok(bytes.into());
        }
        if self.compression & BLOSC != 0 {
            return Ok(blosc::unpack(bytes, size)?.into());
        }
        let mut unpacked = Vec::new();
        let inflated = ZlibDecoder::new(bytes)
            .take(size as u64)
            .read_to_end(&mut unpacked);
        let damaged = |e| Problem::Malformed(format!("its compressed data are damaged: {e}"));
        inflated.map_err(damaged)?;
        Ok(unpacked.into())
    }
}
