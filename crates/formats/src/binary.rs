//! Reading numbers from files without trusting the sizes they claim.

use crate::error::Problem;

/// The number of elements of an array, whose bytes after a header of `header` bytes must be what a
/// file of `size` bytes holds.
///
/// # Errors
/// Another size, or one that overflows.
pub fn checked_count(
    shape: &[usize],
    element_size: usize,
    header: u64,
    size: u64,
) -> Result<usize, Problem> {
    let count = shape
        .iter()
        .try_fold(1usize, |product, &n| product.checked_mul(n));
    let too_large = || Problem::TooLarge(format!("an array of {}", product(shape)));
    let count = count.ok_or_else(too_large)?;
    check_size(count, element_size, header, size)?;
    Ok(count)
}

/// Checks that a file of `size` bytes holds `count` elements after a header of `header` bytes, and nothing
/// else.
pub(crate) fn check_size(
    count: usize,
    element_size: usize,
    header: u64,
    size: u64,
) -> Result<(), Problem> {
    let bytes = (count as u64).checked_mul(element_size as u64);
    let expected = bytes.and_then(|n| header.checked_add(n));
    match expected {
        None => Err(Problem::TooLarge(format!("an array of {count} elements"))),
        Some(expected) if size < expected => Err(Problem::Truncated {
            expected,
            found: size,
        }),
        Some(expected) if size > expected => Err(Problem::TrailingBytes {
            extra: size - expected,
        }),
        Some(_) => Ok(()),
    }
}

/// Sizes as `2 x 3 x 4`.
pub(crate) fn product(shape: &[usize]) -> String {
    shape
        .iter()
        .map(usize::to_string)
        .collect::<Vec<_>>()
        .join(" x ")
}
