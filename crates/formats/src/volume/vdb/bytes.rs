//! Reader of little-endian numbers and texts.

use crate::error::Problem;

/// Remaining bytes of a file.
#[derive(Clone)]
pub(super) struct Bytes<'a> {
    left: &'a [u8],
}

/// Error for a file that ends early.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Cut;

impl From<Cut> for Problem {
    fn from(_: Cut) -> Self {
        Problem::Malformed("the file ends early, or its sizes make no sense".into())
    }
}

impl<'a> Bytes<'a> {
    pub(super) fn new(left: &'a [u8]) -> Self {
        Bytes { left }
    }

    /// Returns the number of remaining bytes.
    pub(super) fn len(&self) -> usize {
        self.left.len()
    }

    pub(super) fn take(&mut self, size: usize) -> Result<&'a [u8], Cut> {
        let (taken, left) = self.left.split_at_checked(size).ok_or(Cut)?;
        self.left = left;
        Ok(taken)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Cut> {
        let (taken, left) = self.left.split_first_chunk().ok_or(Cut)?;
        self.left = left;
        Ok(*taken)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Cut> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32, Cut> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(super) fn i64(&mut self) -> Result<i64, Cut> {
        Ok(i64::from_le_bytes(self.array()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64, Cut> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// Reads a length of 32 bits, and as many bytes.
    pub(crate) fn sized(&mut self) -> Result<&'a [u8], Cut> {
        let size = self.u32()?;
        self.take(size as usize)
    }

    pub(super) fn text(&mut self) -> Result<String, Cut> {
        Ok(String::from_utf8_lossy(self.sized()?).into_owned())
    }
}
