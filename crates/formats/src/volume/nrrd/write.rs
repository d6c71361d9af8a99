//! Writing of NRRD files, version 5.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use glam::DVec3;

use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::FileError;
use crate::volume::{Format, Sample, Volume};

/// Writes a volume with its position, raw, with header and data in one file.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>) -> Result<(), FileError> {
    let element = Format::Nrrd.element(volume.element());
    let values = volume.data().iter().map(|v| v.wide());
    atomic::write(path, |file| {
        writeln!(file, "{}", header(volume, element))?;
        Encoding::little(element).write(file, values)
    })
}

/// Makes the fields, with axes from the fastest to the slowest.
fn header<T: Sample>(volume: &Volume<T>, element: Element) -> String {
    let frame = volume.place();
    let [x, y, z] = volume.size();
    let list = |channel: String, axes: [String; 3]| {
        let channel = (volume.channels() > 1).then_some(channel);
        channel
            .into_iter()
            .chain(axes)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let words = |channel: &str, axis: &str| list(channel.into(), [(); 3].map(|()| axis.into()));
    let steps = [frame.steps.x_axis, frame.steps.y_axis, frame.steps.z_axis];
    let sizes = list(
        volume.channels().to_string(),
        [x, y, z].map(|n| n.to_string()),
    );
    let mut text = format!("NRRD0005\ntype: {}\n", kind(element));
    let _ = writeln!(text, "dimension: {}", sizes.split(' ').count());
    let _ = writeln!(text, "space dimension: 3\nsizes: {sizes}");
    let _ = writeln!(
        text,
        "space directions: {}",
        list("none".into(), steps.map(vector))
    );
    let _ = writeln!(text, "space origin: {}", vector(frame.first));
    if let Some(unit) = volume.unit() {
        let _ = writeln!(text, "space units: \"{unit}\" \"{unit}\" \"{unit}\"");
    }
    let center = if frame.nodes { "node" } else { "cell" };
    let _ = writeln!(text, "centers: {}", words("???", center));
    let _ = writeln!(text, "kinds: {}", words("list", "domain"));
    let _ = writeln!(text, "endian: little\nencoding: raw");
    text
}

fn vector(v: DVec3) -> String {
    format!("({},{},{})", v.x, v.y, v.z)
}

fn kind(element: Element) -> &'static str {
    match element {
        Element::F16 | Element::F32 => "float",
        Element::F64 => "double",
        other => other.name(),
    }
}
