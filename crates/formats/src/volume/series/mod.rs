//! Samples at many instants, of which sums over the instants are wanted. Files of NumPy and HDF5 are read in parts: beside the
//! sums, memory does not grow with the number of instants.

mod sums;

use std::ops::Range;

use super::layout::Layout;
use super::{AxisOrder, Volume, element_of};
use crate::element::Element;
use crate::error::Problem;
use crate::tensor::Tensor;
pub(super) use sums::Adder;

/// The most sums at a place.
pub const MOST_SUMS: usize = 3;

/// What is known of a series before its samples are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesShape {
    /// Number of frames, or of channels.
    pub frames: usize,
    /// Seconds from a frame to the next, if the file says so.
    pub time_step: Option<f64>,
}

/// The sums over the frames of a series that are wanted.
pub struct FrameSums {
    /// The frames that count.
    pub used: Range<usize>,
    /// Number of sums at each place, up to [`MOST_SUMS`].
    pub count: usize,
    /// By what a frame is multiplied in each sum.
    pub weights: Box<dyn Fn(usize) -> [f64; MOST_SUMS]>,
}

/// Decides what is wanted of a series.
pub type Plan<'p> = dyn FnMut(SeriesShape) -> Result<FrameSums, Problem> + 'p;

/// Sums over the frames of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The sums, as channels.
    pub sums: Volume<f64>,
    /// The sum of the squares of all samples that count.
    pub squares: f64,
    /// What there was.
    pub shape: SeriesShape,
}

impl Series {
    /// Sums the frames of an array of 4 axes.
    ///
    /// # Errors
    /// Those of [`Volume::of_tensor`] and of the plan.
    pub fn of_tensor(tensor: &Tensor, axes: AxisOrder, plan: &mut Plan) -> Result<Self, Problem> {
        let layout = Layout::new(tensor.shape(), false, axes)?;
        let mut adder = Adder::new(layout.size, shape(&layout, None), plan, |_, _| Ok(()))?;
        for (target, v) in layout.targets().zip(tensor.iter()) {
            adder.add(target, v);
        }
        let series = adder.finish()?;
        Ok(series.of_element(element_of(tensor)))
    }

    /// The same of numbers of another type.
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

/// What a layout says of a series.
pub(super) fn shape(layout: &Layout, time_step: Option<f64>) -> SeriesShape {
    SeriesShape {
        frames: layout.channels,
        time_step,
    }
}
