//! MATLAB's files, version 5 (`save -v6` and `-v7`): arrays with names, compressed or not.
//! "MAT-File Format", MathWorks, R2023a.

mod element;
mod write;

use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::layout::Layout;
use super::{INFLATION, Options, Sample, Volume, choose};
use crate::element::Encoding;
use crate::error::{FileError, Problem};
use crate::input;
use element::{COMPRESSED, Head, MATRIX, Tag, number};

pub use write::write;

/// Bytes before the first element.
const HEADER: usize = 128;

/// Reads a volume from the variable of the given name, from the only numeric one if none is given: an array of
/// up to three axes, or four with channels. MATLAB leaves axes of length 1 at the end out.
///
/// # Errors
///
/// A file that cannot be read or is not of version 5, an axis order that is not given, a variable that it does
/// not have or that is complex, and NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, size, options).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let mut reader = BufReader::new(Cursor::new(bytes));
    read_from(&mut reader, bytes.len() as u64, options)
}

fn read_from<T: Sample>(
    reader: &mut (impl Read + Seek),
    size: u64,
    options: Options,
) -> Result<Volume<T>, Problem> {
    let big = byte_order(reader)?;
    let variables = variables(reader, big, size)?;
    let names: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
    let variable = &variables[choose(&names, options.dataset)?];
    reader
        .seek(SeekFrom::Start(variable.at))
        .map_err(Problem::Read)?;
    let mut file = Limited {
        inner: reader,
        left: size - variable.at,
    };
    let tag = Tag::read(&mut file, big)?;
    let held = u64::from(tag.size);
    match tag.kind {
        COMPRESSED => {
            let inner = ZlibDecoder::new(BufReader::new(file.take(held)));
            let mut limited = Limited {
                inner,
                left: held.saturating_mul(INFLATION),
            };
            Tag::read(&mut limited, big)?;
            array(&mut limited, big, options, size)
        }
        _ => array(&mut file, big, options, size),
    }
}

/// Reads an array of numbers, of which the tag has been read, from a file of `size` bytes.
fn array<T: Sample>(
    reader: &mut Limited<impl Read>,
    big: bool,
    options: Options,
    size: u64,
) -> Result<Volume<T>, Problem> {
    let head = Head::read(reader, big)?;
    if head.complex {
        let message = format!(
            "the complex array '{}': save its parts or its modulus",
            head.name
        );
        return Err(Problem::Unsupported(message));
    }
    let mut shape = head.shape;
    while shape.len() < 3 {
        shape.push(1);
    }
    let layout = Layout::new(&shape, true, options.axes()?)?;
    layout.check::<T>(options.limits, size)?;
    let tag = Tag::read(reader, big)?;
    let element = number(tag.kind)?;
    let expected = layout.count() as u64 * element.size() as u64;
    if expected != u64::from(tag.size) {
        return Err(Problem::Mismatch {
            expected: format!("an array of {expected} bytes"),
            found: tag.size.to_string(),
        });
    }
    let encoding = Encoding { element, big };
    let data = match tag.small {
        Some(bytes) => layout.read(&mut &bytes[..], encoding)?,
        None if expected > reader.left => {
            return Err(Problem::Truncated {
                expected,
                found: reader.left,
            });
        }
        None => layout.read(reader, encoding)?,
    };
    let volume = Volume::new(layout.size, layout.channels, data)?;
    Ok(volume.with_element(head.element))
}

/// Whether the most significant byte of a number comes first.
fn byte_order(reader: &mut impl Read) -> Result<bool, Problem> {
    let mut header = [0; HEADER];
    let cut = |_| wrong("it is shorter than a header");
    reader.read_exact(&mut header).map_err(cut)?;
    if header.starts_with(b"MATLAB 7.3") {
        let message = "MATLAB 7.3, which is HDF5: rename it to .h5 and give the variable as dataset; the axes are \
                       reversed there, p(x, y, z) has the order zyx";
        return Err(Problem::Unsupported(message.into()));
    }
    match &header[124..] {
        [0, 1, b'I', b'M'] => Ok(false),
        [1, 0, b'M', b'I'] => Ok(true),
        _ => Err(wrong("its header is not that of version 5")),
    }
}

/// A numeric array, and where it begins.
struct Variable {
    name: String,
    at: u64,
}

/// All numeric arrays of a file.
fn variables(
    reader: &mut (impl Read + Seek),
    big: bool,
    size: u64,
) -> Result<Vec<Variable>, Problem> {
    let mut found = Vec::new();
    let mut at = HEADER as u64;
    while at < size {
        reader.seek(SeekFrom::Start(at)).map_err(Problem::Read)?;
        let tag = Tag::read(reader, big)?;
        let head = match tag.kind {
            MATRIX => Some(Head::read(reader, big)),
            COMPRESSED => {
                let block = reader.by_ref().take(u64::from(tag.size));
                let mut inner = ZlibDecoder::new(BufReader::new(block));
                Some(Tag::read(&mut inner, big).and_then(|_| Head::read(&mut inner, big)))
            }
            _ => None,
        };
        // What is no array of numbers, such as a text or a table, is none of ours.
        if let Some(Ok(head)) = head {
            found.push(Variable {
                name: head.name,
                at,
            });
        }
        at += Tag::SIZE + u64::from(tag.size);
    }
    Ok(found)
}

/// A reader that ends, and says how much is left.
struct Limited<R> {
    inner: R,
    left: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let most = usize::try_from(self.left).unwrap_or(usize::MAX);
        let most = most.min(buffer.len());
        let read = self.inner.read(&mut buffer[..most])?;
        self.left -= read as u64;
        Ok(read)
    }
}

fn wrong(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "MAT",
        reason: reason.into(),
    }
}
