//! Smooth fields from fewer samples (docs/theory.md#sampled-fields).

use super::homogeneous::HomogeneousBlocks;
use super::lattice::{Lattice, Placement};
use super::thinned::{Thinned, coefficients};
use super::values::{Samples, Taps, Values, plane};
use super::{Bspline, ROUNDINGS};
use crate::bounds::Aabb;
use glam::{BVec3, DVec3};
use std::sync::Arc;

/// Smallest number of coefficients of grids that are condensed. Smaller grids fit into the
/// processor's cache.
const MIN_COEFFICIENTS: usize = 1 << 20;
/// Factors by which samples along an axis are thinned, if at least `MIN_SAMPLES` of them are kept.
const FACTORS: [usize; 5] = [8, 6, 4, 3, 2];
const MIN_SAMPLES: usize = 16;
/// Index after the last factor: no thinning.
const NONE: usize = FACTORS.len();
/// Largest number of samples along an axis: whole lines are examined, which pays off for many
/// parallel lines.
const MAX_SAMPLES: usize = 1 << 13;
/// Number of lines along an axis that are examined before any grid is computed, along each of the
/// two other axes.
const LINES: usize = 24;
/// Maximum number of grids that are tried. Each has more samples along the axis that contributes
/// most to an excessive change by the previous grid.
const MAX_TRIES: usize = 6;
/// Factor on the tolerance. A sum of changes along the three axes that exceeds the product is
/// certainly too large. Each change contains the rounding of the sample, at most a fifth of the
/// tolerance; the combined change contains it only once.
const EXCESS_FACTOR: f64 = 1.4;
/// Step between planes that are compared, so that the comparison finds differences early.
const PLANE_STRIDE: usize = 7;

impl Bspline {
    /// Creates a field through fewer samples than are given. n² changes at no sample by more than
    /// `tolerance`, and as few as an eighth of the samples are stored along each axis. Parameters
    /// follow [`Bspline::from_vec`], without noise. Only the stored samples take memory.
    ///
    /// `None` for grids that are small, constant, longer than 8192 samples, or as fine as
    /// necessary; for a tolerance that is not finite; and for input that [`Bspline::from_vec`]
    /// rejects.
    ///
    /// Where the samples do not change, rays are still straight lines.
    pub fn from_fewer<T: Copy + Into<f64>>(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: &[T],
        index: impl Fn(f64) -> f64,
        tolerance: f64,
    ) -> Option<Bspline> {
        let lattice = Lattice::new(dims, bounds, placement).ok()?;
        if lattice.stored() < MIN_COEFFICIENTS {
            return None;
        }
        let samples = Samples::new(dims, samples, index)?;
        let (lattice_of_fewer, data) = fewer(&lattice, &samples, tolerance)?;
        let homogeneous = HomogeneousBlocks::of_samples(&lattice, &samples);
        Some(Bspline {
            homogeneous: homogeneous.map(Arc::new),
            interpolates: false,
            ..Self::of_coefficients(lattice_of_fewer, samples.n2_ref(), data, Some(1.0))
        })
    }

    /// Returns this field with fewer of its samples, like [`Bspline::from_fewer`]. Returns `None`
    /// in the cases listed there.
    pub fn condensed(&self, tolerance: f64) -> Option<Bspline> {
        if self.is_constant() || self.lattice.stored() < MIN_COEFFICIENTS {
            return None;
        }
        let (lattice, data) = fewer(&self.lattice, self, tolerance)?;
        Some(Bspline {
            homogeneous: self.homogeneous.clone(),
            interpolates: false,
            // Include the rounding of the original coefficients and of the new ones.
            ..Self::of_coefficients(lattice, self.n2_ref, data, Some(ROUNDINGS))
        })
    }
}

