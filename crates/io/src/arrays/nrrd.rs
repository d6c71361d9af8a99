//! NRRD, nearly raw raster data, version 5: a text header, then the elements.
//! <https://teem.sourceforge.net/nrrd/format.html>

use super::grid::SPACE;
use super::{Array, Arrays, plain};
use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::FileError;
use crate::volume::VolumeFrame;
use glam::DVec3;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Writes one array, with the position of its cells if they lie in space.
pub(super) fn write(
    path: &Path,
    arrays: &Arrays,
    array: &Array,
    element: Element,
) -> Result<(), FileError> {
    let place = arrays.place(array).map_err(|problem| problem.at(path))?;
    let mut header = header(array, place, element);
    if place.is_some()
        && let Some(unit) = arrays.metres_per_unit(array).and_then(unit_of)
    {
        let _ = writeln!(header, "space units: \"{unit}\" \"{unit}\" \"{unit}\"");
    }
    let _ = writeln!(header, "name:={}\nunit:={}", array.name, array.unit);
    for (name, value) in &arrays.attributes {
        let value = plain(value).replace('\\', "\\\\").replace('\n', "\\n");
        let _ = writeln!(header, "{name}:={value}");
    }
    atomic::write(path, |file| {
        writeln!(file, "{header}")?;
        Encoding::little(element).write(file, array.data.iter().copied())
    })
}

/// Returns the name of a unit of length in m, if it has one.
fn unit_of(metres: f64) -> Option<&'static str> {
    let known = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)];
    let found = known.into_iter().find(|(_, length)| *length == metres);
    found.map(|(name, _)| name)
}

/// Returns the header fields. They list axes from the fastest to the slowest.
fn header(array: &Array, place: Option<VolumeFrame>, element: Element) -> String {
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
    let kind = if element == Element::F32 {
        "float"
    } else {
        "double"
    };
    let mut text = format!("NRRD0005\ntype: {kind}\ndimension: {}\n", shape.len());
    if let Some(place) = place {
        let step = |axis: &String| {
            let found = SPACE.iter().position(|name| name == axis);
            found.map_or("none".to_owned(), |i| vector(place.steps.col(i)))
        };
        let directions = list(axes.iter().map(step).collect());
        let _ = write!(
            text,
            "space dimension: 3\nsizes: {sizes}\nspace directions: {directions}\nspace origin: {}\n",
            vector(place.first)
        );
    } else {
        let _ = writeln!(text, "sizes: {sizes}");
    }
    let _ = write!(
        text,
        "centers: {centers}\nlabels: {labels}\nendian: little\nencoding: raw\n"
    );
    text
}

fn vector(DVec3 { x, y, z }: DVec3) -> String {
    format!("({x},{y},{z})")
}
