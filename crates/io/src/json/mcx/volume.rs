//! Labels of a volume, from a file and from shapes drawn into the volume.

use super::super::tree::{self, Json, Node};
use super::labels::Labels;
use super::{Reader, field, jdata, numbers, shapes};
use crate::draft;
use crate::element::Element;
use crate::input;
use crate::scene::Tensor;
use crate::volume::{AxisOrder, Format, Options, Volume};
use glam::DVec3;
use std::path::Path;

/// Returns the labels that a file describes; `None` after an error.
pub(super) fn labels(root: &Node, domain: &Node, reader: &mut Reader) -> Option<Labels> {
    let size = field(domain, "Dim").and_then(numbers).and_then(sizes);
    // Count the voxels of shapes from 1, unless positions count from 0, as MCX does.
    let from_zero = reader.number_or(domain, "OriginType", 0.0) != 0.0;
    let origin = if from_zero { DVec3::ZERO } else { DVec3::ONE };
    let mut labels = match field(domain, "VolumeFile") {
        Some(Node {
            json: Json::String(name),
            ..
        }) if name.is_empty() => None,
        Some(file) => Some(from_file(file, size, origin, reader)?),
        None => None,
    };
    if let Some(held) = field(domain, "Volume") {
        labels = Some(held_by(held, reader)?);
    }
    if labels.is_none() {
        labels = filled(size, domain, reader)?;
    }
    if let Some(shapes) = field(root, "Shapes") {
        labels = drawn(shapes, labels, origin, reader);
    }
    if labels.is_none() {
        reader.error(
            domain,
            "Domain needs a VolumeFile or Shapes, and Dim, the numbers of voxels",
        );
    }
    labels
}

/// Returns a volume of label 0 if a size is given; `None` after an error.
fn filled(size: Option<[usize; 3]>, at: &Node, reader: &mut Reader) -> Option<Option<Labels>> {
    let labels = size.map(|size| Labels::filled(size, 0.0, reader.limits));
    labels
        .transpose()
        .map_err(|e| reader.error(at, format!("Dim: {e}")))
        .ok()
}

/// Draws shapes over labels, or reads an array that replaces the labels.
fn drawn(
    shapes: &Node,
    start: Option<Labels>,
    origin: DVec3,
    reader: &mut Reader,
) -> Option<Labels> {
    if jdata::is_one(shapes) {
        annotated(shapes, reader)
    } else {
        shapes::draw(shapes, start, origin, reader)
    }
}

/// Returns the labels in an array `[x, y, z]` that a program hands over.
fn held_by(held: &Node, reader: &mut Reader) -> Option<Labels> {
    match &held.json {
        Json::Tensor(_) | Json::Array(_) => {
            let array = reader.array(held)?;
            from_array(&array, held, reader)
        }
        _ if jdata::is_one(held) => annotated(held, reader),
        _ => {
            reader.error(held, "Volume must be an array of labels [x, y, z]");
            None
        }
    }
}

/// Returns the labels in a JData array `[x, y, z]`.
fn annotated(node: &Node, reader: &mut Reader) -> Option<Labels> {
    let array = jdata::array(node, reader)?;
    if !array.element.is_integer() || array.tensor.shape().len() != 3 {
        let message = "a volume must be an array [x, y, z] of labels, which are whole numbers: morgana does not support coefficients of voxels";
        reader.error(node, message);
        return None;
    }
    from_array(&array.tensor, node, reader)
}

fn from_array(tensor: &Tensor, at: &Node, reader: &mut Reader) -> Option<Labels> {
    let volume = Volume::<f32>::of_tensor(tensor, AxisOrder::XYZ);
    let volume = volume
        .map_err(|e| reader.error(at, format!("labels: {e}")))
        .ok()?;
    let size = volume.size();
    let data = volume.into_data();
    Some(Labels { size, data })
}

fn sizes(numbers: Vec<f64>) -> Option<[usize; 3]> {
    let whole = |v: &f64| (v.fract() == 0.0 && *v >= 1.0).then_some(*v as usize);
    let sizes: Vec<usize> = numbers.iter().map(whole).collect::<Option<_>>()?;
    sizes.try_into().ok()
}

/// Reads labels from a file of shapes, of raw bytes, or of another known format.
fn from_file(
    file: &Node,
    size: Option<[usize; 3]>,
    origin: DVec3,
    reader: &mut Reader,
) -> Option<Labels> {
    let Json::String(name) = &file.json else {
        reader.error(file, "VolumeFile must be the name of a file");
        return None;
    };
    let path = file.location.source().directory().join(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let read = match extension.to_ascii_lowercase().as_str() {
        "json" => return from_shapes(&path, (file, size), origin, reader),
        "bin" => raw(&path, size),
        _ if Format::of(&path).is_some() => known(&path),
        _ => Err(format!(
            "{}: unknown format: a VolumeFile is .json with shapes, .bin with a byte for each voxel, or another volume file",
            path.display()
        )),
    };
    read.map_err(|message| reader.error(file, message)).ok()
}

fn from_shapes(
    path: &Path,
    (file, size): (&Node, Option<[usize; 3]>),
    origin: DVec3,
    reader: &mut Reader,
) -> Option<Labels> {
    let errors = reader.diagnostics.error_count();
    let source = draft::read(path)
        .map_err(|d| reader.diagnostics.push(d))
        .ok()?;
    let root = tree::parse(&source, reader.diagnostics)?;
    if reader.diagnostics.error_count() > errors {
        return None;
    }
    let Some(shapes) = field(&root, "Shapes") else {
        reader.error(file, format!("{}: the file needs Shapes", path.display()));
        return None;
    };
    let start = filled(size, file, reader)?;
    drawn(shapes, start, origin, reader)
}

/// Reads a byte for each voxel; x runs fastest.
fn raw(path: &Path, size: Option<[usize; 3]>) -> Result<Labels, String> {
    let size = size.ok_or("Domain needs the numbers of voxels, Dim")?;
    let bytes = input::read(path).map_err(|e| e.to_string())?;
    let [x, y, z] = size;
    let count = x.checked_mul(y).and_then(|n| n.checked_mul(z));
    if count != Some(bytes.len()) {
        return Err(format!(
            "{}: the file has {} bytes, but Dim states {x} x {y} x {z} voxels of a byte each",
            path.display(),
            bytes.len()
        ));
    }
    let mut data = Vec::with_capacity(bytes.len());
    Element::U8.decode(&bytes, &mut |v| data.push(v as f32));
    Ok(Labels { size, data })
}

fn known(path: &Path) -> Result<Labels, String> {
    let volume = Volume::<f32>::read(path, Options::default()).map_err(|e| e.to_string())?;
    if volume.channels() != 1 {
        return Err(format!("{}: labels must have one channel", path.display()));
    }
    let size = volume.size();
    let data = volume.into_data();
    Ok(Labels { size, data })
}
