//! Arrays of volumes.

use super::{Array, Read};
use crate::error::{FileError, Problem};
use crate::input::{Budget, Limits};
use crate::volume::{self, AxisOrder, Format, Options, Volume};
use serde_json::{Value, json};
use std::path::Path;

/// Largest relative excess of the length of a step over its component along its axis, for axes that
/// count as aligned.
const ALIGNED: f64 = 1e-9;

/// Reads a volume as the array `volume` with axes z, y, x, and a channel axis if there are several
/// channels. Several volumes keep their own names. If an NRRD file does not name its axes, the
/// fastest is x. If all volumes have one grid along x, y and z, there are arrays of its edges, half
/// a step around each sample.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    let options = Options::default().within(limits);
    let names = volume::names(path).map_err(|error| error.problem)?;
    if names.len() < 2 {
        let volume = single(path, options).map_err(|error| error.problem)?;
        return Ok(Read {
            attributes: attributes(&volume),
            edges: edges(&volume),
            arrays: vec![array("volume", volume)],
            ..Read::default()
        });
    }
    let size = std::fs::metadata(path).map_err(Problem::Read)?.len();
    let mut budget = Budget::new(limits, size);
    let mut read = Read::default();
    let mut grids = Vec::new();
    for name in &names {
        let volume = Volume::<f64>::read(path, options.of(name)).map_err(|error| error.problem);
        let kept = volume.and_then(|volume| {
            budget.take(volume.data().len() as u64, size_of::<f64>() as u64)?;
            grids.push(edges(&volume));
            let about = attributes(&volume).into_iter();
            let about = about.map(|(key, value)| (format!("{name}: {key}"), value));
            read.attributes.extend(about);
            Ok(array(name, volume))
        });
        read.add(name, kept);
    }
    let is_one = grids.windows(2).all(|pair| pair[0] == pair[1]);
    read.edges = grids
        .into_iter()
        .next()
        .filter(|_| is_one)
        .unwrap_or_default();
    Ok(read)
}

fn single(path: &Path, options: Options) -> Result<Volume<f64>, FileError> {
    match Volume::<f64>::read(path, options) {
        Err(FileError {
            problem: Problem::Unsaid(_),
            ..
        }) if Format::of(path) == Some(Format::Nrrd) => {
            Volume::read(path, Options::order(AxisOrder::XYZ).within(options.limits))
        }
        read => read,
    }
}

fn array(name: &str, volume: Volume<f64>) -> Array {
    let [x, y, z] = volume.size();
    let (mut axes, mut shape) = (vec!["z", "y", "x"], vec![z, y, x]);
    if volume.channels() > 1 {
        axes.push("channel");
        shape.push(volume.channels());
    }
    Array {
        name: name.to_owned(),
        axes: axes.into_iter().map(str::to_owned).collect(),
        shape,
        unit: String::new(),
        data: volume.into_data(),
    }
}

/// Returns the edges of the samples' cells along x, y and z, if the axes of the volume run along
/// them; otherwise nothing.
fn edges(volume: &Volume<f64>) -> Vec<Array> {
    let place = volume.place();
    let steps = [place.steps.x_axis, place.steps.y_axis, place.steps.z_axis];
    let is_along = |axis: usize| {
        let [step, length] = [steps[axis][axis], steps[axis].length()];
        step > 0.0 && (length - step) <= ALIGNED * length
    };
    if !(0..3).all(is_along) {
        return Vec::new();
    }
    let edges = |axis: usize| {
        let (name, step) = (["x", "y", "z"][axis], steps[axis][axis]);
        let first = place.first[axis] - 0.5 * step;
        let count = volume.size()[axis] + 1;
        Array {
            name: format!("{name}_edges"),
            axes: vec![name.to_owned()],
            shape: vec![count],
            unit: String::new(),
            data: (0..count).map(|i| first + i as f64 * step).collect(),
        }
    };
    (0..3).map(edges).collect()
}

/// Returns attributes: the positions of the samples, and their type.
fn attributes(volume: &Volume<f64>) -> Vec<(String, Value)> {
    let place = volume.place();
    let steps = [place.steps.x_axis, place.steps.y_axis, place.steps.z_axis];
    let steps = steps.map(|step| step.to_array());
    vec![
        ("first sample".into(), json!(place.first.to_array())),
        ("steps along x, y, z".into(), json!(steps)),
        ("stored as".into(), json!(volume.element().to_string())),
    ]
}
