//! Writing of variables.

use std::io::Write;
use std::path::Path;

use super::HEADER;
use super::element::{INT8, INT32, MATRIX, TEXT_CLASS, UINT16, UINT32, codes};
use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::volume::{Format, GridData, Sample, Volume};

/// Maximum length of a name in MATLAB.
const MAX_NAME_LENGTH: usize = 63;

/// Variable of a MATLAB file.
pub struct Variable<'a> {
    /// Name: ASCII letters, digits and underscores, first a letter.
    pub name: String,
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Content of the variable.
    pub content: Content<'a>,
}

/// Content of a variable.
pub enum Content<'a> {
    /// Numbers of a type; the first index runs fastest.
    Numbers(Element, Box<dyn Iterator<Item = f64> + 'a>),
    /// Text, as a row of UTF-16 characters.
    Text(&'a str),
}

/// Writes a volume as the uncompressed variable `name`, an array (x, y, z), or (x, y, z, channel)
/// if it has several channels.
///
/// # Errors
///
/// The errors of [`write_variables`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    let element = Format::Mat.element(volume.element());
    let mut shape = volume.size().to_vec();
    shape.extend((volume.channels() > 1).then_some(volume.channels()));
    let grid = GridData::of_volume(volume, name);
    let values = grid.arrays[0].by_axis(grid.size);
    let variable = Variable {
        name: name.to_owned(),
        shape,
        content: Content::Numbers(element, Box::new(values)),
    };
    write_variables(path, vec![variable])
}

/// Writes uncompressed variables.
///
/// # Errors
///
/// An invalid name of a variable, an array of 4 GiB or more, and all errors of [`atomic::write()`].
pub fn write_variables(path: &Path, variables: Vec<Variable>) -> Result<(), FileError> {
    let heads = variables.iter().map(Head::new);
    let heads = heads.collect::<Result<Vec<_>, Problem>>();
    let heads = heads.map_err(|problem| problem.at(path))?;
    atomic::write(path, |file| {
        file.write_all(&header())?;
        for (variable, head) in variables.into_iter().zip(&heads) {
            file.write_all(&head.bytes)?;
            match variable.content {
                Content::Numbers(element, values) => {
                    Encoding::little(element).write(file, values)?;
                }
                Content::Text(text) => {
                    let units = text.encode_utf16().map(f64::from);
                    Encoding::little(Element::U16).write(file, units)?;
                }
            }
            file.write_all(&[0; 8][..head.padding])?;
        }
        Ok(())
    })
}

/// Bytes before the numbers of a variable.
struct Head {
    bytes: Vec<u8>,
    /// Number of bytes after the numbers.
    padding: usize,
}

impl Head {
    fn new(variable: &Variable) -> Result<Self, Problem> {
        let name = &variable.name;
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let starts = name.starts_with(|c: char| c.is_ascii_alphabetic());
        if !starts || !name.chars().all(letters) || name.len() > MAX_NAME_LENGTH {
            let message = format!("'{name}' as a variable of MATLAB");
            return Err(Problem::Unsupported(message));
        }
        let (kind, class, size) = match variable.content {
            Content::Numbers(element, _) => {
                let unknown = || Problem::Unsupported(format!("{element} in MATLAB files"));
                let (kind, class) = codes(element).ok_or_else(unknown)?;
                (kind, class, element.size())
            }
            Content::Text(_) => (UINT16, TEXT_CLASS, size_of::<u16>()),
        };
        let small = |n: usize| {
            let message = || {
                format!(
                    "a MATLAB file holds arrays of up to 4 GiB, but '{name}' has more: write .h5"
                )
            };
            u32::try_from(n).map_err(|_| Problem::TooLarge(message()))
        };
        let shape = variable.shape.iter().map(|n| small(*n));
        let shape = shape.collect::<Result<Vec<u32>, Problem>>()?;
        let count = variable
            .shape
            .iter()
            .try_fold(size, |all, n| all.checked_mul(*n));
        let bytes = count.unwrap_or(usize::MAX);
        let head = [
            part(UINT32, &words(&[u32::from(class), 0])),
            part(INT32, &words(&shape)),
            part(INT8, name.as_bytes()),
        ]
        .concat();
        let padding = bytes.wrapping_neg() % 8;
        let whole = small(bytes.saturating_add(head.len() + 8 + padding))?;
        let tag = words(&[kind, small(bytes)?]);
        Ok(Head {
            bytes: [words(&[MATRIX, whole]), head, tag].concat(),
            padding,
        })
    }
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
