//! NIfTI-1 and NIfTI-2 files of medical images: one file with a header and the values, plain or
//! compressed by gzip.
//! <https://nifti.nimh.nih.gov/nifti-1/documentation/nifti1fields>

mod write;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use glam::{DMat3, DQuat, DVec3};

use super::layout::Layout;
use super::{AxisOrder, INFLATION, Options, Sample, Volume, VolumeFrame};
use crate::binary;
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

pub(super) use write::Placed;
pub use write::write;

/// Size of the header of NIfTI-1, in bytes.
const NIFTI_1_HEADER: usize = 348;
/// Size of the header of NIfTI-2, in bytes.
const NIFTI_2_HEADER: usize = 540;
/// Maximum number of bytes between the header and the values. Extensions there are skipped.
const MAX_SKIPPED: u64 = 1 << 30;

/// Reads a volume. Its position comes from `sform`, else from `qform`, else from the sizes of
/// voxels, starting at the origin. A fourth axis contains the channels; further axes of length 1
/// are ignored.
///
/// # Errors
///
/// A file that cannot be read or is not a NIfTI file of one part. More than four axes. Numbers that
/// are neither integers nor floating-point numbers. A size that differs from the header. NaN or
/// infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, size, options.limits).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    read_from(
        &mut BufReader::new(bytes),
        bytes.len() as u64,
        options.limits,
    )
}

fn read_from<T: Sample>(
    reader: &mut impl BufRead,
    size: u64,
    limits: Limits,
) -> Result<Volume<T>, Problem> {
    let compressed = reader
        .fill_buf()
        .map_err(Problem::Read)?
        .starts_with(&[0x1f, 0x8b]);
    if !compressed {
        let header = Header::read(reader)?;
        binary::check_size(
            header.layout.count(),
            header.encoding.element.size(),
            header.start,
            size,
        )?;
        return header.volume(reader, size, limits);
    }
    let mut inner = MultiGzDecoder::new(reader);
    let header = Header::read(&mut inner)?;
    let bytes = header.layout.count() as u64 * header.encoding.element.size() as u64;
    if bytes > size.saturating_mul(INFLATION) {
        return Err(Problem::Truncated {
            expected: bytes,
            found: size,
        });
    }
    header.volume(&mut inner, size, limits)
}

/// Content of a header.
struct Header {
    encoding: Encoding,
    layout: Layout,
    /// Offset of the values in the file, in bytes.
    start: u64,
    /// Number of bytes read so far.
    read: u64,
    /// Slope and offset: a number q represents slope q + offset.
    scaling: Option<[f64; 2]>,
    frame: VolumeFrame,
    unit: Option<String>,
}

/// Fields of a header of either version, by their offsets.
struct Fields {
    bytes: Vec<u8>,
    big: bool,
    second: bool,
}

impl Fields {
    /// Returns the field at one of two offsets, for the first and the second version.
    fn at<const N: usize>(&self, places: [usize; 2]) -> [u8; N] {
        let start = places[usize::from(self.second)];
        let mut word = [0; N];
        word.copy_from_slice(&self.bytes[start..start + N]);
        if self.big {
            word.reverse();
        }
        word
    }

    fn short(&self, places: [usize; 2]) -> i16 {
        i16::from_le_bytes(self.at(places))
    }

    /// Returns a number that is single in the first version and double in the second.
    fn real(&self, [first, second]: [usize; 2], index: usize) -> f64 {
        if self.second {
            f64::from_le_bytes(self.at([0, second + 8 * index]))
        } else {
            f64::from(f32::from_le_bytes(self.at([first + 4 * index, 0])))
        }
    }

    /// Returns a number of 16 bits in the first version and 64 in the second.
    fn dim(&self, index: usize) -> i64 {
        if self.second {
            i64::from_le_bytes(self.at([0, 16 + 8 * index]))
        } else {
            i64::from(self.short([40 + 2 * index, 0]))
        }
    }

