//! Writing of variables.

use std::io::Write;
use std::path::Path;

use super::HEADER;
use super::element::{INT8, INT32, MATRIX, UINT32, codes};
use crate::atomic;
use crate::element::Encoding;
use crate::error::{FileError, Problem};
use crate::volume::{Format, Sample, Volume};

/// Maximum length of a name in MATLAB.
const MAX_NAME_LENGTH: usize = 63;

/// Writes a volume as the uncompressed variable `name`, an array (x, y, z), or (x, y, z, channel)
/// if it has several channels.
///
/// # Errors
///
/// An invalid name of a variable, an array of 4 GiB or more, and all errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let starts = name.starts_with(|c: char| c.is_ascii_alphabetic());
    if !starts || !name.chars().all(letters) || name.len() > MAX_NAME_LENGTH {
        let message = format!("'{name}' as a variable of MATLAB");
        return Err(Problem::Unsupported(message).at(path));
    }
    let element = Format::Mat.element(volume.element());
    let Some((kind, class)) = codes(element) else {
        return Err(Problem::Unsupported(format!("{element} in MATLAB files")).at(path));
    };
    let [x, y, z] = volume.size();
    let channels = volume.channels();
    let too_large =
        || Problem::TooLarge("a MATLAB file holds arrays of up to 4 GiB".into()).at(path);
    let size = |n: usize| u32::try_from(n).map_err(|_| too_large());
    let mut shape = vec![size(x)?, size(y)?, size(z)?];
    shape.extend((channels > 1).then_some(size(channels)?));
    let head = [
        part(UINT32, &words(&[u32::from(class), 0])),
        part(INT32, &words(&shape)),
        part(INT8, name.as_bytes()),
    ]
    .concat();
    let bytes = volume.data().len() * element.size();
    let padding = bytes.next_multiple_of(8) - bytes;
    let whole = size(head.len() + 8 + bytes + padding)?;
    // Reorder channels: they are adjacent in a volume, but the slowest axis here.
    let data = volume.data();
    let one = |channel| data.iter().skip(channel).step_by(channels);
    let values = (0..channels).flat_map(one).map(|v| v.wide());
    atomic::write(path, |file| {
        file.write_all(&header())?;
        file.write_all(&words(&[MATRIX, whole]))?;
        file.write_all(&head)?;
        file.write_all(&words(&[kind, bytes as u32]))?;
        Encoding::little(element).write(file, values)?;
        file.write_all(&[0; 8][..padding])
    })
}

fn header() -> [u8; HEADER] {
    const TEXT: &[u8] = b"MATLAB 5.0 MAT-file, written by morgana";
    let mut header = [b' '; HEADER];
    header[..TEXT.len()].copy_from_slice(TEXT);
    header[116..124].fill(0);
    header[124..].copy_from_slice(&[0, 1, b'I', b'M']);
    header
}

fn words(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// Makes a tag with padded data.
fn part(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = words(&[kind, data.len() as u32]);
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}
