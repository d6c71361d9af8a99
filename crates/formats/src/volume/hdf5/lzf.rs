//! LZF, the fast filter of h5py: runs of literal bytes, and copies of earlier bytes.
//! <http://oldhome.schmorp.de/marc/liblzf.html>

use hdf5_reader::FilterRegistry;
use hdf5_reader::error::Error;

/// Number of the filter, registered with The HDF Group.
const LZF: u16 = 32000;
/// Control bytes below this value begin a run of literal bytes.
const LITERALS: u8 = 32;
/// Length in a control byte that indicates a longer copy, whose remaining length is in the next
/// byte.
const LONG: usize = 7;

/// Returns the filters of the reader and LZF. Decompressed blocks have at most `most` bytes.
pub(super) fn filters(most: usize) -> FilterRegistry {
    let mut filters = FilterRegistry::new();
    let damaged = || Error::FilterError("a block compressed by LZF is damaged".into());
    let decode = move |data: &[u8]| decompress(data, most).ok_or_else(damaged);
    filters.register(LZF, Box::new(move |_, data, _| decode(data)));
    filters
}

/// Decompresses a block; `None` if it is damaged, or longer than `most` bytes.
fn decompress(block: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut rest = block;
    while let [control, after @ ..] = rest {
        rest = if *control < LITERALS {
            let (run, after) = after.split_at_checked(usize::from(*control) + 1)?;
            out.extend_from_slice(run);
            after
        } else {
            copy(*control, after, &mut out)?
        };
        if out.len() > most {
            return None;
        }
    }
    Some(out)
}

/// Repeats earlier bytes, which may overlap the output. Returns the bytes after the instruction.
fn copy<'b>(control: u8, after: &'b [u8], out: &mut Vec<u8>) -> Option<&'b [u8]> {
    let (mut length, mut after) = (usize::from(control >> 5), after);
    if length == LONG {
        let (more, rest) = after.split_first()?;
        length += usize::from(*more);
        after = rest;
    }
    let (low, rest) = after.split_first()?;
    let back = (usize::from(control & 31) << 8) + usize::from(*low) + 1;
    let start = out.len().checked_sub(back)?;
    for i in start..start + length + 2 {
        out.push(out[i]);
    }
    Some(rest)
}

#[cfg(test)]
mod tests {
    use super::decompress;

    #[test]
    fn literals_and_copies() {
        // Decode "abc", then 5 bytes from 3 bytes before: the copy repeats itself.
        let block = [2, b'a', b'b', b'c', 3 << 5, 2];
        assert_eq!(decompress(&block, 100).unwrap(), b"abcabcab");
        // Decode a long copy of one byte: 7 + 10 + 2.
        let block = [0, b'x', 7 << 5, 10, 0];
        assert_eq!(decompress(&block, 100).unwrap(), [b'x'; 20]);
        assert_eq!(decompress(&block, 19), None);
    }

    #[test]
    fn damaged_blocks_are_refused() {
        for block in [&[5, 1][..], &[0, 1, 1 << 5], &[0, 1, 1 << 5, 1], &[7 << 5]] {
            assert_eq!(decompress(block, 100), None, "{block:?}");
        }
    }
}
