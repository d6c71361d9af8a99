//! Records of the samples in volumes of sound.

use crate::scene::{ObjectDescription, Value};
use glam::{DAffine3, DVec3};

/// Record of a volume of sound: a grid of samples, possibly from a time series.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundRecord {
    /// Type of the volume: `pressure` or `transducer`.
    pub plugin: String,
    /// Name of the file as the scene gives it; `None` if the scene holds or computes the samples.
    pub file: Option<String>,
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// True if the outermost samples lie on the faces of their box; false if they lie half a step
    /// inside.
    pub nodes: bool,
    /// Map from the unit cube to the box in the scene.
    pub to_world: DAffine3,
    /// Source of the position of the box, before the scene's `to_world`.
    pub placed_by: FactSource,
    /// Frequency in Hz; `None` for a single frame of a series.
    pub frequency: Option<f64>,
    /// Part of a time series that was used.
    pub series: Option<SeriesRecord>,
}

/// Part of a time series that was used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesRecord {
    /// Number of frames.
    pub frames: usize,
    /// Number of the first frame that was used.
    pub first: usize,
    /// Number of frames that were used, counted from the first.
    pub used: usize,
    /// Time in seconds between frames, if known, with its source.
    pub time_step: Option<(f64, FactSource)>,
    /// Residual of the fit to the used frames, as a fraction of their root mean square; `None` for
    /// a single frame.
    pub residual: Option<f64>,
}

/// Returns the name of the file with a volume's samples, as given in the scene.
pub(super) fn file_of(object: &ObjectDescription) -> Option<String> {
    let property = object.properties.iter().find(|p| p.name == "filename")?;
    match &property.value {
        Value::String(name) => Some(name.clone()),
        _ => None,
    }
}

/// Source of a fact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactSource {
    /// File of the samples.
    File,
    /// Scene description.
    Scene,
}

impl SoundRecord {
    /// Returns the source of the number of samples.
    pub fn sized_by(&self) -> FactSource {
        match self.file {
            Some(_) => FactSource::File,
            None => FactSource::Scene,
        }
    }

    /// Returns the distances between neighbouring samples along x, y and z of the grid, in scene
    /// units.
    pub fn spacing(&self) -> DVec3 {
        let axes = self.to_world.matrix3;
        let steps = self.steps();
        DVec3::new(
            axes.x_axis.length() * steps.x,
            axes.y_axis.length() * steps.y,
            axes.z_axis.length() * steps.z,
        )
    }

    /// Returns the position of the first sample in the scene.
    pub fn origin(&self) -> DVec3 {
        let inside = self
            .size
            .map(|n| if self.nodes && n > 1 { 0.0 } else { 0.5 });
        let first = self.steps() * DVec3::from_array(inside);
        self.to_world.transform_point3(first)
    }

    /// Returns the distances between neighbouring samples in the unit cube.
    fn steps(&self) -> DVec3 {
        let cells = self
            .size
            .map(|n| if self.nodes && n > 1 { n - 1 } else { n });
        DVec3::ONE / DVec3::from_array(cells.map(|n| n as f64))
    }
}

impl FactSource {
    /// Returns the name: `file` or `scene`.
    pub fn name(self) -> &'static str {
        match self {
            FactSource::File => "file",
            FactSource::Scene => "scene",
        }
    }
}
