//! Reading numbers from files without trusting the sizes they claim.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::error::{FileError, Problem};

/// Values converted at a time.
const BLOCK: usize = 8192;

/// Opens a file; also returns its size in bytes.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64), FileError> {
    let open = || {
        let file = File::open(path)?;
        let size = file.metadata()?.len();
        Ok((BufReader::new(file), size))
    };
    open().map_err(|e| Problem::Read(e).at(path))
}

/// The number of elements of an array, whose bytes after a header of `header` bytes must be what a
/// file of `size` bytes holds.
pub(crate) fn checked_count(
    shape: &[usize],
    element_size: usize,
    header: u64,
    size: u64,
) -> Result<usize, Problem> {
    let count = shape
        .iter()
        .try_fold(1usize, |product, &n| product.checked_mul(n));
    let bytes = count.and_then(|n| n.checked_mul(element_size));
    let expected = bytes.and_then(|n| header.checked_add(n as u64));
    let (Some(count), Some(expected)) = (count, expected) else {
        return Err(Problem::TooLarge(format!("an array of {}", product(shape))));
    };
    if size < expected {
        return Err(Problem::Truncated {
            expected,
            found: size,
        });
    }
    if size > expected {
        return Err(Problem::TrailingBytes {
            extra: size - expected,
        });
    }
    Ok(count)
}

/// Sizes as `2 x 3 x 4`.
pub(crate) fn product(shape: &[usize]) -> String {
    shape
        .iter()
        .map(usize::to_string)
        .collect::<Vec<_>>()
        .join(" x ")
}

/// Reads `count` numbers of `N` bytes each. The caller has checked that they can be there.
pub(crate) fn values<T, const N: usize>(
    reader: &mut impl Read,
    count: usize,
    convert: impl Fn([u8; N]) -> T,
) -> io::Result<Vec<T>> {
    let mut values = Vec::with_capacity(count);
    let mut buffer = vec![0; BLOCK.min(count) * N];
    while values.len() < count {
        let block = &mut buffer[..BLOCK.min(count - values.len()) * N];
        reader.read_exact(block)?;
        let (numbers, _) = block.as_chunks::<N>();
        values.extend(numbers.iter().map(|bytes| convert(*bytes)));
    }
    Ok(values)
}
