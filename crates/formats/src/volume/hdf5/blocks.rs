//! Reading of datasets in blocks.

use std::ops::Range;

use hdf5_reader::{Dataset, SliceInfo, SliceInfoElem};

use super::describe;
use super::elements::Number;
use crate::error::Problem;
use crate::volume::layout::Layout;

/// Number of values that are read at a time, unless a chunk of the file has more.
pub const BLOCK: usize = 1 << 20;

/// Axis of a dataset.
struct BlockAxis {
    length: usize,
    /// Distance of neighbours in the volume.
    stride: usize,
    /// Range of the axis to read.
    range: Range<usize>,
    /// Length of a block along the axis.
    step: usize,
}

/// Passes the numbers of a dataset that belong to some channels to `sink`, each with its position
/// in a volume.
pub(super) fn each(
    data: &Dataset,
    layout: &Layout,
    channels: Range<usize>,
    mut sink: impl FnMut(usize, f64),
) -> Result<(), Problem> {
    let axes = axes(data, layout, channels);
    let mut starts: Vec<usize> = axes.iter().map(|axis| axis.range.start).collect();
    loop {
        let block: Vec<Range<usize>> = axes
            .iter()
            .zip(&starts)
            .map(|(axis, start)| *start..axis.end_of_block(*start))
            .collect();
        read(data, &axes, &block, &mut sink)?;
        // Advance to the next block, with the last axis fastest.
        let next = (0..axes.len())
            .rev()
            .find(|i| block[*i].end < axes[*i].range.end);
        let Some(next) = next else {
            return Ok(());
        };
        starts[next] = block[next].end;
        for (start, axis) in starts.iter_mut().zip(&axes).skip(next + 1) {
            *start = axis.range.start;
        }
    }
}

impl BlockAxis {
    /// Returns the end of the block from `start`, at a multiple of the step, so that no chunk is in
    /// two blocks.
    fn end_of_block(&self, start: usize) -> usize {
        let end = (start / self.step + 1).saturating_mul(self.step);
        end.min(self.range.end)
    }
}

/// Returns the axes of a dataset, in blocks of whole chunks.
fn axes(data: &Dataset, layout: &Layout, channels: Range<usize>) -> Vec<BlockAxis> {
    let mut long = layout.long_axes();
    let chunks = data.chunks();
    let mut axes: Vec<BlockAxis> = Vec::new();
    for (i, length) in data.shape().iter().enumerate() {
        let length = *length as usize;
        let stride = match length {
            1 => 0,
            _ => long.next().map_or(0, |(_, stride)| stride),
        };
        let is_time = stride == 1 && layout.channels > 1;
        let chunk = chunks.as_ref().and_then(|chunks| chunks.get(i));
        let chunk = chunk.map_or(1, |chunk| *chunk as usize);
        axes.push(BlockAxis {
            length,
            stride,
            range: if is_time { channels.clone() } else { 0..length },
            step: chunk.clamp(1, length),
        });
    }
    let mut numbers = axes
        .iter()
        .fold(1usize, |n, axis| n.saturating_mul(axis.step));
    for axis in axes.iter_mut().rev() {
        let times = (BLOCK / numbers)
            .min(axis.length.div_ceil(axis.step))
            .max(1);
        axis.step *= times;
        numbers = numbers.saturating_mul(times);
    }
    axes
}

/// Passes the numbers of a block to `sink`.
fn read(
    data: &Dataset,
    axes: &[BlockAxis],
    block: &[Range<usize>],
    sink: &mut impl FnMut(usize, f64),
) -> Result<(), Problem> {
    let slice = |range: &Range<usize>| SliceInfoElem::Slice {
        start: range.start as u64,
        end: range.end as u64,
        step: 1,
    };
    let selection = SliceInfo {
        selections: block.iter().map(slice).collect(),
    };
    let numbers = data.read_slice::<Number>(&selection).map_err(describe)?;
    let mut index: Vec<usize> = block.iter().map(|range| range.start).collect();
    let at = |index: &[usize]| {
        let terms = index.iter().zip(axes).map(|(i, axis)| i * axis.stride);
        terms.sum::<usize>()
    };
    let mut target = at(&index);
    for number in numbers.iter() {
        sink(target, number.0);
        for i in (0..index.len()).rev() {
            index[i] += 1;
            target += axes[i].stride;
            if index[i] < block[i].end {
                break;
            }
            target -= axes[i].stride * block[i].len();
            index[i] = block[i].start;
        }
    }
    Ok(())
}