    /// Returns a code of 16 bits in the first version and 32 in the second.
    fn code(&self, [first, second]: [usize; 2]) -> i32 {
        if self.second {
            i32::from_le_bytes(self.at([0, second]))
        } else {
            i32::from(self.short([first, 0]))
        }
    }
}

impl Header {
    fn read(reader: &mut impl Read) -> Result<Self, Problem> {
        let fields = Fields::read(reader)?;
        let element = element(fields.short([70, 12]))?;
        let encoding = Encoding {
            element,
            big: fields.big,
        };
        let layout = fields.layout()?;
        let start = if fields.second {
            i64::from_le_bytes(fields.at([0, 168]))
        } else {
            fields.real([108, 0], 0) as i64
        };
        let read = fields.bytes.len() as u64;
        // Skip four bytes that indicate whether there are extensions.
        let start = u64::try_from(start).unwrap_or(0).max(read + 4);
        if start - read > MAX_SKIPPED {
            return Err(Problem::Malformed(format!(
                "its values begin at byte {start}"
            )));
        }
        let scaling = [fields.real([112, 176], 0), fields.real([116, 184], 0)];
        let is_scaled = scaling[0].is_finite() && scaling[0] != 0.0 && scaling != [1.0, 0.0];
        Ok(Header {
            encoding,
            layout,
            start,
            read,
            scaling: is_scaled.then_some(scaling),
            frame: fields.frame()?,
            unit: fields.unit(),
        })
    }

    /// Reads the values of the volume.
    fn volume<T: Sample>(
        &self,
        reader: &mut impl Read,
        size: u64,
        limits: Limits,
    ) -> Result<Volume<T>, Problem> {
        self.layout.check::<T>(limits, size)?;
        let skipped = std::io::copy(
            &mut reader.take(self.start - self.read),
            &mut std::io::sink(),
        );
        skipped.map_err(Problem::Read)?;
        let data = self.layout.read(reader, self.encoding)?;
        let volume = Volume::new(self.layout.size, self.layout.channels, data)?
            .with_frame(self.frame)
            .with_unit(self.unit.clone());
        match self.scaling {
            Some([slope, offset]) => volume.scaled(slope, offset),
            None => Ok(volume.with_element(self.encoding.element)),
        }
    }
}

impl Fields {
    fn read(reader: &mut impl Read) -> Result<Self, Problem> {
        let mut bytes = vec![0; NIFTI_1_HEADER];
        reader.read_exact(&mut bytes).map_err(short)?;
        let size = [bytes[0], bytes[1], bytes[2], bytes[3]];
        let sizes = [i32::from_le_bytes(size), i32::from_be_bytes(size)].map(|n| n as usize);
        let Some(k) = sizes
            .iter()
            .position(|n| [NIFTI_1_HEADER, NIFTI_2_HEADER].contains(n))
        else {
            return Err(bad(
                "it does not begin with the size of its header, 348 or 540",
            ));
        };
        let (big, second) = (k == 1, sizes[k] == NIFTI_2_HEADER);
        if second {
            bytes.resize(NIFTI_2_HEADER, 0);
            reader
                .read_exact(&mut bytes[NIFTI_1_HEADER..])
                .map_err(short)?;
        }
        let magic = if second {
            &bytes[4..8]
        } else {
            &bytes[344..348]
        };
        match magic {
            b"n+1\0" | b"n+2\0" => Ok(Fields { bytes, big, second }),
            b"ni1\0" | b"ni2\0" => {
                let message = "NIfTI with the values in an .img file of their own: convert it to one .nii file";
                Err(Problem::Unsupported(message.into()))
            }
            _ => Err(bad("its header has no magic 'n+1' or 'n+2'")),
        }
    }

