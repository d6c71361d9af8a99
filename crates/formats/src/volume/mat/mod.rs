//! MATLAB files of version 5 (`save -v6` and `-v7`): arrays with names, compressed or not.
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
use crate::input::{self, Budget, Limits};
use element::{COMPRESSED, Head, MATRIX, Tag, number};

pub use write::{Content, Variable, write, write_variables};

/// Size of the file header, in bytes.
const HEADER: usize = 128;
/// Beginning of files of version 7.3, which are HDF5 after a header of 512 bytes.
const LATER: &[u8; 10] = b"MATLAB 7.3";

/// Reads a volume from the variable with the given name, or from the only numeric variable: an
/// array of up to three axes, or four with channels. MATLAB omits trailing axes of length 1.
///
/// # Errors
///
/// A file that cannot be read or is not of version 5. An axis order that is not given. A missing or
/// complex variable. NaN or infinite values.
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
    let mut contents = contents(reader, variable.at, big, size)?;
    array(&mut contents, big, options, size)
}

/// Numeric array of any number of axes; the first index varies fastest.
pub struct StoredArray {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Numbers of the array.
    pub data: Vec<f64>,
}

/// Name of an array, and the array or its problem.
pub(crate) type NamedArray = (String, Result<StoredArray, Problem>);

/// Returns true if a file is of MATLAB 7.3, which is HDF5.
///
/// # Errors
/// The file cannot be read.
pub fn is_hdf5(path: &Path) -> Result<bool, Problem> {
    let (mut reader, _) = input::open(path).map_err(|error| error.problem)?;
    let mut start = [0; LATER.len()];
    // Accept shorter files: reading them reports the problem.
    Ok(reader.read_exact(&mut start).is_ok() && start == *LATER)
}

/// Reads all numeric arrays with their names, and the problems of arrays that cannot be read.
///
/// # Errors
/// The file cannot be read, or takes more memory than the limits allow.
pub fn numbers(path: &Path, limits: Limits) -> Result<Vec<NamedArray>, Problem> {
    let (mut reader, size) = input::open(path).map_err(|error| error.problem)?;
    let big = byte_order(&mut reader)?;
    let variables = variables(&mut reader, big, size)?;
    let mut budget = Budget::new(limits, size);
    let read = variables.into_iter().map(|variable| {
        let stored = contents(&mut reader, variable.at, big, size)
            .and_then(|mut contents| stored(&mut contents, big, &mut budget));
        (variable.name, stored)
    });
    Ok(read.collect())
}

fn stored(
    reader: &mut Limited<impl Read>,
    big: bool,
    budget: &mut Budget,
) -> Result<StoredArray, Problem> {
    let Head { shape, .. } = real_head(reader, big)?;
    let count = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n));
    let count = count.ok_or_else(|| Problem::TooLarge(format!("an array of {shape:?}")))?;
    // Take memory for the values, and for their copy in another order.
    budget.take(count as u64, 2 * size_of::<f64>() as u64)?;
    let (encoding, mut bytes) = values(reader, big, count)?;
    let mut data = Vec::with_capacity(count);
    let read = encoding.read(&mut bytes, count, |v| data.push(v));
    read.map_err(Problem::Read)?;
    Ok(StoredArray { shape, data })
}

/// Returns a reader of the content of a variable, after its tag.
fn contents<'r>(
    reader: &'r mut (impl Read + Seek),
    at: u64,
    big: bool,
    size: u64,
) -> Result<Limited<Box<dyn Read + 'r>>, Problem> {
    reader.seek(SeekFrom::Start(at)).map_err(Problem::Read)?;
    let mut file = Limited {
        inner: Box::new(reader) as Box<dyn Read>,
        left: size - at,
    };
    let tag = Tag::read(&mut file, big)?;
    if tag.kind != COMPRESSED {
        return Ok(file);
    }
    let held = u64::from(tag.size);
    let mut inflated = Limited {
        inner: Box::new(ZlibDecoder::new(BufReader::new(file.take(held)))) as Box<dyn Read>,
        left: held.saturating_mul(INFLATION),
    };
    Tag::read(&mut inflated, big)?;
    Ok(inflated)
}

/// Reads the head of an array of real numbers.
fn real_head(reader: &mut impl Read, big: bool) -> Result<Head, Problem> {
    let head = Head::read(reader, big)?;
    if head.complex {
        let message = format!(
            "the complex array '{}': save its parts or its modulus",
            head.name
        );
        return Err(Problem::Unsupported(message));
    }
    Ok(head)
}

/// Returns a reader of the `count` numbers of an array whose head has been read.
fn values<'r>(
    reader: &'r mut Limited<impl Read>,
    big: bool,
    count: usize,
) -> Result<(Encoding, Box<dyn Read + 'r>), Problem> {
    let tag = Tag::read(reader, big)?;
    let element = number(tag.kind)?;
    let expected = count as u64 * element.size() as u64;
    if expected != u64::from(tag.size) {
        return Err(Problem::Mismatch {
            expected: format!("an array of {expected} bytes"),
            found: tag.size.to_string(),
        });
    }
    let bytes: Box<dyn Read> = match tag.small {
        Some(bytes) => Box::new(Cursor::new(bytes)),
        None if expected > reader.left => {
            let found = reader.left;
            return Err(Problem::Truncated { expected, found });
        }
        None => Box::new(reader),
    };
    Ok((Encoding { element, big }, bytes))
}

/// Reads a volume, after its tag, from a file of `size` bytes.
fn array<T: Sample>(
    reader: &mut Limited<impl Read>,
    big: bool,
    options: Options,
    size: u64,
) -> Result<Volume<T>, Problem> {
    let head = real_head(reader, big)?;
    let mut shape = head.shape;
    while shape.len() < 3 {
        shape.push(1);
    }
    let layout = Layout::new(&shape, true, options.axes()?)?;
    layout.check::<T>(options.limits, size)?;
    let (encoding, mut bytes) = values(reader, big, layout.count())?;
    let data = layout.read(&mut bytes, encoding)?;
    let volume = Volume::new(layout.size, layout.channels, data)?;
    Ok(volume.with_element(head.element))
}

/// Returns true if the most significant byte of a number comes first.
fn byte_order(reader: &mut impl Read) -> Result<bool, Problem> {
    let mut header = [0; HEADER];
    let cut = |_| wrong("it is shorter than a header");
    reader.read_exact(&mut header).map_err(cut)?;
    if header.starts_with(LATER) {
        let message = "MATLAB 7.3, which is HDF5: rename it to .h5 and give the variable as dataset; the axes are \
                       reversed there, p(x, y, z) has the order zyx";
        return Err(Problem::Unsupported(message.into()));
    }
    match &header[124..] {
        [0, 1, b'I', b'M'] => Ok(false),
        [1, 0, b'M', b'I'] => Ok(true),
        _ => Err(wrong("its header does not have version 5")),
    }
}

/// Name of a numeric array, and its offset in the file.
struct VariablePlace {
    name: String,
    at: u64,
}

/// Lists all numeric arrays of a file.
fn variables(
    reader: &mut (impl Read + Seek),
    big: bool,
    size: u64,
) -> Result<Vec<VariablePlace>, Problem> {
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
        // Skip variables that are not numeric arrays, such as texts or tables.
        if let Some(Ok(head)) = head {
            found.push(VariablePlace {
                name: head.name,
                at,
            });
        }
        at += Tag::SIZE + u64::from(tag.size);
    }
    Ok(found)
}

/// Reader of a limited number of bytes.
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
