//! Reading of numbers from files without trust in their stated sizes.

use crate::error::Problem;

/// Returns the number of elements of an array. A file of `size` bytes must contain exactly the
/// array, after a header of `header` bytes.
///
/// # Errors
/// Another size, or a size that overflows.
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

/// Checks that a file of `size` bytes contains exactly `count` elements after a header of `header`
/// bytes.
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

/// Formats sizes as `2 x 3 x 4`.
pub(crate) fn product(shape: &[usize]) -> String {
    shape
        .iter()
        .map(usize::to_string)
        .collect::<Vec<_>>()
        .join(" x ")
}
