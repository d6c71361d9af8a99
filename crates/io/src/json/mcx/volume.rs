//! Labels or coefficients of a volume, from a file, and shapes drawn into the volume.

use super::super::tree::{self, Json, Node};
use super::coefficients::{Base, Coefficients, MediaFormat};
use super::labels::Labels;
use super::{Properties, Reader, field, jdata, numbers, shapes};
use crate::draft;
use crate::input::{self, Limits};
use crate::scene::Tensor;
use crate::volume::{AxisOrder, Format, Options, Volume};
use glam::DVec3;
use std::path::Path;

/// Voxels of a volume.
pub(super) enum Voxels {
    Labels(Labels),
    Coefficients(Coefficients),
}

impl Voxels {
    /// Returns the labels; with coefficients, label 0 is outside.
    pub(super) fn labels(&self) -> &Labels {
        match self {
            Voxels::Labels(labels) => labels,
            Voxels::Coefficients(coefficients) => &coefficients.labels,
        }
    }
}

/// Content of a volume as the domain states it.
struct Stated<'a> {
    size: Option<[usize; 3]>,
    /// Coordinates of the first voxel's corner.
    origin: DVec3,
    format: MediaFormat,
    /// True if z runs fastest in raw files.
    rows_first: bool,
    properties: Properties<'a>,
}

/// Returns the voxels that a file describes; `None` after an error.
pub(super) fn voxels(
    root: &Node,
    domain: &Node,
    properties: Properties,
    reader: &mut Reader,
) -> Option<Voxels> {
    // Count the voxels of shapes from 1, unless positions count from 0, as MCX does.
    let from_zero = reader.number_or(domain, "OriginType", 0.0) != 0.0;
    let stated = Stated {
        size: field(domain, "Dim").and_then(numbers).and_then(sizes),
        origin: if from_zero { DVec3::ZERO } else { DVec3::ONE },
        format: format(domain, reader)?,
        rows_first: rows_first(domain, reader)?,
        properties,
    };
    let mut voxels = match field(domain, "VolumeFile") {
        Some(Node {
            json: Json::String(name),
            ..
        }) if name.is_empty() => None,
        Some(file) => Some(from_file(file, &stated, reader)?),
        None => None,
    };
    if let Some(held) = field(domain, "Volume") {
        voxels = Some(held_by(held, &stated, reader)?);
    }
    if voxels.is_none() {
        voxels = filled(stated.size, domain, reader)?.map(Voxels::Labels);
    }
    if let Some(shapes) = field(root, "Shapes") {
        voxels = drawn(shapes, voxels, &stated, reader);
    }
    if voxels.is_none() {
        reader.error(
            domain,
            "Domain needs a VolumeFile or Shapes, and Dim, the numbers of voxels",
        );
    }
    voxels
}

/// Returns the layout of voxels; `None` after an error.
fn format(domain: &Node, reader: &mut Reader) -> Option<MediaFormat> {
    let Some(value) = field(domain, "MediaFormat") else {
        return Some(MediaFormat::Byte);
    };
    let found = MediaFormat::of(value);
    if found.is_none() {
        let message = "MediaFormat must be byte, short, integer, mua_float, muamus_float, muamus_half, muamus_short, asgn_float \
                       or asgn_byte; for svmc, mixlabel and labelplus give the labels, and surface smooth in a scene of your own";
        reader.error(value, message);
    }
    found
}

/// Returns true if z runs fastest in raw files (`ArrayOrder`, option -a of MCX); `None` after an
/// error.
fn rows_first(domain: &Node, reader: &mut Reader) -> Option<bool> {
    let Some(value) = field(domain, "ArrayOrder") else {
        return Some(false);
    };
    match &value.json {
        Json::String(order) if order == "r" => Some(true),
        Json::String(order) if order == "c" => Some(false),
        _ => {
            reader.error(
                value,
                "ArrayOrder must be c (x runs fastest) or r (z runs fastest)",
            );
            None
        }
    }
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
    start: Option<Voxels>,
    stated: &Stated,
    reader: &mut Reader,
) -> Option<Voxels> {
    if jdata::is_one(shapes) {
        return annotated(shapes, stated, reader);
    }
    let labels = match start {
        Some(Voxels::Labels(labels)) => Some(labels),
        None => None,
        Some(Voxels::Coefficients(_)) => {
            reader.error(
                shapes,
                "shapes have labels, which a volume of coefficients does not have: draw them into the volume before",
            );
            return None;
        }
    };
    shapes::draw(shapes, labels, stated.origin, reader).map(Voxels::Labels)
}

