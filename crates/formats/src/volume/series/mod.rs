//! Sums over time series of volumes. Files of NumPy and HDF5 are read in parts: except for the
//! sums, memory does not grow with the number of time steps.

mod sums;

use std::ops::Range;

use super::layout::Layout;
use super::{AxisOrder, Volume, element_of};
use crate::element::Element;
use crate::error::Problem;
use crate::tensor::Tensor;
pub(super) use sums::Adder;

/// Maximum number of sums at a voxel.
pub const MAX_SUMS: usize = 3;

/// Metadata of a series, which are known before its samples are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesShape {
    /// Number of frames or channels.
    pub frames: usize,
    /// Time between frames in seconds, if the file states it.
    pub time_step: Option<f64>,
}

/// Requested sums over the frames of a series.
pub struct FrameSums {
    /// Range of the frames to use.
    pub used: Range<usize>,
    /// Number of sums at each voxel, up to [`MAX_SUMS`].
    pub count: usize,
    /// Weights of a frame in the sums.
    pub weights: Box<dyn Fn(usize) -> [f64; MAX_SUMS]>,
}

/// Function that chooses the sums for a series.
pub type Plan<'p> = dyn FnMut(SeriesShape) -> Result<FrameSums, Problem> + 'p;

/// Sums over the frames of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Sums, as channels.
    pub sums: Volume<f64>,
    /// Sum of the squares of all used samples.
    pub squares: f64,
    /// Metadata of the series.
    pub shape: SeriesShape,
}

impl Series {
    /// Sums the frames of an array of 4 axes.
    ///
    /// # Errors
    /// The errors of [`Volume::of_tensor`] and of the plan.
    pub fn of_tensor(tensor: &Tensor, axes: AxisOrder, plan: &mut Plan) -> Result<Self, Problem> {
        let layout = Layout::new(tensor.shape(), false, axes)?;
        let mut adder = Adder::new(layout.size, shape(&layout, None), plan, |_, _| Ok(()))?;
        for (target, v) in layout.targets().zip(tensor.iter()) {
            adder.add(target, v);
        }
        let series = adder.finish()?;
        Ok(series.of_element(element_of(tensor)))
    }

    /// Returns the series with another number type.
    pub(super) fn of_element(self, element: Element) -> Self {
        Series {
            sums: self.sums.with_element(element),
            ..self
        }
    }

    /// Sums the channels of a volume.
    pub(super) fn of_volume(volume: Volume<f64>, plan: &mut Plan) -> Result<Self, Problem> {
        let shape = SeriesShape {
            frames: volume.channels(),
            time_step: None,
        };
        let mut adder = Adder::new(volume.size(), shape, plan, |_, _| Ok(()))?;
        for (target, v) in volume.data().iter().enumerate() {
            adder.add(target, *v);
        }
        let series = adder.finish()?;
        Ok(Series {
            sums: series.sums.recorded_as(&volume),
            ..series
        })
    }
}

/// Returns the metadata of a series with a layout.
pub(super) fn shape(layout: &Layout, time_step: Option<f64>) -> SeriesShape {
    SeriesShape {
        frames: layout.channels,
        time_step,
    }
}
