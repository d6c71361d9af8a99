//! Writing of `.vti` files.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use glam::{DMat3, DVec3};

use super::payload::word;
use crate::atomic;
use crate::element::Encoding;
use crate::error::FileError;
use crate::volume::{Format, GridData, GridField, Sample};

/// Writes all arrays of a grid, as raw appended data. Values belong to points if the outermost
/// samples lie on the faces of the box, else to cells. Axes except x, y and z become components.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, grid: &GridData<T>) -> Result<(), FileError> {
    let element = Format::Vti.element(grid.element);
    atomic::write(path, |file| {
        write!(file, "{}", header(grid))?;
        for array in &grid.arrays {
            let count = grid.size.iter().product::<usize>() * array.components();
            let bytes = (count * element.size()) as u64;
            file.write_all(&bytes.to_le_bytes())?;
            Encoding::little(element).write(file, array.by_sample(grid.size))?;
        }
        write!(file, "\n  </AppendedData>\n</VTKFile>\n")
    })
}

fn header<T: Sample>(grid: &GridData<T>) -> String {
    let frame = grid.frame;
    let spacing = frame.spacing();
    let direction = frame.steps * DMat3::from_diagonal(spacing.recip());
    // Compute VTK's origin, which is the corner of a cell.
    let (group, origin, less) = if frame.nodes {
        ("PointData", frame.first, 1)
    } else {
        ("CellData", frame.first - frame.steps * DVec3::splat(0.5), 0)
    };
    let extent = grid.size.map(|n| format!("0 {}", n - less)).join(" ");
    let direction = direction.transpose().to_cols_array().map(|v| v.to_string());
    let numbers = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    format!(
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <ImageData WholeExtent="{extent}" Origin="{}" Spacing="{}" Direction="{}">
{}    <Piece Extent="{extent}">
      <{group} Scalars="{}">
{}      </{group}>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"#,
        numbers(origin),
        numbers(spacing),
        direction.join(" "),
        fields(&grid.fields),
        grid.arrays.first().map_or("", |array| array.name),
        arrays(grid),
    )
}

/// Makes the elements of the arrays.
fn arrays<T: Sample>(grid: &GridData<T>) -> String {
    let element = Format::Vti.element(grid.element);
    let samples: usize = grid.size.iter().product();
    let (mut text, mut offset) = (String::new(), 0);
    for array in &grid.arrays {
        let components = array.components();
        let labels = array.labels().into_iter().enumerate();
        let labels: String = labels
            .map(|(i, label)| format!(r#" ComponentName{i}="{}""#, escaped(&label)))
            .collect();
        let _ = writeln!(
            text,
            r#"        <DataArray type="{}" Name="{}" NumberOfComponents="{components}"{labels} format="appended" offset="{offset}"/>"#,
            word(element),
            escaped(array.name),
        );
        offset += size_of::<u64>() + samples * components * element.size();
    }
    text
}

/// Makes the element of further properties. Texts are lists of their bytes, which end with 0.
fn fields(fields: &[(String, GridField)]) -> String {
    if fields.is_empty() {
        return String::new();
    }
    let mut text = "    <FieldData>\n".to_owned();
    for (name, field) in fields {
        let name = escaped(name);
        let _ = match field {
            GridField::Numbers(numbers) => {
                let count = numbers.len();
                let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
                let numbers = numbers.join(" ");
                writeln!(
                    text,
                    r#"      <DataArray type="Float64" Name="{name}" NumberOfTuples="{count}" format="ascii">{numbers}</DataArray>"#
                )
            }
            GridField::Text(words) => {
                let bytes: Vec<String> = words.bytes().chain([0]).map(|b| b.to_string()).collect();
                let bytes = bytes.join(" ");
                writeln!(
                    text,
                    r#"      <Array type="String" Name="{name}" NumberOfTuples="1" format="ascii">{bytes}</Array>"#
                )
            }
        };
    }
    text.push_str("    </FieldData>\n");
    text
}

/// Returns a text as the value of an XML attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