/// Returns the voxels in an array `[x, y, z]` or `[channel, x, y, z]` that a program hands over.
fn held_by(held: &Node, stated: &Stated, reader: &mut Reader) -> Option<Voxels> {
    match &held.json {
        Json::Tensor(_) | Json::Array(_) => {
            let array = reader.array(held)?;
            from_array(&array, stated, held, reader)
        }
        _ if jdata::is_one(held) => annotated(held, stated, reader),
        _ => {
            reader.error(held, "Volume must be an array of labels [x, y, z]");
            None
        }
    }
}

/// Returns the voxels in a JData array: labels `[x, y, z]`, or coefficients `[channel, x, y, z]`.
fn annotated(node: &Node, stated: &Stated, reader: &mut Reader) -> Option<Voxels> {
    let array = jdata::array(node, reader)?;
    let is_volume = match array.tensor.shape().len() {
        3 => array.element.is_integer(),
        4 => true,
        _ => false,
    };
    if !is_volume {
        let message = "a volume must be an array [x, y, z] of labels, which are whole numbers, or coefficients of voxels \
                       [channel, x, y, z] with their MediaFormat";
        reader.error(node, message);
        return None;
    }
    from_array(&array.tensor, stated, node, reader)
}

fn from_array(tensor: &Tensor, stated: &Stated, at: &Node, reader: &mut Reader) -> Option<Voxels> {
    if tensor.shape().len() == 4 {
        return coefficients_of(tensor, stated, at, reader);
    }
    let volume = Volume::<f32>::of_tensor(tensor, AxisOrder::XYZ);
    let volume = volume
        .map_err(|e| reader.error(at, format!("labels: {e}")))
        .ok()?;
    let size = volume.size();
    let data = volume.into_data();
    Some(Voxels::Labels(Labels { size, data }))
}

/// Returns the coefficients in an array `[channel, x, y, z]` or `[x, y, z, channel]`.
fn coefficients_of(
    tensor: &Tensor,
    stated: &Stated,
    at: &Node,
    reader: &mut Reader,
) -> Option<Voxels> {
    let &[first, second, third, last] = tensor.shape() else {
        return None;
    };
    // MCX writes the channels last, and pmcx has them first.
    let is_last = !stated.format.is_labels() && stated.format.channels() == last;
    let (channels, [x, y, z]) = if is_last {
        (last, [first, second, third])
    } else {
        (first, [second, third, last])
    };
    let format = match (stated.format, channels) {
        (MediaFormat::Byte, 1) => MediaFormat::MuaFloat,
        (MediaFormat::Byte, 2) => MediaFormat::MuamusFloat,
        (MediaFormat::Byte, 4) => MediaFormat::AsgnFloat,
        (format, _) => format,
    };
    if format.is_labels() || format.channels() != channels {
        let message = format!(
            "a volume of {channels} numbers for each voxel does not have the MediaFormat: give 1 (mua_float), 2 (muamus_float, \
             muamus_half, muamus_short) or 4 numbers (asgn_float, asgn_byte) along the first axis"
        );
        reader.error(at, message);
        return None;
    }
    let mut numbers = vec![0.0; tensor.len()];
    for (i, target) in rows_first_order([x, y, z]).enumerate() {
        for c in 0..channels {
            let place = if is_last {
                i * channels + c
            } else {
                c * x * y * z + i
            };
            numbers[target * channels + c] = tensor.get(place) as f32;
        }
    }
    coefficients((format, [x, y, z]), &numbers, stated, reader.limits)
        .map_err(|message| reader.error(at, message))
        .ok()
}

fn coefficients(
    (format, size): (MediaFormat, [usize; 3]),
    numbers: &[f32],
    stated: &Stated,
    limits: Limits,
) -> Result<Voxels, String> {
    let Properties { media, unit, phase } = stated.properties;
    let media = media.ok_or("a volume of coefficients needs Media")?;
    let base = Base {
        media,
        unit,
        phase,
        limits,
    };
    let made = Coefficients::new(format, size, numbers, &base);
    made.map(Voxels::Coefficients).map_err(|e| e.to_string())
}

