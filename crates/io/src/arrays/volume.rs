//! Volumes as arrays.

use super::{Array, Arrays};
use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::volume::{AxisOrder, Format, Options, Volume};
use serde_json::json;
use std::path::Path;

/// Reads a volume as the array `volume` of axes z, y, x, and its channels if there are several. Of an NRRD file that does not say
/// which axis is which, the fastest is x.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Arrays, FileError> {
    let options = Options::default().within(limits);
    let volume = match Volume::<f64>::read(path, options) {
        Err(FileError {
            problem: Problem::Unsaid(_),
            ..
        }) if Format::of(path) == Some(Format::Nrrd) => {
            Volume::read(path, Options::order(AxisOrder::XYZ).within(limits))
        }
        read => read,
    }?;
    Ok(of(volume))
}

fn of(volume: Volume<f64>) -> Arrays {
    let [x, y, z] = volume.size();
    let (mut axes, mut shape) = (vec!["z", "y", "x"], vec![z, y, x]);
    if volume.channels() > 1 {
        axes.push("channel");
        shape.push(volume.channels());
    }
    let place = volume.place();
    let steps = [place.steps.x_axis, place.steps.y_axis, place.steps.z_axis];
    let attributes = vec![
        ("first sample".into(), json!(place.first.to_array())),
        (
            "steps along x, y, z".into(),
            json!(steps.map(|step| step.to_array())),
        ),
        ("stored as".into(), json!(volume.element().to_string())),
    ];
    Arrays {
        list: vec![Array {
            name: "volume".into(),
            axes: axes.into_iter().map(str::to_owned).collect(),
            shape,
            unit: String::new(),
            data: volume.into_data(),
        }],
        main: Some(0),
        placement: None,
        attributes,
    }
}
