//! 2-D density on the unit square that is bilinear between the values at its corners.

/// Cell with bilinear interpolation between the values at its corners.
#[derive(Clone, Copy, Debug)]
pub struct BilinearCell {
    /// Values ≥ 0 at y = 0 and at y = 1, each at x = 0 and at x = 1.
    corners: [[f64; 2]; 2],
}

impl BilinearCell {
    /// Creates the cell; `corners[y][x]` are the values at the corners, finite and ≥ 0.
    pub fn new(corners: [[f64; 2]; 2]) -> Self {
        BilinearCell { corners }
    }

    /// Returns the value at a point of [0, 1]².
    pub fn value(&self, [x, y]: [f64; 2]) -> f64 {
        let [above, below] = self.corners.map(|row| lerp(row, x));
        lerp([above, below], y)
    }

    /// Returns the mean of the values: their integral over the unit square.
    pub fn mean(&self) -> f64 {
        self.value([0.5; 2])
    }

    /// Samples a point with density proportional to the value; returns `u` if all corners are zero.
    pub fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let [above, below] = self.corners;
        let y = linear_sample([above[0] + above[1], below[0] + below[1]], u[1]);
        let across = [0, 1].map(|k| lerp([above[k], below[k]], y));
        [linear_sample(across, u[0]), y]
    }

    /// Inverts [`BilinearCell::sample`]: returns the `u` that it maps to a point of [0, 1]².
    pub fn inverse(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [above, below] = self.corners;
        let across = [0, 1].map(|k| lerp([above[k], below[k]], y));
        let along = [above[0] + above[1], below[0] + below[1]];
        [linear_inverse(across, x), linear_inverse(along, y)]
    }

    /// Returns the normalised density over the unit square; 1 if all corners are zero.
    pub fn pdf(&self, p: [f64; 2]) -> f64 {
        let mean = self.mean();
        if mean > 0.0 {
            self.value(p) / mean
        } else {
            1.0
        }
    }
}

fn lerp([a, b]: [f64; 2], t: f64) -> f64 {
    (1.0 - t) * a + t * b
}

/// Returns the t below which a fraction `u` of the integral of a (1 − t) + b t over [0, 1] lies.
pub(super) fn linear_sample([a, b]: [f64; 2], u: f64) -> f64 {
    let sum = a + b;
    if sum <= 0.0 || u <= 0.0 {
        return u.max(0.0);
    }
    // Solve a t + (b − a) t²/2 = u (a + b)/2, in the form without cancellation.
    let value = (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    (u * sum / (a + value)).min(1.0)
}

/// Returns the `u` that [`linear_sample`] maps to `t`.
pub(super) fn linear_inverse([a, b]: [f64; 2], t: f64) -> f64 {
    let sum = a + b;
    if sum > 0.0 {
        t * (2.0 * a + t * (b - a)) / sum
    } else {
        t
    }
}
