//! Writing of `.vti` files.

use std::io::Write;
use std::path::Path;

use glam::{DMat3, DVec3};

use super::payload::word;
use crate::atomic;
use crate::element::Encoding;
use crate::error::FileError;
use crate::volume::{Format, Sample, Volume};

/// Writes a volume as the array `name`, as raw appended data. Values belong to points if the
/// outermost samples lie on the faces of the box, else to cells.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    let element = Format::Vti.element(volume.element());
    let bytes = volume.data().len() as u64 * element.size() as u64;
    let values = volume.data().iter().map(|v| v.wide());
    atomic::write(path, |file| {
        write!(file, "{}", header(volume, name, word(element)))?;
        file.write_all(&bytes.to_le_bytes())?;
        Encoding::little(element).write(file, values)?;
        write!(file, "\n  </AppendedData>\n</VTKFile>\n")
    })
}

fn header<T: Sample>(volume: &Volume<T>, name: &str, kind: &str) -> String {
    let frame = volume.place();
    let spacing = frame.spacing();
    let direction = frame.steps * DMat3::from_diagonal(spacing.recip());
    // Compute VTK's origin, which is the corner of a cell.
    let (group, origin, less) = if frame.nodes {
        ("PointData", frame.first, 1)
    } else {
        ("CellData", frame.first - frame.steps * DVec3::splat(0.5), 0)
    };
    let extent = volume.size().map(|n| format!("0 {}", n - less)).join(" ");
    let direction = direction.transpose().to_cols_array().map(|v| v.to_string());
    let numbers = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    format!(
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <ImageData WholeExtent="{extent}" Origin="{}" Spacing="{}" Direction="{}">
    <Piece Extent="{extent}">
      <{group} Scalars="{name}">
        <DataArray type="{kind}" Name="{name}" NumberOfComponents="{}" format="appended" offset="0"/>
      </{group}>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"#,
        numbers(origin),
        numbers(spacing),
        direction.join(" "),
        volume.channels()
    )
}