    fn layout(&self) -> Result<Layout, Problem> {
        let axes = self.dim(0);
        if !(1..=7).contains(&axes) {
            return Err(Problem::Malformed(format!("{axes} axes in the header")));
        }
        let mut shape = [1usize; 7];
        for (i, length) in shape.iter_mut().enumerate().take(axes as usize) {
            let n = self.dim(i + 1);
            *length = usize::try_from(n)
                .map_err(|_| Problem::Malformed(format!("a size of {n} in the header")))?;
        }
        let beyond: Vec<usize> = shape[3..].iter().copied().filter(|n| *n != 1).collect();
        let channels = match beyond[..] {
            [] => 1,
            [channels] => channels,
            _ => {
                let found = format!(
                    "NIfTI with more than four axes: {}",
                    binary::product(&shape)
                );
                return Err(Problem::Unsupported(found));
            }
        };
        let [x, y, z, ..] = shape;
        let order: AxisOrder = "czyx".parse().map_err(Problem::Malformed)?;
        Layout::new(&[channels, z, y, x], false, order)
    }

    fn frame(&self) -> Result<VolumeFrame, Problem> {
        let spacing = DVec3::from_array([1, 2, 3].map(|i| match self.real([76, 104], i).abs() {
            0.0 => 1.0,
            length => length,
        }));
        let frame = if self.code([254, 348]) > 0 {
            let row = |i: usize| [0, 1, 2, 3].map(|k| self.real([280, 400], 4 * i + k));
            let [x, y, z] = [row(0), row(1), row(2)];
            let column = |k: usize| DVec3::new(x[k], y[k], z[k]);
            VolumeFrame {
                first: column(3),
                steps: DMat3::from_cols(column(0), column(1), column(2)),
                nodes: false,
            }
        } else if self.code([252, 344]) > 0 {
            let quaternion = DVec3::from_array([0, 1, 2].map(|i| self.real([256, 352], i)));
            let left = self.real([76, 104], 0) < 0.0;
            VolumeFrame {
                first: DVec3::from_array([3, 4, 5].map(|i| self.real([256, 352], i))),
                steps: turned(quaternion, spacing, left),
                nodes: false,
            }
        } else {
            VolumeFrame {
                first: DVec3::ZERO,
                steps: DMat3::from_diagonal(spacing),
                nodes: false,
            }
        };
        let sound = frame.is_sound().then_some(frame);
        sound.ok_or_else(|| Problem::Malformed("its voxels have no volume".into()))
    }

    fn unit(&self) -> Option<String> {
        let code = if self.second {
            i32::from_le_bytes(self.at([0, 500])) as u8
        } else {
            self.bytes[123]
        };
        Some(
            match code & 7 {
                1 => "m",
                2 => "mm",
                3 => "um",
                _ => return None,
            }
            .into(),
        )
    }
}

/// Returns the steps of samples that a quaternion turns, given by its imaginary parts. The third
/// axis is mirrored if the voxels are left-handed.
pub(super) fn turned(quaternion: DVec3, spacing: DVec3, left: bool) -> DMat3 {
    let v = quaternion;
    let w = (1.0 - v.length_squared()).max(0.0).sqrt();
    let turn = DMat3::from_quat(DQuat::from_xyzw(v.x, v.y, v.z, w).normalize());
    let spacing = if left {
        spacing.with_z(-spacing.z)
    } else {
        spacing
    };
    turn * DMat3::from_diagonal(spacing)
}

/// Codes of number types.
const CODES: [(i16, Element); 10] = [
    (2, Element::U8),
    (4, Element::I16),
    (8, Element::I32),
    (16, Element::F32),
    (64, Element::F64),
    (256, Element::I8),
    (512, Element::U16),
    (768, Element::U32),
    (1024, Element::I64),
    (1280, Element::U64),
];

/// Returns the type of numbers with a code.
fn element(code: i16) -> Result<Element, Problem> {
    let found = CODES.iter().find(|(known, _)| *known == code);
    let other = || Problem::Unsupported(format!("NIfTI with values of type {code}"));
    found.map(|(_, element)| *element).ok_or_else(other)
}

fn short(error: std::io::Error) -> Problem {
    match error.kind() {
        std::io::ErrorKind::UnexpectedEof => bad("it is shorter than its header"),
        _ => Problem::Read(error),
    }
}

fn bad(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "NIfTI",
        reason: reason.into(),
    }
}
