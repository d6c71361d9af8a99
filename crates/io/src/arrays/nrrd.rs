//! NRRD, nearly raw raster data, version 5: a text header, then the elements.
//! <https://teem.sourceforge.net/nrrd/format.html>

use super::{Array, ArrayPlacement, Arrays, plain};
use crate::atomic;
use crate::error::FileError;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Writes one array.
pub(super) fn write(path: &Path, arrays: &Arrays) -> Result<(), FileError> {
    let array = arrays.single().map_err(|problem| problem.at(path))?;
    let mut header = header(array, arrays.placement.as_ref());
    for (name, value) in &arrays.attributes {
        let value = plain(value).replace('\\', "\\\\").replace('\n', "\\n");
        let _ = writeln!(header, "{name}:={value}");
    }
    atomic::write(path, |file| {
        writeln!(file, "{header}")?;
        let mut elements = array.data.iter();
        elements.try_for_each(|value| file.write_all(&value.to_le_bytes()))
    })
}

/// Returns the header fields. They list axes from the fastest to the slowest.
fn header(array: &Array, placement: Option<&ArrayPlacement>) -> String {
    // A single number gets one axis.
    let (shape, axes) = if array.shape.is_empty() {
        (vec![1], vec!["value".to_owned()])
    } else {
        (array.shape.clone(), array.axes.clone())
    };
    let list = |words: Vec<String>| words.into_iter().rev().collect::<Vec<_>>().join(" ");
    let sizes = list(shape.iter().map(usize::to_string).collect());
    let labels = list(axes.iter().map(|axis| format!("\"{axis}\"")).collect());
    let centers = list(vec!["cell".to_owned(); shape.len()]);
    let mut text = format!("NRRD0005\ntype: double\ndimension: {}\n", shape.len());
    if let Some(place) = placement {
        let step = |axis: &String| {
            let found = place.steps.iter().find(|(name, _)| name == axis);
            found.map_or("none".to_owned(), |(_, step)| vector(step))
        };
        let directions = list(axes.iter().map(step).collect());
        let _ = write!(
            text,
            "space dimension: 3\nsizes: {sizes}\nspace directions: {directions}\nspace origin: {}\n",
            vector(&place.origin)
        );
    } else {
        let _ = writeln!(text, "sizes: {sizes}");
    }
    let _ = write!(
        text,
        "centers: {centers}\nlabels: {labels}\nendian: little\nencoding: raw\n"
    );
    let _ = writeln!(text, "name:={}\nunit:={}", array.name, array.unit);
    text
}

fn vector([x, y, z]: &[f64; 3]) -> String {
    format!("({x},{y},{z})")
}