/// Finds the smallest number of samples that change no value by more than a tolerance. Returns
/// their lattice, and the coefficients, in rows, of the spline through them.
fn fewer(lattice: &Lattice, values: &impl Values, tolerance: f64) -> Option<(Lattice, Vec<f32>)> {
    let dims = values.dims();
    if !tolerance.is_finite() || dims.into_iter().any(|count| count > MAX_SAMPLES) {
        return None;
    }
    // Planted error "grids condensed beyond their tolerance", found by morgana-eikonal/eikonal::condensed::grids_as_fine_as_their_field_stay:
    // let tolerance = 1e3 * tolerance; let axes = [0, 1, 2].map(|axis| Axis::new(axis, values, tolerance));
    let axes = [0, 1, 2].map(|axis| Axis::new(axis, values, tolerance));
    let mut chosen = axes.each_ref().map(|axis| axis.allowed);
    let worst = axes.iter().map(|axis| axis.worst);
    let mut suspects = Changes::of(&worst.chain(spread(dims)).collect::<Vec<_>>(), values);
    for _ in 0..MAX_TRIES {
        // Thin less where known samples change too much.
        while let Some(suspect) = suspects
            .iter()
            .find(|s| s.sum(chosen).abs() > EXCESS_FACTOR * tolerance)
        {
            chosen[suspect.largest(chosen)] += 1;
        }
        if chosen == [NONE; 3] {
            return None;
        }
        // Compute the spline through the kept samples, and look for a sample that changes too much.
        let factors = chosen.map(|i| FACTORS.get(i).copied().unwrap_or(1));
        let thinned = [0, 1, 2].map(|axis| Thinned::new(dims[axis], factors[axis]));
        let coarse = lattice_of_fewer(lattice, thinned.each_ref().map(Thinned::count));
        let data = coefficients(values, &thinned, &coarse);
        let Some(sample) = difference(values, &coarse, &data, tolerance) else {
            return Some((coarse, data));
        };
        let suspect = Changes::of(&[sample], values)[0];
        // Refine even if the sum is small: together the changes were excessive.
        if suspect.sum(chosen).abs() <= EXCESS_FACTOR * tolerance {
            chosen[suspect.largest(chosen)] += 1;
        }
        suspects.push(suspect);
    }
    None
}

/// Samples all over a grid, and near its faces, where splines through fewer samples fit worst.
fn spread(dims: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let along = move |axis: usize, i: usize| {
        let last = dims[axis] - 1;
        let near_faces = [last.min(2), last.saturating_sub(2)];
        [
            near_faces[0],
            last / 4,
            last / 2,
            3 * last / 4,
            near_faces[1],
        ][i]
    };
    (0..125).map(move |i| [along(0, i % 5), along(1, i / 5 % 5), along(2, i / 25)])
}

/// Limit to which samples along one axis can be thinned, estimated from some lines along it.
struct Axis {
    /// Index of the first factor by which samples can be thinned along this axis alone.
    allowed: usize,
    /// Sample with the largest change by this thinning.
    worst: [usize; 3],
}

impl Axis {
    fn new(axis: usize, values: &impl Values, tolerance: f64) -> Self {
        let dims = values.dims();
        let starts = starts(dims, axis);
        let tried = FACTORS.iter().enumerate().find_map(|(i, factor)| {
            let thinned = Thinned::new(dims[axis], *factor);
            let (change, worst) = match thinned.count() {
                0..MIN_SAMPLES => return None,
                _ => thinned.worst(axis, &starts, values),
            };
            (change <= tolerance).then_some((i, worst))
        });
        let (allowed, worst) = tried.unwrap_or((NONE, [0; 3]));
        Axis { allowed, worst }
    }
}

/// Changes of one sample, by axis and by the factor of thinning along this axis alone. Small
/// changes along several axes add up.
#[derive(Clone, Copy, Default)]
struct Changes([[f64; FACTORS.len()]; 3]);

impl Changes {
    /// Computes the changes of each of some samples.
    fn of(samples: &[[usize; 3]], values: &impl Values) -> Vec<Self> {
        let mut all = vec![Changes::default(); samples.len()];
        for axis in 0..3 {
            for (place, factor) in FACTORS.into_iter().enumerate() {
                let thinned = Thinned::new(values.dims()[axis], factor);
                let found = thinned.changes(axis, samples, values);
                for (changes, change) in all.iter_mut().zip(found) {
                    changes.0[axis][place] = change;
                }
            }
        }
        all
    }

    /// Returns the change along an axis by the factor chosen there; zero if the axis is not
    /// thinned.
    fn along(&self, chosen: [usize; 3], axis: usize) -> f64 {
        self.0[axis].get(chosen[axis]).copied().unwrap_or(0.0)
    }

    fn sum(&self, chosen: [usize; 3]) -> f64 {
        (0..3).map(|axis| self.along(chosen, axis)).sum()
    }

    /// Returns the thinned axis that contributes most to the change.
    fn largest(&self, chosen: [usize; 3]) -> usize {
        let along = (0..3).filter(|axis| chosen[*axis] < NONE);
        let size = |axis: &usize| self.along(chosen, *axis).abs();
        along
            .max_by(|a, b| size(a).total_cmp(&size(b)))
            .unwrap_or(0)
    }
}

