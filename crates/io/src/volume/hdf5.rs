//! Volumes as datasets of HDF5 files, such as those of k-Wave.

use std::io;
use std::path::Path;

use glam::DVec3;
use hdf5_reader::{ByteOrder, Dataset, Datatype, Hdf5File, OpenOptions};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, Hdf5Writer, WriteOptions};

use super::layout::Layout;
use super::{AxisOrder, Format, INFLATION, Options, Sample, Volume, npy};
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::{atomic, input};

/// Reads a volume from the dataset whose path in the file is given: an array of three axes, or four with
/// channels. `dx`, `dy` and `dz` beside it, as k-Wave has them, become the volume's box.
///
/// # Errors
///
/// A file that cannot be read, or is no HDF5 file; a dataset or axis order that is not given; a dataset that the
/// file does not have, or that has another number of axes or other elements than numbers; NaN or infinite
/// values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (_, size) = input::open(path)?;
    let file = Hdf5File::open_with_options(path, limits(size, options)).map_err(describe);
    file.and_then(|file| volume(&file, options, size))
        .map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let size = bytes.len() as u64;
    let file = Hdf5File::from_bytes_with_options(bytes, limits(size, options)).map_err(describe)?;
    volume(&file, options, size)
}

/// No more memory than a file of `size` bytes may take, or compressed data in it can need.
fn limits(size: u64, options: Options) -> OpenOptions {
    let most = size
        .saturating_mul(INFLATION)
        .min(options.limits.most(size));
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    OpenOptions::default()
        .with_max_chunk_bytes(most)
        .with_max_read_bytes(most)
}

/// The volume in a file of `size` bytes.
fn volume<T: Sample>(file: &Hdf5File, options: Options, size: u64) -> Result<Volume<T>, Problem> {
    let Some(name) = options.dataset else {
        let names = file.root_group().and_then(|group| group.member_names());
        let names = names.map_or(String::new(), |(_, names)| names.join(", "));
        let message = format!(
            "it may hold several: give a dataset (--dataset, or 'dataset' in a scene); those of '/': {names}"
        );
        return Err(Problem::Unsaid(message));
    };
    let data = file.dataset(name).map_err(|e| missing(file, name, e))?;
    let (encoding, complex) = encoding(&data)?;
    let shape: Option<Vec<usize>> = data.shape().iter().map(|n| (*n).try_into().ok()).collect();
    let too_large = || Problem::TooLarge(format!("an array of {:?}", data.shape()));
    let mut shape = shape.ok_or_else(too_large)?;
    shape.extend(complex.then_some(2));
    let layout = match whole_grid(file, &shape)? {
        Some(shape) => Layout::new(&shape, false, AxisOrder::CZYX)?,
        None => Layout::new(&shape, false, options.axes()?)?,
    };
    // The values, and what they are made of.
    let each = size_of::<T>() + encoding.element.size();
    options
        .limits
        .check(layout.count() as u64, each as u64, size)?;
    let bytes = data.read_raw_bytes().map_err(describe)?;
    let values = layout.read(&mut &bytes[..], encoding)?;
    let volume = Volume::new(layout.size, layout.channels, values)?;
    let volume = volume.with_element(encoding.element);
    let volume = volume.with_time_step(number(file, "dt").filter(|v| *v > 0.0));
    Ok(match spacing(file) {
        Some(spacing) => {
            let size = DVec3::from_array(layout.size.map(|n| n as f64));
            volume.with_bbox([DVec3::ZERO, size * spacing])
        }
        None => volume,
    })
}

/// What the datasets `dx`, `dy` and `dz` of k-Wave say, in metres.
fn spacing(file: &Hdf5File) -> Option<DVec3> {
    let number = |name| number(file, name).filter(|v| *v > 0.0);
    Some(DVec3::new(number("dx")?, number("dy")?, number("dz")?))
}

/// A dataset that is a finite number.
fn number(file: &Hdf5File, name: &str) -> Option<f64> {
    let data = file.dataset(name).ok()?;
    let (encoding, _) = encoding(&data).ok()?;
    let bytes = (data.num_elements().ok()? == 1).then(|| data.read_raw_bytes().ok());
    let mut number = None;
    let sink = |v: f64| number = Some(v);
    encoding.read(&mut &bytes??[..], 1, sink).ok()?;
    number.filter(|v| v.is_finite())
}

