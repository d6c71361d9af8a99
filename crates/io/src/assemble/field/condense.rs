//! Grids of the index that are finer than their field.

use super::super::context::Context;
use super::super::sound_record::file_of;
use crate::scene::ObjectDescription;
use eikonal::field::Bspline;

/// Most change of n² as part of it, whatever the samples were rounded to: what numbers of single precision allow.
const MOST: f64 = 6e-7;
/// Coefficients are kept in single precision, each filter of which adds to their rounding.
const OF_COEFFICIENTS: f64 = 4.0 / (1u64 << 24) as f64;
/// Rounded samples are half a unit off; the spline through some of millions, hardly ever more than two from the others.
const UNITS: f64 = 2.5;

/// A grid of the index that is held by fewer samples than it has, as they say the same.
#[derive(Clone, Debug, PartialEq)]
pub struct CondensedGrid {
    /// Type of the volume.
    pub plugin: String,
    /// Name of the file as the scene gives it; `None` if the scene holds the samples.
    pub file: Option<String>,
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// Number of samples that are held.
    pub held: [usize; 3],
    /// By how much n² may differ for this.
    pub tolerance: f64,
}

/// Most change of n² that rounding hides. `ends` are the least and the largest n of the samples, in either order, `rounding` the
/// standard deviation of theirs.
pub(super) fn tolerance(ends: [f64; 2], rounding: f64) -> f64 {
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let of_samples = UNITS * 2.0 * most * rounding * 12f64.sqrt();
    let of_coefficients = OF_COEFFICIENTS * (most * most - least * least);
    of_samples.max(of_coefficients).min(MOST * most * most)
}

/// Takes note of a grid of a file that a field of fewer samples stands for.
pub(super) fn note(
    size: [usize; 3],
    condensed: &Bspline,
    tolerance: f64,
    object: &ObjectDescription,
    context: &mut Context,
) {
    context.condensed.push(CondensedGrid {
        plugin: object.plugin.clone(),
        file: file_of(object),
        size,
        held: condensed.dims(),
        tolerance,
    });
}
