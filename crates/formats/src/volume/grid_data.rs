//! Arrays over one grid in space, as files hold them: volumes, and readings of meters.

use super::{Sample, Volume, VolumeFrame};
use crate::element::Element;

/// Arrays over one grid in space, with the position of the grid.
#[derive(Clone, Debug)]
pub struct GridData<'a, T> {
    /// Numbers of samples along x, y and z.
    pub size: [usize; 3],
    /// Position of the samples.
    pub frame: VolumeFrame,
    /// Length of a unit of the frame in m, if it is known.
    pub metres_per_unit: Option<f64>,
    /// Type of the numbers in the file.
    pub element: Element,
    /// Arrays; formats of one array hold the first.
    pub arrays: Vec<GridArray<'a, T>>,
    /// Further properties, in formats with names.
    pub fields: Vec<(String, GridField)>,
}

/// Further property of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum GridField {
    /// Numbers, such as the edges of bins.
    Numbers(Vec<f64>),
    /// Text, such as a description in JSON.
    Text(String),
}

/// Array over the samples of a grid, and over further axes.
#[derive(Clone, Debug)]
pub struct GridArray<'a, T> {
    /// Name of the array.
    pub name: &'a str,
    /// Unit of the numbers; empty if they have none.
    pub unit: &'a str,
    /// Axes except x, y and z.
    pub axes: Vec<GridAxis>,
    /// Distances between neighbours along x, y and z in `data`.
    pub steps: [usize; 3],
    /// Numbers of the array.
    pub data: &'a [T],
}

/// Axis of an array except x, y and z.
#[derive(Clone, Debug, PartialEq)]
pub struct GridAxis {
    /// Name, such as `channel` or `opl`.
    pub name: String,
    /// Distance between neighbours in the array.
    pub step: usize,
    /// Label of each item, such as `532` or `opl 0 to 10`; empty for channels without names.
    pub labels: Vec<String>,
    /// Edges of the items; empty if they are not bins.
    pub edges: Vec<f64>,
    /// Number of items.
    pub len: usize,
}

impl<'a, T: Sample> GridData<'a, T> {
    /// Returns a volume as the array `name`.
    pub fn of_volume(volume: &'a Volume<T>, name: &'a str) -> Self {
        let [x, y, _] = volume.size();
        let channels = volume.channels();
        let channel = (channels > 1).then(|| GridAxis {
            name: "channel".into(),
            step: 1,
            labels: Vec::new(),
            edges: Vec::new(),
            len: channels,
        });
        GridData {
            size: volume.size(),
            frame: volume.place(),
            metres_per_unit: volume.unit().and_then(metres),
            element: volume.element(),
            arrays: vec![GridArray {
                name,
                unit: "",
                axes: channel.into_iter().collect(),
                steps: [channels, channels * x, channels * x * y],
                data: volume.data(),
            }],
            fields: Vec::new(),
        }
    }
}

impl<T: Sample> GridArray<'_, T> {
    /// Returns the number of values of each sample.
    pub fn components(&self) -> usize {
        self.axes.iter().map(|axis| axis.len).product()
    }

    /// Returns a label for each of the values of a sample, with the last axis fastest; empty if
    /// the items of the axes have no labels.
    pub fn labels(&self) -> Vec<String> {
        if self.axes.iter().all(|axis| axis.labels.is_empty()) {
            return Vec::new();
        }
        let mut labels = vec![String::new()];
        for axis in &self.axes {
            let longer = labels.iter().flat_map(|label| {
                let parts = (0..axis.len).map(|i| axis.labels.get(i).map_or("", String::as_str));
                parts.map(move |part| match (label.as_str(), part) {
                    ("", one) | (one, "") => one.to_owned(),
                    (first, second) => format!("{first}, {second}"),
                })
            });
            labels = longer.collect();
        }
        labels
    }

    /// Returns all numbers for a grid of a given size. x runs faster than y and z, and each sample
    /// has its values side by side, with the last axis fastest.
    pub fn by_sample(&self, size: [usize; 3]) -> impl Iterator<Item = f64> {
        let others = self.axes.iter().map(|axis| [axis.len, axis.step]);
        self.values(self.space(size).into_iter().chain(others).collect())
    }

    /// Returns all numbers for a grid of a given size. x runs fastest, then y and z, and then the
    /// first of the other axes; the last of them is the slowest.
    pub fn by_axis(&self, size: [usize; 3]) -> impl Iterator<Item = f64> {
        let others = self.axes.iter().rev().map(|axis| [axis.len, axis.step]);
        self.values(others.chain(self.space(size)).collect())
    }

    /// Returns the length of the axes z, y and x, each with its step.
    fn space(&self, [nx, ny, nz]: [usize; 3]) -> [[usize; 2]; 3] {
        let [x, y, z] = self.steps;
        [[nz, z], [ny, y], [nx, x]]
    }

    fn values(&self, axes: Vec<[usize; 2]>) -> impl Iterator<Item = f64> {
        strided(axes).map(|i| self.data[i].wide())
    }
}

/// Returns the positions of all elements of an array with these lengths and steps of its axes, the
/// slowest axis first.
pub fn strided(axes: Vec<[usize; 2]>) -> impl Iterator<Item = usize> {
    let count: usize = axes.iter().map(|[len, _]| len).product();
    let mut at = vec![0; axes.len()];
    let mut position = 0;
    (0..count).map(move |_| {
        let found = position;
        for (index, [len, step]) in at.iter_mut().zip(&axes).rev() {
            *index += 1;
            position += step;
            if *index < *len {
                break;
            }
            position -= len * step;
            *index = 0;
        }
        found
    })
}

/// Returns the length in m of a unit of length with a name.
fn metres(unit: &str) -> Option<f64> {
    Some(match unit {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        "um" | "µm" | "μm" => 1e-6,
        "nm" => 1e-9,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::strided;

    #[test]
    fn positions_of_elements() {
        assert_eq!(strided(Vec::new()).collect::<Vec<_>>(), [0]);
        let transposed = strided(vec![[3, 1], [2, 3]]);
        assert_eq!(transposed.collect::<Vec<_>>(), [0, 3, 1, 4, 2, 5]);
        assert_eq!(strided(vec![[0, 1], [2, 3]]).count(), 0);
    }
}
