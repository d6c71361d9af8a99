//! Header of NRRD files.

use std::io::BufRead;

use glam::{DMat3, DVec3};

use super::bad;
use super::fields::Fields;
use crate::element::{Element, Encoding};
use crate::error::Problem;
use crate::volume::layout::{AxisOrder, Layout};
use crate::volume::{Options, VolumeFrame};

/// Encoding of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Gzip,
    Text,
}

/// Metadata before the data. Axes are in the order of the file, the fastest first.
pub(super) struct Header {
    pub sizes: Vec<usize>,
    pub encoding: Encoding,
    pub compression: Compression,
    /// Name of the file with the data, if it is separate.
    pub data_file: Option<String>,
    pub line_skip: u64,
    /// Number of bytes to skip; −1 if the data are at the end.
    byte_skip: i64,
    /// Steps along each axis; `None` for axes outside space.
    directions: Option<Vec<Option<DVec3>>>,
    spacings: Option<Vec<f64>>,
    origin: DVec3,
    nodes: bool,
    /// Unit of the space coordinates.
    pub unit: Option<String>,
    /// Size of the header, in bytes.
    pub bytes: u64,
}

impl Header {
    pub(super) fn read(reader: &mut impl BufRead) -> Result<Self, Problem> {
        let mut fields = Fields::read(reader)?;
        let sizes = fields.all("sizes", |word| word.parse().ok())?;
        let sizes = sizes.ok_or_else(|| bad("its header has no 'sizes'"))?;
        let element = element(&fields.required("type")?)?;
        let compression = match fields.required("encoding")?.as_str() {
            "raw" => Compression::None,
            "gzip" | "gz" => Compression::Gzip,
            "ascii" | "text" | "txt" => Compression::Text,
            other => return Err(Problem::Unsupported(format!("NRRD encoding '{other}'"))),
        };
        let big = match fields.take("endian").as_deref() {
            Some("little") => false,
            Some("big") => true,
            None if element.size() == 1 || compression == Compression::Text => false,
            _ => return Err(bad("its header has no 'endian' of 'little' or 'big'")),
        };
        let data_file = fields.take("data file");
        if let Some(name) = data_file.as_deref()
            && (name.contains('%') || name.starts_with("LIST"))
        {
            let message = "NRRD data in several files: join them";
            return Err(Problem::Unsupported(message.into()));
        }
        let origin = fields.all("space origin", |word| vector(word).flatten())?;
        Ok(Header {
            sizes,
            encoding: Encoding { element, big },
            compression,
            data_file,
            line_skip: fields.number("line skip")?.unwrap_or(0),
            byte_skip: fields.number("byte skip")?.unwrap_or(0),
            directions: fields.all("space directions", vector)?,
            spacings: fields.all("spacings", |word| word.parse().ok())?,
            origin: origin.and_then(|o| o.first().copied()).unwrap_or_default(),
            nodes: nodes(fields.take("centers").or(fields.take("centerings")))?,
            unit: unit(fields.take("space units").or(fields.take("units"))),
            bytes: fields.bytes,
        })
    }

    /// Returns the order of axes: from the file if it has `space directions`, else from the user.
    pub(super) fn order(&self, options: Options) -> Result<AxisOrder, Problem> {
        let Some(directions) = &self.directions else {
            return options.axes();
        };
        if options.axes.is_some() {
            let message = "its 'space directions' state the order of its axes: leave out the order";
            return Err(Problem::Unsaid(message.into()));
        }
        let mut names = ['x', 'y', 'z'].into_iter();
        let letter = |d: &Option<DVec3>| d.map_or(Some('c'), |_| names.next());
        let letters: Option<String> = directions.iter().map(letter).collect();
        let order = letters.and_then(|letters| letters.parse().ok());
        let other = || Problem::Unsupported("NRRD with other than three 'space directions'".into());
        order.ok_or_else(other)
    }

    /// Returns the position of the samples.
    pub(super) fn frame(&self, order: AxisOrder) -> Result<Option<VolumeFrame>, Problem> {
        let letters = order.to_string();
        let steps = match (&self.directions, &self.spacings) {
            (Some(directions), _) => {
                let steps: Vec<DVec3> = directions.iter().flatten().copied().collect();
                let [x, y, z] = steps[..] else {
                    return Ok(None);
                };
                DMat3::from_cols(x, y, z)
            }
            (None, Some(spacings)) => {
                let along = |axis| letters.find(axis).and_then(|i| spacings.get(i));
                let spacing = ['x', 'y', 'z'].map(|axis| along(axis).copied().unwrap_or(f64::NAN));
                DMat3::from_diagonal(DVec3::from_array(spacing))
            }
            (None, None) => return Ok(None),
        };
        let frame = VolumeFrame {
            first: self.origin,
            steps,
            nodes: self.nodes,
        };
        let degenerate = || bad("its spacings or space directions are degenerate");
        frame
            .is_sound()
            .then_some(Some(frame))
            .ok_or_else(degenerate)
    }

    /// Returns the number of bytes to skip before the data, of `left` remaining bytes.
    pub(crate) fn skip_of(&self, layout: &Layout, left: u64) -> Result<u64, Problem> {
        let size = (layout.count() * self.encoding.element.size()) as u64;
        match (self.byte_skip, self.compression) {
            (-1, Compression::None) => Ok(left.saturating_sub(size)),
            (n, _) if n >= 0 => Ok(n.unsigned_abs().min(left)),
            _ => Err(bad("its 'byte skip' makes no sense")),
        }
    }
}

/// Parses `(1,0,0)` or `none`.
fn vector(word: &str) -> Option<Option<DVec3>> {
    if word == "none" {
        return Some(None);
    }
    let inner = word.strip_prefix('(')?.strip_suffix(')')?;
    let numbers: Option<Vec<f64>> = inner.split(',').map(|n| n.parse().ok()).collect();
    Some(Some(DVec3::from_array(numbers?.try_into().ok()?)))
}

fn nodes(centers: Option<String>) -> Result<bool, Problem> {
    let text = centers.unwrap_or_default();
    let has = |word| text.split_whitespace().any(|w| w == word);
    match (has("node"), has("cell")) {
        (true, true) => Err(Problem::Unsupported(
            "NRRD with 'centers' of both kinds".into(),
        )),
        (nodes, _) => Ok(nodes),
    }
}

/// Returns the first known unit in a list of units in quotation marks.
fn unit(units: Option<String>) -> Option<String> {
    let units = units?;
    let mut words = units.split('"').map(str::trim);
    words
        .find(|word| !word.is_empty() && *word != "???")
        .map(str::to_owned)
}

fn element(kind: &str) -> Result<Element, Problem> {
    Ok(match kind {
        "signed char" | "int8" | "int8_t" => Element::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Element::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            Element::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Element::U16,
        "int" | "signed int" | "int32" | "int32_t" => Element::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Element::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => Element::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            Element::U64
        }
        "float" => Element::F32,
        "double" => Element::F64,
        other => {
            return Err(Problem::Unsupported(format!(
                "NRRD numbers of type '{other}'"
            )));
        }
    })
}
