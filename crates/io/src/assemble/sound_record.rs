//! What volumes of sound are made of, for those who ask.

use crate::scene::{ObjectDescription, Value};
use glam::{DAffine3, DVec3};

/// What a volume of sound is made of: a grid of samples, and perhaps a series in time.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundRecord {
    /// Type of the volume: `pressure` or `transducer`.
    pub plugin: String,
    /// Name of the file as the scene gives it; `None` if the scene holds or computes the samples.
    pub file: Option<String>,
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// Whether the outermost samples lie on the faces of the box that they fill, rather than half a step inside.
    pub nodes: bool,
    /// From the unit cube to the box in the scene.
    pub to_world: DAffine3,
    /// Who says where the box is, before the scene's `to_world`.
    pub placed_by: FactSource,
    /// Hz; `None` for a single frame of a series.
    pub frequency: Option<f64>,
    /// What was used of a series in time.
    pub series: Option<SeriesRecord>,
}

/// What was used of a series in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesRecord {
    /// Number of frames.
    pub frames: usize,
    /// The first frame that was used.
    pub first: usize,
    /// Number of frames that were used, from the first on.
    pub used: usize,
    /// Seconds from a frame to the next, if that is known.
    pub time_step: Option<(f64, FactSource)>,
    /// What the fit leaves out of the frames used, as a part of their root mean square; `None` for a single frame.
    pub residual: Option<f64>,
}

/// The name of the file that a volume's samples are in, as the scene gives it.
pub(super) fn file_of(object: &ObjectDescription) -> Option<String> {
    let property = object.properties.iter().find(|p| p.name == "filename")?;
    match &property.value {
        Value::String(name) => Some(name.clone()),
        _ => None,
    }
}

/// Where a fact is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactSource {
    /// The file of the samples.
    File,
    /// The scene.
    Scene,
}

impl SoundRecord {
    /// Who says how many samples there are.
    pub fn sized_by(&self) -> FactSource {
        match self.file {
            Some(_) => FactSource::File,
            None => FactSource::Scene,
        }
    }

    /// Distances between neighbours along x, y and z of the grid, in scene units.
    pub fn spacing(&self) -> DVec3 {
        let axes = self.to_world.matrix3;
        let steps = self.steps();
        DVec3::new(
            axes.x_axis.length() * steps.x,
            axes.y_axis.length() * steps.y,
            axes.z_axis.length() * steps.z,
        )
    }

    /// Where the first sample is in the scene.
    pub fn origin(&self) -> DVec3 {
        let inside = self
            .size
            .map(|n| if self.nodes && n > 1 { 0.0 } else { 0.5 });
        let first = self.steps() * DVec3::from_array(inside);
        self.to_world.transform_point3(first)
    }

    /// From a sample to the next in the unit cube.
    fn steps(&self) -> DVec3 {
        let cells = self
            .size
            .map(|n| if self.nodes && n > 1 { n - 1 } else { n });
        DVec3::ONE / DVec3::from_array(cells.map(|n| n as f64))
    }
}

impl FactSource {
    /// `file` or `scene`.
    pub fn name(self) -> &'static str {
        match self {
            FactSource::File => "file",
            FactSource::Scene => "scene",
        }
    }
}