/// Returns the first samples of some lines along an axis.
fn starts(dims: [usize; 3], axis: usize) -> Vec<[usize; 3]> {
    let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
    let some = |axis: usize| {
        let mut places: Vec<usize> = (0..LINES).map(|i| i * dims[axis] / LINES).collect();
        places.dedup();
        places
    };
    let mut starts = Vec::new();
    for i in some(across) {
        for j in some(other) {
            let mut sample = [0; 3];
            (sample[across], sample[other]) = (i, j);
            starts.push(sample);
        }
    }
    starts
}

/// Returns a lattice with fewer samples, from the first sample of each axis to the last.
fn lattice_of_fewer(lattice: &Lattice, dims: [usize; 3]) -> Lattice {
    let last = lattice.dims().map(|n| n - 1);
    let (start, end) = (lattice.position([0; 3]), lattice.position(last));
    // Use the spacing as thickness along an axis with one sample, where any thickness is right.
    let flat = BVec3::from_array(last.map(|i| i == 0));
    let end = DVec3::select(flat, end + lattice.spacing(), end);
    let bounds = Aabb::new(start, end);
    Lattice::new(dims, bounds, Placement::Nodes).expect("smaller than a valid grid")
}

/// Finds a sample where a spline, of coefficients in rows, differs from values by more than a
/// tolerance.
fn difference(
    values: &impl Values,
    lattice: &Lattice,
    data: &[f32],
    tolerance: f64,
) -> Option<[usize; 3]> {
    let dims = values.dims();
    let taps = [0, 1, 2].map(|axis| {
        let intervals = |count: usize| (count - 1).max(1) as f64;
        let scale = intervals(lattice.dims()[axis]) / intervals(dims[axis]);
        let places = (0..dims[axis]).map(|i| Taps::at(i as f64 * scale));
        places.collect::<Vec<_>>()
    });
    let add = |[j, k]: [usize; 2], weight: f64, sums: &mut [f64]| {
        let row = &data[lattice.offset([0, j, k])..];
        let terms = sums.iter_mut().zip(row);
        terms.for_each(|(sum, c)| *sum += weight * f64::from(*c));
    };
    let (mut here, mut there) = (vec![0.0; dims[0] * dims[1]], vec![0.0; dims[0] * dims[1]]);
    let planes = (0..PLANE_STRIDE).flat_map(|first| (first..dims[2]).step_by(PLANE_STRIDE));
    for k in planes {
        values.plane(k, &mut here);
        plane(lattice.stored_dims(), &taps, k, &add, &mut there);
        let is_apart = |(a, b): (&f64, &f64)| (b - a).abs() > tolerance;
        for (j, (here, there)) in here.chunks(dims[0]).zip(there.chunks(dims[0])).enumerate() {
            let pairs = here.iter().zip(there);
            // Test the whole row with vector instructions first, because differences are rare.
            if pairs.clone().fold(false, |any, pair| any | is_apart(pair)) {
                let i = pairs.clone().position(is_apart)?;
                return Some([i, j, k]);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along one axis, the predicted change at a sample equals the change by the spline through
    /// fewer samples, to the rounding of coefficients.
    #[test]
    fn changes_at_samples_are_foretold() {
        let rough =
            |x: DVec3| 1.3 + 1e-2 * (9.0 * x.x).sin() * (7.0 * x.y).cos() + 1e-2 * x.z.powi(3);
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let fine = Bspline::from_fn([61, 50, 43], bounds, Placement::Nodes, rough).unwrap();
        let dims = fine.dims();
        let mut most = 0.0;
        for (axis, place) in [(0, 0), (1, 2), (2, 4)] {
            let factor = |a: usize| if a == axis { FACTORS[place] } else { 1 };
            let thinned = [0, 1, 2].map(|a| Thinned::new(dims[a], factor(a)));
            let coarse = lattice_of_fewer(&fine.lattice, thinned.each_ref().map(Thinned::count));
            let data = coefficients(&fine, &thinned, &coarse);
            let fewer = Bspline::of_coefficients(coarse, fine.n2_ref, data, Some(ROUNDINGS));
            let (fine_field, fewer) = (crate::Field::from(fine.clone()), crate::Field::from(fewer));
            let mut chosen = [NONE; 3];
            chosen[axis] = place;
            for sample in [[0, 0, 0], [7, 11, 5], [30, 49, 21], [60, 25, 42]] {
                let x = fine.lattice.position(sample);
                let change = fewer.jet(x).n2 - fine_field.jet(x).n2;
                let foretold = Changes::of(&[sample], &fine)[0].sum(chosen);
                assert!(
                    (change - foretold).abs() < 2e-8,
                    "{sample:?}: {change} {foretold}"
                );
                most = f64::max(most, change.abs());
            }
        }
        assert!(most > 1e-6, "{most}");
    }
}
