//! NRRD, nearly raw raster data: a text header, and numbers in the same file or another one.
//! <https://teem.sourceforge.net/nrrd/format.html>

mod fields;
mod header;
mod write;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::layout::Layout;
use super::{INFLATION, Options, Sample, Volume};
use crate::error::{FileError, Problem};
use crate::{binary, input};
use header::{Compression, Header};

pub use write::write;

/// Reads a volume. If the header has `space directions`, they define the volume's x, y and z, in
/// the order of the file, and its position. Otherwise the user gives the order of axes, and
/// `spacings` define the position, with the first sample at the origin. Coordinates of all `space`s
/// are used unchanged.
///
/// # Errors
///
/// A file that cannot be read or is not an NRRD file. An axis order that is missing or superfluous.
/// Data in several files, or with other compression than gzip. A number of data that differs from
/// the header. NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let read = || {
        let (mut reader, size) = input::open(path).map_err(|e| e.problem)?;
        let header = Header::read(&mut reader)?;
        let Some(name) = &header.data_file else {
            let left = size.saturating_sub(header.bytes);
            return values(reader.take(left), left, &header, options);
        };
        let data = path.with_file_name(name);
        let (reader, size) = input::open(&data).map_err(|e| in_file(name, e.problem))?;
        values(reader.take(size), size, &header, options).map_err(|problem| in_file(name, problem))
    };
    read().map_err(|problem| problem.at(path))
}

/// Returns the name of the file with the data, if `path` is a readable header without data.
pub fn data_file(path: &Path) -> Option<String> {
    let (mut reader, _) = input::open(path).ok()?;
    Header::read(&mut reader).ok()?.data_file
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`], and data in another file.
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let mut reader = BufReader::new(bytes);
    let header = Header::read(&mut reader)?;
    if header.data_file.is_some() {
        let message = "NRRD data in a file of their own, which was not given";
        return Err(Problem::Unsupported(message.into()));
    }
    let left = (bytes.len() as u64).saturating_sub(header.bytes);
    values(reader, left, &header, options)
}

fn in_file(name: &str, problem: Problem) -> Problem {
    Problem::Malformed(format!("its data file '{name}': {problem}"))
}

/// Reads the values of a volume, after skipped bytes, from the next `left` bytes.
fn values<T: Sample>(
    mut reader: impl BufRead,
    mut left: u64,
    header: &Header,
    options: Options,
) -> Result<Volume<T>, Problem> {
    let order = header.order(options)?;
    let layout = Layout::new(&header.sizes, true, order)?;
    for _ in 0..header.line_skip {
        match reader.skip_until(b'\n').map_err(Problem::Read)? {
            0 => return Err(bad("it has fewer lines than it skips")),
            skipped => left = left.saturating_sub(skipped as u64),
        }
    }
    let data = match header.compression {
        Compression::None => {
            let skipped = skip(&mut reader, header.skip_of(&layout, left)?)?;
            left = left.saturating_sub(skipped);
            let size = header.encoding.element.size();
            binary::check_size(layout.count(), size, 0, left)?;
            layout.check::<T>(options.limits, left)?;
            layout.read(&mut reader, header.encoding)?
        }
        Compression::Gzip => {
            let bytes = layout.count() as u64 * header.encoding.element.size() as u64;
            if bytes > left.saturating_mul(INFLATION) {
                return Err(Problem::Truncated {
                    expected: bytes,
                    found: left,
                });
            }
            layout.check::<T>(options.limits, left)?;
            let mut inner = MultiGzDecoder::new(reader);
            let damaged = |e| {
                bad(&format!(
                    "its compressed data are damaged or end early: {e}"
                ))
            };
            let skipped = skip(
                &mut inner,
                header.skip_of(&layout, options.limits.most(left))?,
            );
            skipped
                .and_then(|_| layout.read(&mut inner, header.encoding))
                .map_err(damaged)?
        }
        Compression::Text => {
            skip(&mut reader, header.skip_of(&layout, left)?)?;
            layout.check::<T>(options.limits, left)?;
            let mut text = String::new();
            reader.read_to_string(&mut text).map_err(Problem::Read)?;
            layout.parse(&text)?
        }
    };
    let volume = Volume::new(layout.size, layout.channels, data)?;
    let volume = volume
        .with_element(header.encoding.element)
        .with_unit(header.unit.clone());
    Ok(match header.frame(order)? {
        Some(frame) => volume.with_frame(frame),
        None => volume,
    })
}

/// Skips up to `bytes` bytes, and returns their number.
fn skip(reader: &mut impl Read, bytes: u64) -> Result<u64, Problem> {
    let skipped = std::io::copy(&mut reader.take(bytes), &mut std::io::sink());
    skipped.map_err(Problem::Read)
}

fn bad(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "NRRD",
        reason: reason.into(),
    }
}