/// Yields the places, with x fastest, of voxels in an order with z fastest.
fn rows_first_order([x, y, z]: [usize; 3]) -> impl Iterator<Item = usize> {
    (0..x).flat_map(move |i| (0..y).flat_map(move |j| (0..z).map(move |k| i + x * (j + y * k))))
}

fn sizes(numbers: Vec<f64>) -> Option<[usize; 3]> {
    let whole = |v: &f64| (v.fract() == 0.0 && *v >= 1.0).then_some(*v as usize);
    let sizes: Vec<usize> = numbers.iter().map(whole).collect::<Option<_>>()?;
    sizes.try_into().ok()
}

/// Reads voxels from a file of shapes, of raw numbers, or of another known format.
fn from_file(file: &Node, stated: &Stated, reader: &mut Reader) -> Option<Voxels> {
    let Json::String(name) = &file.json else {
        reader.error(file, "VolumeFile must be the name of a file");
        return None;
    };
    let path = file.location.source().directory().join(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let read = match extension.to_ascii_lowercase().as_str() {
        "json" => return from_shapes(&path, file, stated, reader),
        "bin" => raw(&path, stated, reader.limits),
        _ if Format::of(&path).is_some() => known(&path, stated, reader.limits),
        _ => Err(format!(
            "{}: unknown format: a VolumeFile is .json with shapes, .bin with the numbers of each voxel, or another volume file",
            path.display()
        )),
    };
    read.map_err(|message| reader.error(file, message)).ok()
}

fn from_shapes(path: &Path, file: &Node, stated: &Stated, reader: &mut Reader) -> Option<Voxels> {
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
    let start = filled(stated.size, file, reader)?;
    drawn(shapes, start.map(Voxels::Labels), stated, reader)
}

/// Reads the numbers of each voxel. x runs fastest, or z if `rows_first`.
fn raw(path: &Path, stated: &Stated, limits: Limits) -> Result<Voxels, String> {
    let size = stated
        .size
        .ok_or("Domain needs the numbers of voxels, Dim")?;
    let (format, bytes) = (stated.format, input::read(path).map_err(|e| e.to_string())?);
    let (element, channels) = (format.element(), format.channels());
    let [x, y, z] = size;
    let each = element.size() * channels;
    let count = x.checked_mul(y).and_then(|n| n.checked_mul(z));
    if count.and_then(|n| n.checked_mul(each)) != Some(bytes.len()) {
        let each = match each {
            1 => "a byte".to_owned(),
            n => format!("{n} bytes"),
        };
        return Err(format!(
            "{}: the file has {} bytes, but Dim states {x} x {y} x {z} voxels of {each} each",
            path.display(),
            bytes.len()
        ));
    }
    let mut numbers = Vec::with_capacity(bytes.len() / element.size());
    element.decode(&bytes, &mut |v| numbers.push(v as f32));
    if stated.rows_first {
        let stored = numbers.clone();
        for (voxel, target) in stored.chunks_exact(channels).zip(rows_first_order(size)) {
            numbers[target * channels..(target + 1) * channels].copy_from_slice(voxel);
        }
    }
    if format.is_labels() {
        return Ok(Voxels::Labels(Labels {
            size,
            data: numbers,
        }));
    }
    coefficients((format, size), &numbers, stated, limits)
}

/// Reads labels, or the coefficients of each voxel as channels, from a volume file.
fn known(path: &Path, stated: &Stated, limits: Limits) -> Result<Voxels, String> {
    let options = Options::default().within(limits);
    let volume = Volume::<f32>::read(path, options).map_err(|e| e.to_string())?;
    let (size, channels) = (volume.size(), volume.channels());
    if !stated.format.is_labels() && channels == stated.format.channels() {
        return coefficients((stated.format, size), volume.data(), stated, limits);
    }
    if channels != 1 || !stated.format.is_labels() {
        let expected = match stated.format.channels() {
            1 => "labels must have one channel".to_owned(),
            n => format!("this MediaFormat needs {n} channels"),
        };
        return Err(format!("{}: {expected}", path.display()));
    }
    let data = volume.into_data();
    Ok(Voxels::Labels(Labels { size, data }))
}
