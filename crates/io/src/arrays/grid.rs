//! Readings over a Cartesian grid, as arrays in space.

use super::readings::METRES;
use super::{Array, Arrays, npz, readings};
use crate::cie::SPEED_OF_LIGHT;
use crate::element::Element;
use crate::error::Problem;
use crate::volume::{GridArray, GridAxis, GridData, GridField, VolumeFrame, metered_place};
use serde_json::{Map, Value, json};

/// Axes in space, in the order of the columns of a frame.
pub(super) const SPACE: [&str; 3] = ["x", "y", "z"];
/// Largest difference of the widths of equal bins, relative to the width.
const MAX_UNEVENNESS: f64 = 1e-6;
/// Axis of optical path lengths, and its name as a time of flight.
const LENGTH: &str = "opl";
const TIME: &str = "time";

impl Arrays {
    /// Returns the grid of an array, with all arrays over the grid, the array first. Times of
    /// flight in s replace optical path lengths if the length of a scene unit is known.
    ///
    /// # Errors
    ///
    /// Returns an error for an array that does not lie on an even grid over x, y and z.
    pub(super) fn grid(
        &self,
        main: &Array,
        element: Element,
    ) -> Result<GridData<'_, f64>, Problem> {
        let elsewhere = || {
            let axes = match main.axes.join(", ") {
                none if none.is_empty() => "no axes".into(),
                axes => format!("the axes {axes}"),
            };
            Problem::Unsupported(format!(
                "a grid in space of '{}', which has {axes}, not x, y and z of a known place: write .npz, .h5 or .mat, which hold any axes and edges",
                main.name
            ))
        };
        let frame = self.place(main)?.ok_or_else(elsewhere)?;
        let size = size(main).ok_or_else(elsewhere)?;
        let here = |array: &&Array| {
            prefix(&array.name) == prefix(&main.name)
                && self::size(array) == Some(size)
                && array.name != main.name
        };
        let found = self.list.iter().find(|array| array.name == main.name);
        let arrays = found.into_iter().chain(self.list.iter().filter(here));
        Ok(GridData {
            size,
            frame,
            metres_per_unit: self.metres_per_unit(main),
            element,
            arrays: arrays.map(|array| self.array(array)).collect(),
            fields: self.fields(main),
        })
    }

    /// Returns the position of an array over x, y and z; `None` for other arrays, and without a
    /// known place.
    ///
    /// # Errors
    ///
    /// Returns an error if cells have unequal widths.
    pub(super) fn place(&self, array: &Array) -> Result<Option<VolumeFrame>, Problem> {
        let Some(size) = size(array) else {
            return Ok(None);
        };
        for axis in SPACE {
            let Some(edges) = self.edges(array, axis) else {
                return Ok(None);
            };
            check_even(&array.name, axis, edges)?;
        }
        let numbers = |name: &str, count: usize| {
            let of_name = self.list.iter().find(|a| a.name == name);
            let data = &of_name?.data;
            (data.len() == count && data.iter().all(|v| v.is_finite())).then(|| data.clone())
        };
        Ok(metered_place(&array.name, size, numbers))
    }

    /// Returns the length of a scene unit in m, if the file of an array states it.
    pub fn metres_per_unit(&self, array: &Array) -> Option<f64> {
        let name = format!("{}{METRES}", prefix(&array.name));
        let (_, value) = self.attributes.iter().find(|(key, _)| *key == name)?;
        let text = || value.as_str().and_then(|text| text.parse().ok());
        value.as_f64().or_else(text)
    }

    /// Returns the edges of an array's bins along an axis, ascending, one more than bins; `None` for
    /// other axes, and if the file does not have them.
    pub fn edges(&self, array: &Array, axis: &str) -> Option<&[f64]> {
        let name = format!("{}{axis}_edges", prefix(&array.name));
        let length = *array
            .axes
            .iter()
            .zip(&array.shape)
            .find(|(a, _)| *a == axis)?
            .1;
        let edges = self.list.iter().find(|a| a.name == name)?;
        (edges.data.len() == length + 1).then_some(&edges.data)
    }

    fn array<'a>(&'a self, array: &'a Array) -> GridArray<'a, f64> {
        let (mut steps, mut axes) = ([0; 3], Vec::new());
        let mut step = 1;
        for (name, length) in array.axes.iter().zip(&array.shape).rev() {
            match SPACE.iter().position(|axis| axis == name) {
                Some(i) => steps[i] = step,
                None => axes.insert(0, self.axis(array, name, [*length, step])),
            }
            step *= length;
        }
        GridArray {
            name: &array.name,
            unit: &array.unit,
            axes,
            steps,
            data: &array.data,
        }
    }

    fn axis(&self, array: &Array, name: &str, [len, step]: [usize; 2]) -> GridAxis {
        let edges = self.edges(array, name).unwrap_or_default();
        let seconds = self
            .metres_per_unit(array)
            .map(|metres| metres / SPEED_OF_LIGHT);
        let (name, edges) = match seconds.filter(|_| name == LENGTH) {
            Some(seconds) => (TIME, edges.iter().map(|edge| edge * seconds).collect()),
            None => (name, edges.to_vec()),
        };
        let channels = self.attributes.iter().find(|(key, _)| key == "channels");
        let channels = channels
            .and_then(|(_, names)| names.as_str())
            .unwrap_or_default();
        let channels: Vec<&str> = channels.split_whitespace().collect();
        let label = |i: usize| match name {
            "channel" if channels.len() == len => channels[i].to_owned(),
            LENGTH | TIME if edges.len() == len + 1 => {
                format!("{name} {:.4e} to {:.4e}", edges[i], edges[i + 1])
            }
            name => format!("{name} {i}"),
        };
        GridAxis {
            name: name.to_owned(),
            step,
            labels: (0..len).map(label).collect(),
            edges,
            len,
        }
    }

    /// Returns the edges of all axes, and a description of all arrays as JSON.
    fn fields(&self, main: &Array) -> Vec<(String, GridField)> {
        let axes = self.array(main).axes;
        let space = SPACE
            .into_iter()
            .filter_map(|axis| Some((axis, self.edges(main, axis)?)));
        let others = axes
            .iter()
            .map(|axis| (axis.name.as_str(), &axis.edges[..]));
        let all = space.chain(others.filter(|(_, edges)| !edges.is_empty()));
        let all: Vec<(&str, &[f64])> = all.collect();
        let mut about: Map<String, Value> =
            serde_json::from_str(&npz::metadata(self)).unwrap_or_default();
        let edges = all
            .iter()
            .map(|(axis, edges)| ((*axis).to_owned(), json!(edges)));
        about.insert("edges".into(), edges.collect::<Map<_, _>>().into());
        let edges = all
            .iter()
            .map(|(axis, edges)| (format!("{axis}_edges"), GridField::Numbers(edges.to_vec())));
        let metadata = (
            "metadata".to_owned(),
            GridField::Text(Value::from(about).to_string()),
        );
        edges.chain([metadata]).collect()
    }

    /// Returns the type in which a file holds an array: the requested type for readings and their
    /// statistics, double precision for all others.
    pub(super) fn element(&self, array: &Array, requested: Element) -> Element {
        let mut ends = readings::STATISTICS.iter();
        let values = ends
            .find_map(|end| array.name.strip_suffix(end))
            .unwrap_or(&array.name);
        let error = readings::error_of(values);
        if self.list.iter().any(|other| other.name == error) {
            requested
        } else {
            Element::F64
        }
    }
}

/// Returns the name of the meter of an array, with a dot; empty for the only meter.
fn prefix(name: &str) -> &str {
    name.rfind('.').map_or("", |dot| &name[..=dot])
}

/// Returns the numbers of cells along x, y and z, for arrays that have these axes.
fn size(array: &Array) -> Option<[usize; 3]> {
    let length = |axis: &str| {
        let mut axes = array.axes.iter().zip(&array.shape);
        axes.find(|(name, _)| *name == axis)
            .map(|(_, length)| *length)
    };
    Some([length("x")?, length("y")?, length("z")?])
}

/// Refuses cells of unequal widths.
fn check_even(name: &str, axis: &str, edges: &[f64]) -> Result<(), Problem> {
    let [first, .., last] = edges else {
        return Ok(());
    };
    let width = (last - first) / (edges.len() - 1) as f64;
    let is_even = |pair: &[f64]| (pair[1] - pair[0] - width).abs() <= MAX_UNEVENNESS * width.abs();
    if edges.windows(2).all(is_even) {
        return Ok(());
    }
    Err(Problem::Unsupported(format!(
        "unequal cells of '{name}' along {axis}: write .npz, .h5 or .mat, which hold edges"
    )))
}
