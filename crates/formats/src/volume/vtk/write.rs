//! Writing of `.vtk` files.

use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::word;
use crate::atomic;
use crate::element::Encoding;
use crate::error::FileError;
use crate::volume::{Format, Sample, Volume, VolumeFrame};

/// Maximum number of components of VTK's scalars.
const SCALARS: usize = 4;

/// Writes a volume as the array `name`, in binary. Values belong to points if the outermost samples
/// lie on the faces of the box, else to cells. The format has only steps along x, y and z: of other
/// steps, only the lengths are kept.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    let element = Format::Vtk.element(volume.element());
    let values = volume.data().iter().map(|v| v.wide());
    atomic::write(path, |file| {
        write!(file, "{}", header(volume, name, word(element)))?;
        Encoding::big(element).write(file, values)?;
        writeln!(file)
    })
}

fn header<T: Sample>(volume: &Volume<T>, name: &str, kind: &str) -> String {
    let VolumeFrame { first, nodes, .. } = volume.place();
    let spacing = volume.place().spacing();
    let (group, origin, more) = if nodes {
        ("POINT_DATA", first, 0)
    } else {
        ("CELL_DATA", first - 0.5 * spacing, 1)
    };
    let [x, y, z] = volume.size().map(|n| n + more);
    let voxels: usize = volume.size().iter().product();
    let numbers = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    let array = match volume.channels() {
        n if n <= SCALARS => format!("SCALARS {name} {kind} {n}\nLOOKUP_TABLE default"),
        n => format!("FIELD FieldData 1\n{name} {n} {voxels} {kind}"),
    };
    format!(
        "# vtk DataFile Version 3.0\nvolume\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS {x} {y} {z}\n\
         ORIGIN {}\nSPACING {}\n{group} {voxels}\n{array}\n",
        numbers(origin),
        numbers(spacing)
    )
}