/// The shape `[t, z, y, x]` of an array `[1, t, point]` of k-Wave's, whose sensor has recorded at the points of a mask, if these are all points of its
/// grid.
fn whole_grid(file: &Hdf5File, shape: &[usize]) -> Result<Option<[usize; 4]>, Problem> {
    let size = ["Nz", "Ny", "Nx"].map(|name| number(file, name).map(|n| n as usize));
    let ([1, times, points], [Some(z), Some(y), Some(x)]) = (shape, size) else {
        return Ok(None);
    };
    if [z, y, x] == [1, *times, *points] {
        return Ok(None);
    }
    if z.checked_mul(y).and_then(|n| n.checked_mul(x)) == Some(*points) {
        return Ok(Some([*times, z, y, x]));
    }
    Err(Problem::Mismatch {
        expected: format!(
            "pressure at all {x} x {y} x {z} points of k-Wave's grid, or in a cuboid"
        ),
        found: format!("{points} points of a mask"),
    })
}

/// The numbers of a dataset, and whether each element is two of them: a complex number, as h5py writes it.
fn encoding(data: &Dataset) -> Result<(Encoding, bool), Problem> {
    if let Datatype::Compound { size, fields } = data.dtype()
        && let [re, im] = &fields[..]
        && re.datatype == im.datatype
        && let Ok(part) = real(&re.datatype)
        && [re.byte_offset as usize, im.byte_offset as usize] == [0, part.element.size()]
        && *size as usize == 2 * part.element.size()
    {
        return Ok((part, true));
    }
    Ok((real(data.dtype())?, false))
}

fn real(datatype: &Datatype) -> Result<Encoding, Problem> {
    let (element, order) = match datatype {
        Datatype::FloatingPoint { size, byte_order } => {
            let floats = [Element::F16, Element::F32, Element::F64];
            let same = |element: &Element| element.size() == usize::from(*size);
            (floats.into_iter().find(same), byte_order)
        }
        Datatype::FixedPoint {
            size,
            signed,
            byte_order,
        } => (Element::integer(usize::from(*size), *signed), byte_order),
        _ => (None, &ByteOrder::LittleEndian),
    };
    let big = matches!(order, ByteOrder::BigEndian);
    let encoding = element.map(|element| Encoding { element, big });
    encoding.ok_or_else(|| Problem::Mismatch {
        expected: "a dataset of numbers".into(),
        found: "other elements".into(),
    })
}

/// Writes a volume as the dataset `name`, an array in the order of [`npy::write`].
///
/// # Errors
///
/// Everything that [`atomic::write()`] reports, and what is no name of a dataset.
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    atomic::write(path, |file| {
        let shape: Vec<u64> = npy::shape(volume).iter().map(|n| *n as u64).collect();
        let element = Format::Hdf5.element(volume.element());
        let mut bytes = Vec::with_capacity(volume.data().len() * element.size());
        let values = volume.data().iter().map(|v| v.wide());
        Encoding::little(element).write(&mut bytes, values)?;
        let dataset = DatasetBuilder::new(name, datatype(element), shape).raw_data(bytes);
        let plan = Hdf5Builder::new().dataset(dataset).into_plan();
        let writer = Hdf5Writer::new(file, WriteOptions::default());
        plan.and_then(|plan| writer.finish(plan))
            .map_err(io::Error::other)?;
        Ok(())
    })
}

fn datatype(element: Element) -> Datatype {
    let (size, byte_order) = (element.size() as u8, ByteOrder::LittleEndian);
    if element.is_integer() {
        Datatype::FixedPoint {
            size,
            signed: element.name().starts_with('i'),
            byte_order,
        }
    } else {
        Datatype::FloatingPoint { size, byte_order }
    }
}

/// Says which datasets there are beside the one that is not.
fn missing(file: &Hdf5File, dataset: &str, error: hdf5_reader::error::Error) -> Problem {
    let folder = dataset
        .trim_matches('/')
        .rsplit_once('/')
        .map_or("", |p| p.0);
    let group = match folder {
        "" => file.root_group(),
        path => file.group(path),
    };
    match group.and_then(|group| group.member_names()) {
        Ok((_, names)) if !names.is_empty() => Problem::Malformed(format!(
            "no dataset '{dataset}' ({error}); datasets of '/{folder}': {}",
            names.join(", ")
        )),
        _ => Problem::Malformed(format!("no dataset '{dataset}' ({error})")),
    }
}

fn describe(error: hdf5_reader::error::Error) -> Problem {
    Problem::WrongFormat {
        format: "HDF5",
        reason: error.to_string(),
    }
}
