//! Writing of datasets.

use std::io;
use std::path::Path;

use hdf5_reader::{ByteOrder, Datatype};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, Hdf5Writer, WriteOptions};

use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::FileError;
use crate::volume::{Format, Sample, Volume, npy};

/// Writes a volume as the dataset `name`, an array in the order of [`npy::write`].
///
/// # Errors
///
/// All errors of [`atomic::write()`], and an invalid name of a dataset.
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
