//! Volumes in datasets of HDF5 files, such as k-Wave's.

mod blocks;
mod elements;
mod kwave;
mod lzf;
mod root;
mod write;

use std::path::Path;

use glam::DVec3;
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};

use super::layout::Layout;
use super::series::{Adder, Plan, Series, SeriesShape};
use super::{AxisOrder, INFLATION, Options, Sample, Volume, VolumeFrame, metered};
use crate::element::Encoding;
use crate::error::{FileError, Problem};
use crate::input;
pub use blocks::BLOCK;
use elements::encoding;
pub use root::{StoredNumbers, numbers};
pub use write::write;

/// Reads a volume from the dataset with a given path in the file: an array of three axes, or four
/// with channels. If the file has `dx`, `dy` and `dz`, as k-Wave's files do, they give the volume's
/// box.
///
/// # Errors
///
/// A file that cannot be read, or is not an HDF5 file. A dataset or axis order that is not given. A
/// dataset that is missing, has another number of axes, or has elements that are not numbers. NaN
/// or infinite values.
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

/// Limits memory to what a file of `size` bytes may take, and to what its compressed data can need.
fn limits(size: u64, options: Options) -> OpenOptions {
    let most = size
        .saturating_mul(INFLATION)
        .min(options.limits.most(size));
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    OpenOptions::default()
        .with_filter_registry(lzf::filters(most))
        .with_max_chunk_bytes(most)
        .with_max_read_bytes(most)
}

/// Sums the frames of a dataset.
pub(super) fn read_series(
    path: &Path,
    options: Options,
    plan: &mut Plan,
) -> Result<Series, FileError> {
    let (_, size) = input::open(path)?;
    let file = Hdf5File::open_with_options(path, in_blocks(size, options)).map_err(describe);
    file.and_then(|file| series(&file, options, size, plan))
        .map_err(|problem| problem.at(path))
}

/// Sums the frames of a dataset in the bytes of a file.
///
/// # Errors
///
/// As for [`Series::read`].
pub fn parse_series(bytes: &[u8], options: Options, plan: &mut Plan) -> Result<Series, Problem> {
    let size = bytes.len() as u64;
    let open = in_blocks(size, options);
    let file = Hdf5File::from_bytes_with_options(bytes, open).map_err(describe)?;
    series(&file, options, size, plan)
}

/// Limits memory for reading in blocks: the cache of chunks is no larger than a block.
fn in_blocks(size: u64, options: Options) -> OpenOptions {
    limits(size, options).with_chunk_cache_bytes(BLOCK * size_of::<f64>())
}

/// Dataset to read, and the arrangement of the volume in it.
struct Stored {
    data: Dataset,
    encoding: Encoding,
    /// True if each element is two numbers.
    complex: bool,
    layout: Layout,
    /// Box of the cells around the samples, in the file's coordinates.
    bbox: Option<[DVec3; 2]>,
    /// Position of the samples in a file of a meter.
    metered: Option<VolumeFrame>,
}

impl Stored {
    fn of(file: &Hdf5File, options: Options) -> Result<Self, Problem> {
        let Some(name) = options.dataset else {
            let names = file.root_group().and_then(|group| group.member_names());
            let names = match names {
                Ok((_, names)) => format!("datasets of '/': {}", names.join(", ")),
                Err(error) => format!("datasets of '/' cannot be listed ({error})"),
            };
            let message = format!(
                "it may contain several datasets: choose one (--dataset, or 'dataset' in a scene); {names}"
            );
            return Err(Problem::Unsaid(message));
        };
        let data = file.dataset(name).map_err(|e| missing(file, name, e))?;
        let (encoding, complex) = encoding(&data)?;
        let shape: Option<Vec<usize>> = data.shape().iter().map(|n| (*n).try_into().ok()).collect();
        let too_large = || Problem::TooLarge(format!("an array of {:?}", data.shape()));
        let mut shape = shape.ok_or_else(too_large)?;
        shape.extend(complex.then_some(2));
        let recorded = kwave::recorded(file, name, &shape)?;
        let layout = match &recorded {
            Some(recorded) => {
                let own = [AxisOrder::ZYX, AxisOrder::CZYX];
                if options.axes.is_some_and(|axes| !own.contains(&axes)) {
                    let message =
                        "records of k-Wave have the order of axes czyx: leave out the order".into();
                    return Err(Problem::Unsupported(message));
                }
                recorded.layout
            }
            None => Layout::new(&shape, false, options.axes()?)?,
        };
        let first = recorded.map_or(DVec3::ZERO, |recorded| recorded.first());
        let size = DVec3::from_array(layout.size.map(|n| n as f64));
        let numbers = |name: &str, count| elements::numbers(file, name, count);
        Ok(Stored {
            metered: metered::place(name, layout.size, numbers),
            data,
            encoding,
            complex,
            layout,
            bbox: kwave::spacing(file).map(|spacing| [first * spacing, (first + size) * spacing]),
        })
    }

