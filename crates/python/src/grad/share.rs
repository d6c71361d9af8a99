//! Derivatives of a loss of many rays, in sums that do not depend on the number of threads.

use super::course::{Course, Sums};
use super::ends::{Loss, Starts};
use super::{BLOCK, layout, not_interrupted};
use crate::numbers::ask_for_memory;
use crate::watch::{Shared, watched};
use eikonal::adjoint::{Layout, LayoutDerivative};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Memory for sums that are computed side by side, in bytes. It does not depend on the number of
/// threads, so that results do not either.
const MAX_SUM_BYTES: usize = 160 << 20;
/// Maximum number of sums.
const MAX_SUMS: usize = 32;

/// Part of the rays, in their order, with its own sums.
struct Share<'a> {
    first: usize,
    by_origins: &'a mut [f64],
    by_directions: &'a mut [f64],
    sums: LayoutDerivative<'a>,
    /// Sum of a loss of squares.
    squares: f64,
    /// Number of rays without an end on which the loss depends.
    failed: usize,
}

impl Share<'_> {
    fn pull_back(
        &mut self,
        course: &Course,
        layout: &Layout,
        starts: &Starts,
        loss: &Loss,
        shared: &Shared,
    ) {
        let mut ray = course.ray(layout);
        for i in 0..self.by_origins.len() / 3 {
            let at = self.first + i;
            if shared.requested() || shared.handle.end_requested() {
                return;
            }
            if !loss.depends_on(at) {
                continue;
            }
            let (start, length) = starts.get(at);
            let Ok(end) = ray.follow_through(start) else {
                self.failed += 1;
                continue;
            };
            let (squares, by) = loss.at(at, &end);
            self.squares += squares;
            if let Some(back) = ray.pull_back(&by, &mut self.sums) {
                back.x.write_to_slice(&mut self.by_origins[3 * i..]);
                (back.direction / length).write_to_slice(&mut self.by_directions[3 * i..]);
            }
        }
    }
}

/// Derivatives by media, surfaces, exit and starts.
pub(super) struct Derivatives {
    pub(super) squares: f64,
    pub(super) sums: Sums,
    pub(super) origins: Vec<f64>,
    pub(super) directions: Vec<f64>,
    pub(super) failed: usize,
}

/// Computes the derivatives of a loss.
pub(super) fn derivatives(
    py: Python<'_>,
    course: &Course,
    starts: &Starts,
    loss: &Loss,
) -> PyResult<Derivatives> {
    let count = starts.len();
    ask_for_memory(count, 6 * size_of::<f64>(), "rays")?;
    let layout = layout(course)?;
    let (mut origins, mut directions) = (vec![0.0; 3 * count], vec![0.0; 3 * count]);
    let bytes = size_of::<f64>() * course.sum_count().max(1);
    let sums = (MAX_SUM_BYTES / bytes)
        .clamp(2, MAX_SUMS)
        .min(count.div_ceil(BLOCK))
        .max(1);
    let per_share = count.div_ceil(sums).max(1);
    let work = |shared: &Shared| {
        let columns = origins
            .chunks_mut(3 * per_share)
            .zip(directions.chunks_mut(3 * per_share));
        let share = |(number, (by_origins, by_directions))| Share {
            first: number * per_share,
            by_origins,
            by_directions,
            sums: LayoutDerivative::new(&layout, course.receiver),
            squares: 0.0,
            failed: 0,
        };
        let mut shares: Vec<Share> = columns.enumerate().map(share).collect();
        let each = shares.par_iter_mut();
        each.for_each(|share| share.pull_back(course, &layout, starts, loss, shared));
        let zero = LayoutDerivative::new(&layout, course.receiver);
        added(zero, shares)
    };
    let (sums, squares, failed) = not_interrupted(watched(py, None, None, work)?)?;
    Ok(Derivatives {
        squares,
        sums,
        origins,
        directions,
        failed,
    })
}

/// Adds up the sums of all shares in their order, the sums of squares, and the numbers of failed
/// rays.
fn added(mut total: LayoutDerivative, shares: Vec<Share>) -> (Sums, f64, usize) {
    let (mut squares, mut failed) = (0.0, 0);
    for share in shares {
        squares += share.squares;
        failed += share.failed;
        total.merge(&share.sums);
    }
    (total.into(), squares, failed)
}
