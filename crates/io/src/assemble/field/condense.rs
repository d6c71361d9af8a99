//! Grids of the index that are finer than their field needs.

use super::super::context::Context;
use super::super::sound_record::file_of;
use crate::scene::ObjectDescription;
use eikonal::field::Bspline;

/// Maximum relative change of n², independent of the samples' rounding: the resolution of single
/// precision.
const MAX_RELATIVE_CHANGE: f64 = 6e-7;
/// Rounding error of spline coefficients, relative to the range of n². Coefficients are stored in
/// single precision, and each filter adds rounding.
const COEFFICIENT_ROUNDING: f64 = 4.0 / (1u64 << 24) as f64;
/// Maximum deviation of a condensed spline from rounded samples, in units of the rounding. Rounded
/// samples are wrong by up to half a unit. A spline through a subset of millions of samples hardly
/// ever deviates from the others by more than two units.
const MAX_DEVIATION: f64 = 2.5;

/// Grid of the index that is stored with fewer samples than the scene gives, because fewer samples
/// describe the index equally well.
#[derive(Clone, Debug, PartialEq)]
pub struct CondensedGrid {
    /// Type of the volume.
    pub plugin: String,
    /// Name of the file in the scene; `None` if the scene holds the samples.
    pub file: Option<String>,
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// Number of stored samples along x, y, z.
    pub held: [usize; 3],
    /// Maximum change of n² by the reduction.
    pub tolerance: f64,
}

/// Returns the maximum change of n² that rounding hides. `ends` are the least and the largest n of
/// the samples, in either order. `rounding` is the standard deviation of the rounding of n.
pub(super) fn tolerance(ends: [f64; 2], rounding: f64) -> f64 {
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let of_samples = MAX_DEVIATION * 2.0 * most * rounding * 12f64.sqrt();
    let of_coefficients = COEFFICIENT_ROUNDING * (most * most - least * least);
    of_samples
        .max(of_coefficients)
        .min(MAX_RELATIVE_CHANGE * most * most)
}

/// Records that a grid of a file is stored as a field of fewer samples.
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