    /// Adds the file's metadata to a volume.
    fn record<T: Sample>(&self, volume: Volume<T>) -> Volume<T> {
        let volume = volume.with_element(self.encoding.element);
        let volume = volume.with_mentioned(self.metered);
        match self.bbox {
            Some(bbox) => volume.with_box_of_cells(bbox),
            None => volume,
        }
    }
}

/// Reads the volume in a file of `size` bytes.
fn volume<T: Sample>(file: &Hdf5File, options: Options, size: u64) -> Result<Volume<T>, Problem> {
    let stored = Stored::of(file, options)?;
    let layout = &stored.layout;
    // Check the memory for the values, and for the elements from which they are made.
    let each = size_of::<T>() + stored.encoding.element.size();
    options
        .limits
        .check(layout.count() as u64, each as u64, size)?;
    let bytes = stored.data.read_raw_bytes().map_err(describe)?;
    let values = layout.read(&mut &bytes[..], stored.encoding)?;
    let volume = Volume::new(layout.size, layout.channels, values)?;
    Ok(stored.record(volume))
}

/// Reads the sums of a series in a file of `size` bytes.
fn series(
    file: &Hdf5File,
    options: Options,
    size: u64,
    plan: &mut Plan,
) -> Result<Series, Problem> {
    let stored = Stored::of(file, options)?;
    let layout = &stored.layout;
    let shape = SeriesShape {
        frames: layout.channels,
        time_step: kwave::time_step(file),
    };
    let permit = |count, each| options.limits.check(count, each, size);
    let mut adder = Adder::new(layout.size, shape, plan, permit)?;
    let each = stored.encoding.element.size() as u64;
    let bytes = (layout.count() as u64).saturating_mul(each);
    if bytes
        > size
            .saturating_mul(INFLATION)
            .max(options.limits.most(size))
    {
        return Err(Problem::Truncated {
            expected: bytes,
            found: size,
        });
    }
    if stored.complex {
        let bytes = stored.data.read_raw_bytes().map_err(describe)?;
        let mut targets = layout.targets();
        let read = stored.encoding.read(&mut &bytes[..], layout.count(), |v| {
            if let Some(target) = targets.next() {
                adder.add(target, v);
            }
        });
        read.map_err(Problem::Read)?;
    } else {
        let used = adder.used();
        blocks::each(&stored.data, layout, used, |target, v| adder.add(target, v))?;
    }
    let series = adder.finish()?;
    Ok(Series {
        sums: stored.record(series.sums),
        ..series
    })
}

/// Makes a message that lists the existing datasets beside the missing one.
fn missing(file: &Hdf5File, dataset: &str, error: hdf5_reader::error::Error) -> Problem {
    if is_virtual(&error) {
        return describe(error);
    }
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
        Err(of_listing) => Problem::Malformed(format!(
            "no dataset '{dataset}' ({error}); datasets of '/{folder}' cannot be listed ({of_listing})"
        )),
        _ => Problem::Malformed(format!("no dataset '{dataset}' ({error})")),
    }
}

/// Layout class of virtual datasets.
const VIRTUAL: u8 = 3;

/// Returns true if a dataset was rejected because it is virtual.
fn is_virtual(error: &hdf5_reader::error::Error) -> bool {
    use hdf5_reader::error::Error::{Context, UnsupportedLayoutClass};
    match error {
        Context { source, .. } => is_virtual(source),
        UnsupportedLayoutClass(class) => *class == VIRTUAL,
        _ => false,
    }
}

fn describe(error: hdf5_reader::error::Error) -> Problem {
    use hdf5_reader::error::Error::{Context, UnsupportedFilter};
    match error {
        error if is_virtual(&error) => Problem::Unsupported(
            "virtual datasets, which are parts of other files: copy the numbers into a dataset of \
             their own, as h5py does with file.create_dataset(name, data=virtual[:])"
                .into(),
        ),
        Context { source, .. } if matches!(*source, UnsupportedFilter(_)) => describe(*source),
        UnsupportedFilter(filter) => Problem::Unsupported(format!(
            "morgana does not support the filter {filter} of the dataset: store it with gzip, or without compression"
        )),
        error => Problem::WrongFormat {
            format: "HDF5",
            reason: error.to_string(),
        },
    }
}
