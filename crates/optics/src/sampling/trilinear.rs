//! 3-D density on the unit cube that is trilinear between the values at its corners.

use super::bilinear::{BilinearCell, linear_inverse, linear_sample};

/// Cell with trilinear interpolation between the values at its corners.
#[derive(Clone, Copy, Debug)]
pub struct TrilinearCell {
    /// Values ≥ 0 at z = 0 and at z = 1, each at y = 0 and 1, each at x = 0 and 1.
    corners: [[[f64; 2]; 2]; 2],
}

impl TrilinearCell {
    /// Creates the cell; `corners[z][y][x]` are the values at the corners, finite and ≥ 0.
    pub fn new(corners: [[[f64; 2]; 2]; 2]) -> Self {
        TrilinearCell { corners }
    }

    /// Returns the value at a point of [0, 1]³.
    pub fn value(&self, [x, y, z]: [f64; 3]) -> f64 {
        self.slice(z).value([x, y])
    }

    /// Returns the mean of the values: their integral over the unit cube.
    pub fn mean(&self) -> f64 {
        self.value([0.5; 3])
    }

    /// Samples a point with density proportional to the value; returns `u` if all corners are zero.
    pub fn sample(&self, u: [f64; 3]) -> [f64; 3] {
        let z = linear_sample(self.along_z(), u[2]);
        let [x, y] = self.slice(z).sample([u[0], u[1]]);
        [x, y, z]
    }

    /// Inverts [`TrilinearCell::sample`]: returns the `u` that it maps to a point of [0, 1]³.
    pub fn inverse(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [u, v] = self.slice(z).inverse([x, y]);
        [u, v, linear_inverse(self.along_z(), z)]
    }

    /// Returns the normalised density over the unit cube; 1 if all corners are zero.
    pub fn pdf(&self, p: [f64; 3]) -> f64 {
        let mean = self.mean();
        if mean > 0.0 {
            self.value(p) / mean
        } else {
            1.0
        }
    }

    /// Returns the cross section of the cell at height `z`.
    fn slice(&self, z: f64) -> BilinearCell {
        let [near, far] = self.corners;
        let mix = |j: usize, i: usize| (1.0 - z) * near[j][i] + z * far[j][i];
        BilinearCell::new([0, 1].map(|j| [0, 1].map(|i| mix(j, i))))
    }

    /// Returns the means over the faces at z = 0 and z = 1.
    fn along_z(&self) -> [f64; 2] {
        self.corners.map(|face| BilinearCell::new(face).mean())
    }
}
