//! Writing of volumes.

use std::path::Path;

use super::{
    AxisOrder, Format, GridData, Sample, Volume, hdf5, jnifti, mat, nifti, npy, npz, nrrd, vol,
    vti, vtk,
};
use crate::element::Element;
use crate::error::{FileError, Problem};

/// Properties of a written volume file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// Number type in the file.
    pub element: Element,
    /// Largest change of a value by rounding to this type.
    pub rounding: f64,
    /// True if the file states the position of the samples.
    pub place: bool,
    /// Order of axes for reading the file, if its format does not state it.
    pub axes: Option<AxisOrder>,
}

/// Writes a volume in the format of the extension, completely or not at all. The number type comes
/// from the volume's file, if the format has it ([`Format::element`]). The array is called `name`,
/// if the format has names.
///
/// # Errors
///
/// An unknown extension. A value beyond the range of the type. A name with other characters than
/// letters, digits, `_`, `-` and `.`. The errors of the format's own function.
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<Stored, FileError> {
    let format = Format::of(path).ok_or_else(|| Format::unknown().at(path))?;
    let stored = stored(format, volume).map_err(|problem| problem.at(path))?;
    let letters = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    if name.is_empty() || !name.chars().all(letters) {
        let message =
            format!("'{name}' as the name of an array: use letters, digits, '_', '-' and '.'");
        return Err(Problem::Unsupported(message).at(path));
    }
    match format {
        Format::Vol => vol::write(path, volume),
        Format::Npy => npy::write(path, volume),
        Format::Npz => npz::write(path, volume, name),
        Format::Hdf5 => hdf5::write(path, volume, name),
        Format::Mat => mat::write(path, volume, name),
        Format::Nrrd => nrrd::write(path, volume),
        Format::Vti => vti::write(path, &GridData::of_volume(volume, name)),
        Format::Vtk => vtk::write(path, volume, name),
        Format::Nifti => nifti::write(path, &GridData::of_volume(volume, name)),
        Format::Jnifti | Format::Jdata => jnifti::write(path, &GridData::of_volume(volume, name)),
        Format::Vdb => Err(Format::unknown().at(path)),
    }?;
    Ok(stored)
}

fn stored<T: Sample>(format: Format, volume: &Volume<T>) -> Result<Stored, Problem> {
    let element = format.element(volume.element());
    let mut rounding: f64 = 0.0;
    for v in volume.data().iter().map(|v| v.wide()) {
        let change = (element.nearest(v) - v).abs();
        if !change.is_finite() || (element.is_integer() && change > 0.5) {
            return Err(Problem::TooLarge(format!(
                "{v} as a number of type {element}"
            )));
        }
        rounding = rounding.max(change);
    }
    let turned = !volume.place().is_aligned();
    Ok(Stored {
        element,
        rounding,
        place: match format {
            Format::Nrrd | Format::Vti | Format::Nifti | Format::Jnifti => true,
            Format::Vol | Format::Vtk => !turned,
            _ => false,
        },
        axes: match format {
            Format::Npy | Format::Npz | Format::Hdf5 => Some(AxisOrder::ZYX),
            Format::Mat | Format::Jdata => Some(AxisOrder::XYZ),
            _ => None,
        },
    })
}
