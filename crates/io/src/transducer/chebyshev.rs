//! Polynomial interpolation of values on a grid from values at fewer nodes
//! (docs/theory.md#transducers).
//!
//! Along any line, sound varies at most as fast as e^{±ikx}. About π Chebyshev nodes per wavelength
//! represent it completely, whereas a grid for splines has ten points.

use super::quadrature::Density;
use super::{Places, TransducerError};
use glam::DVec3;
use std::f64::consts::PI;

/// Nodes in the box of a grid; x runs fastest.
pub(super) struct Chebyshev<'p> {
    places: &'p Places,
    axes: [Axis; 3],
}

/// Nodes along an axis, in steps of the grid.
struct Axis {
    nodes: Vec<f64>,
    /// Weights of the nodes at the grid's points, a row for each point; `None` if nodes and points
    /// coincide.
    weights: Option<Vec<Vec<f64>>>,
}

/// Largest number of weights of an axis.
const MAX_WEIGHTS: f64 = 2e7;

impl<'p> Chebyshev<'p> {
    /// Makes the nodes for sound that varies as fast as `density` states.
    pub(super) fn new(places: &'p Places, density: &Density) -> Result<Self, TransducerError> {
        let axis = |i: usize| {
            let size = places.size[i];
            let length = places.steps[i].length() * (size.max(2) - 1) as f64;
            Axis::new(size, density.degree(length))
        };
        let axes = [axis(0)?, axis(1)?, axis(2)?];
        Ok(Chebyshev { places, axes })
    }

    /// Returns the number of nodes.
    pub(super) fn count(&self) -> usize {
        self.axes.iter().map(|axis| axis.nodes.len()).product()
    }

    /// Returns the position of a node.
    pub(super) fn at(&self, i: usize) -> DVec3 {
        let [x, y, z] = &self.axes;
        let (a, b) = (x.nodes.len(), y.nodes.len());
        self.places
            .of([x.nodes[i % a], y.nodes[i / a % b], z.nodes[i / a / b]])
    }

    /// Interpolates values at the grid's points from values at the nodes.
    pub(super) fn interpolate(&self, values: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let (mut values, mut inner) = (values, 1);
        for (axis, size) in self.axes.iter().zip(self.places.size) {
            values = axis.interpolate(values, inner);
            inner *= size;
        }
        values
    }
}

impl Axis {
    /// Makes the nodes for `size` points and polynomials of a degree. If this takes no fewer nodes
    /// than points, the points are the nodes.
    fn new(size: usize, degree: f64) -> Result<Self, TransducerError> {
        let count = (degree + 1.0).min(size as f64);
        if count == size as f64 {
            let nodes = (0..size).map(|i| i as f64).collect();
            return Ok(Axis {
                nodes,
                weights: None,
            });
        }
        if count * size as f64 > MAX_WEIGHTS {
            return Err(TransducerError::LongBox { samples: size });
        }
        let count = count as usize;
        let angle = |j: usize| PI * (j as f64 + 0.5) / count as f64;
        let half = 0.5 * (size - 1) as f64;
        let nodes: Vec<f64> = (0..count).map(|j| half * (1.0 - angle(j).cos())).collect();
        // Use the barycentric formula.
        let row = |i: usize| -> Vec<f64> {
            let away = |j: usize| i as f64 - nodes[j];
            if let Some(hit) = (0..count).find(|j| away(*j) == 0.0) {
                return (0..count)
                    .map(|j| if j == hit { 1.0 } else { 0.0 })
                    .collect();
            }
            let sign = |j: usize| if j.is_multiple_of(2) { 1.0 } else { -1.0 };
            let terms: Vec<f64> = (0..count)
                .map(|j| sign(j) * angle(j).sin() / away(j))
                .collect();
            let sum: f64 = terms.iter().sum();
            terms.iter().map(|term| term / sum).collect()
        };
        let weights = Some((0..size).map(row).collect());
        Ok(Axis { nodes, weights })
    }

    /// Interpolates along an axis, from nodes to points. Neighbours along the axis are `inner`
    /// values apart.
    fn interpolate(&self, values: Vec<[f64; 2]>, inner: usize) -> Vec<[f64; 2]> {
        let Some(weights) = &self.weights else {
            return values;
        };
        let slab = self.nodes.len() * inner;
        let mut all = Vec::with_capacity(values.len() / self.nodes.len() * weights.len());
        for values in values.chunks_exact(slab) {
            for weights in weights {
                let start = all.len();
                all.resize(start + inner, [0.0; 2]);
                for (weight, row) in weights.iter().zip(values.chunks_exact(inner)) {
                    for ([re, im], [a, b]) in all[start..].iter_mut().zip(row) {
                        *re += weight * a;
                        *im += weight * b;
                    }
                }
            }
        }
        all
    }
}
