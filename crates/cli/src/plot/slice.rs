//! Sections through meter readings.

use super::Map;
use super::sources::wrong;
use crate::command_error::CommandError;
use io::Limits;
use io::arrays::{Array, Arrays};
use std::path::Path;

/// Spatial axes.
const SPATIAL_AXES: [&str; 3] = ["x", "y", "z"];
/// Axes over which a sum is meaningless: the order of sidebands, and the delay of correlations.
const SEPARATE_AXES: [&str; 2] = ["order", "delay"];

/// Selection of a section through an array.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    /// Name of the array; the fluence if `None`.
    pub array: Option<&'a str>,
    /// Axis perpendicular to the section.
    pub axis: &'a str,
    /// Position on this axis.
    pub at: f64,
    /// Bins of axes that are not spatial, by name and number. Bins of other axes are added up.
    pub bins: &'a [(String, usize)],
    /// True if the colour scale is logarithmic.
    pub logarithmic: bool,
}

/// Makes a section through an array of a meter, perpendicular to an axis of the array.
pub fn slice(path: &Path, section: Section) -> Result<Map, CommandError> {
    let arrays = Arrays::read(path, Limits::default())?;
    let found = array(&arrays, section.array).map_err(|e| wrong(path, e))?;
    let map = check_bins(found, section.bins).and_then(|()| map(&arrays, found, section));
    map.map_err(|e| wrong(path, e))
}

/// Returns the array `name`; by default the fluence.
fn array<'a>(arrays: &'a Arrays, name: Option<&str>) -> Result<&'a Array, String> {
    let is_over_space = |a: &&Array| SPATIAL_AXES.iter().all(|k| a.axes.iter().any(|x| x == k));
    let over_space = || arrays.list.iter().filter(is_over_space);
    let found = match name {
        Some(name) => over_space().find(|a| a.name == name),
        None => {
            let fluence = over_space().find(|a| a.name.ends_with("fluence"));
            fluence.or_else(|| over_space().next())
        }
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = over_space().map(|a| a.name.as_str()).collect();
        if names.is_empty() {
            return "no array over x, y and z: give readings of a fluencemeter with cartesian cells".into();
        }
        let name = name.unwrap_or_default();
        format!("no array '{name}' over x, y and z: the file has {}", names.join(", "))
    })
}

/// Checks that the bins exist, and that all required bins are given.
fn check_bins(array: &Array, bins: &[(String, usize)]) -> Result<(), String> {
    let others = || {
        (array.axes.iter().zip(&array.shape)).filter(|(a, _)| !SPATIAL_AXES.contains(&a.as_str()))
    };
    for (name, number) in bins {
        let Some((_, count)) = others().find(|(axis, _)| *axis == name) else {
            let names: Vec<&str> = others().map(|(axis, _)| axis.as_str()).collect();
            let known = if names.is_empty() {
                "none".into()
            } else {
                names.join(", ")
            };
            return Err(format!(
                "'{}' has no axis '{name}' of bins; it has: {known}",
                array.name
            ));
        };
        if number >= count {
            let last = count - 1;
            return Err(format!(
                "axis '{name}' has bins 0 to {last}, but no {number}"
            ));
        }
    }
    let is_said = |name: &str| bins.iter().any(|(axis, _)| axis == name);
    match others()
        .find(|(axis, n)| **n > 1 && SEPARATE_AXES.contains(&axis.as_str()) && !is_said(axis))
    {
        None => Ok(()),
        Some((axis, count)) => Err(format!(
            "'{}' has a value for each {axis}, which must not be summed: choose one by --bin {axis}=N, with N from 0 to {}",
            array.name,
            count - 1
        )),
    }
}

fn map(arrays: &Arrays, array: &Array, section: Section) -> Result<Map, String> {
    let Section { axis, at, .. } = section;
    let across = edges(arrays, array, axis)?;
    let cell = across
        .windows(2)
        .position(|e| (e[0]..=e[1]).contains(&at))
        .ok_or_else(|| {
            let [a, b] = [across.first(), across.last()].map(|e| e.copied().unwrap_or_default());
            format!("{axis} = {at} is outside: the grid reaches from {axis} = {a} to {b}")
        })?;
    let [right, up] = match axis {
        "x" => ["y", "z"],
        "y" => ["x", "z"],
        _ => ["x", "y"],
    };
    let bins = section
        .bins
        .iter()
        .map(|(axis, bin)| format!(", {axis} {bin}"));
    Ok(Map {
        title: format!(
            "{} at {axis} = {at}{}",
            array.name,
            bins.collect::<String>()
        ),
        x: (
            format!("{right} (scene units)"),
            edges(arrays, array, right)?,
        ),
        y: (format!("{up} (scene units)"), edges(arrays, array, up)?),
        values: values(array, [axis, right, up], cell, section.bins),
        quantity: array.unit.replace("^2", "²").replace("^3", "³"),
        logarithmic: section.logarithmic,
    })
}

/// Returns the edges of an array's cells along an axis.
fn edges(arrays: &Arrays, array: &Array, axis: &str) -> Result<Vec<f64>, String> {
    let edges = arrays.edges(array, axis).map(<[f64]>::to_vec);
    edges.ok_or_else(|| {
        format!(
            "the file does not say where the cells of '{}' are along {axis}: array '{axis}_edges' is missing or has another size",
            array.name
        )
    })
}

/// Returns the values of a cell across the section, row by row. It selects the given bins, sums
/// over all bins of other axes, and averages over channels.
fn values(
    array: &Array,
    [axis, right, up]: [&str; 3],
    cell: usize,
    bins: &[(String, usize)],
) -> Vec<f64> {
    let length = |name: &str| {
        let axis = (array.axes.iter().zip(&array.shape)).find(|(a, _)| *a == name);
        axis.map_or(1, |(_, n)| *n)
    };
    let is_said = |name: &str| bins.iter().any(|(axis, _)| axis == name);
    let channels = if is_said("channel") {
        1
    } else {
        length("channel")
    };
    let columns = length(right);
    let mut values = vec![0.0; columns * length(up)];
    for (i, value) in array.data.iter().enumerate() {
        let mut rest = i;
        let (mut place, mut wanted) = ([0, 0], true);
        for (name, n) in array.axes.iter().zip(&array.shape).rev() {
            let k = rest % n;
            rest /= n;
            match name.as_str() {
                s if s == axis => wanted &= k == cell,
                s if s == right => place[0] = k,
                s if s == up => place[1] = k,
                s => wanted &= bins.iter().all(|(axis, bin)| axis != s || *bin == k),
            }
        }
        if wanted {
            values[place[1] * columns + place[0]] += value / channels as f64;
        }
    }
    values
}
