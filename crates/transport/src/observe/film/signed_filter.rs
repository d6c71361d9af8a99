//! Reconstruction filters with negative lobes (docs/theory.md#film).

use std::f64::consts::PI;

/// Number of cells with constant sampling density.
const CELLS: usize = 64;
/// Number of quadrature points per cell, for its probability and for the integral of the filter.
const POINTS: usize = 16;

/// Shapes of filters with negative lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kernel {
    /// Piecewise cubic of two pieces.
    Cubic { b: f64, c: f64 },
    /// Windowed sinc.
    Lanczos { lobes: f64 },
}

/// Reconstruction filter with negative lobes. Samples are drawn nearly in proportion to its
/// modulus. A sample's weight is the filter's value divided by the sample's density. The mean of
/// the weighted samples is the filtered image; some weights are negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedFilter {
    kernel: Kernel,
    /// Integral of the kernel.
    integral: f64,
    /// Cumulative probabilities of the cells at each bound.
    cdf: [f64; CELLS + 1],
}

impl SignedFilter {
    /// Creates a cubic filter of Mitchell and Netravali (1988), of radius 2. `b` and `c` are
    /// finite; Mitchell and Netravali chose ⅓ and ⅓, Catmull and Rom 0 and ½.
    pub fn cubic(b: f64, c: f64) -> Self {
        Self::new(Kernel::Cubic { b, c })
    }

    /// Creates a sinc windowed by a wider sinc, with `lobes` lobes on either side. Its radius is
    /// `lobes` pixels, clamped to 1 to 16.
    pub fn lanczos(lobes: u8) -> Self {
        let lobes = f64::from(lobes.clamp(1, 16));
        Self::new(Kernel::Lanczos { lobes })
    }

    fn new(kernel: Kernel) -> Self {
        let mut filter = SignedFilter {
            kernel,
            integral: 1.0,
            cdf: [0.0; CELLS + 1],
        };
        let width = filter.cell_width();
        let point = |cell: usize, k: usize| {
            let within = (k as f64 + 0.5) / POINTS as f64;
            kernel.at(filter.bound(cell) + within * width)
        };
        let (mut integral, mut total) = (0.0, 0.0);
        let mut cdf = [0.0; CELLS + 1];
        for cell in 0..CELLS {
            for value in (0..POINTS).map(|k| point(cell, k)) {
                integral += value;
                total += value.abs();
            }
            cdf[cell + 1] = total;
        }
        filter.integral = integral * width / POINTS as f64;
        filter.cdf = cdf.map(|below| below / total);
        filter
    }

    /// Returns the largest distance at which the filter is not zero, in pixels.
    pub(super) fn radius(&self) -> f64 {
        match self.kernel {
            Kernel::Cubic { .. } => 2.0,
            Kernel::Lanczos { lobes } => lobes,
        }
    }

    /// Returns the value of the filter, per pixel; the filter's integral is 1.
    pub(super) fn value(&self, offset: f64) -> f64 {
        self.kernel.at(offset) / self.integral
    }

    /// Samples an offset from the pixel's centre; `u` is uniform in [0, 1).
    pub(super) fn sample(&self, u: f64) -> f64 {
        let cell = self
            .cdf
            .partition_point(|below| *below <= u)
            .clamp(1, CELLS)
            - 1;
        let share = self.cdf[cell + 1] - self.cdf[cell];
        self.bound(cell) + (u - self.cdf[cell]) / share * self.cell_width()
    }

    /// Returns the density of samples, per pixel.
    pub(super) fn pdf(&self, offset: f64) -> f64 {
        let cell = ((offset + self.radius()) / self.cell_width()).floor();
        if (0.0..CELLS as f64).contains(&cell) {
            let cell = cell as usize;
            (self.cdf[cell + 1] - self.cdf[cell]) / self.cell_width()
        } else {
            0.0
        }
    }

    fn cell_width(&self) -> f64 {
        2.0 * self.radius() / CELLS as f64
    }

    /// Returns the lower end of a cell's interval of offsets.
    fn bound(&self, cell: usize) -> f64 {
        cell as f64 * self.cell_width() - self.radius()
    }
}

impl Kernel {
    fn at(self, offset: f64) -> f64 {
        let x = offset.abs();
        match self {
            Kernel::Cubic { b, c } if x < 1.0 => {
                let cubic = (12.0 - 9.0 * b - 6.0 * c) * x - 18.0 + 12.0 * b + 6.0 * c;
                (cubic * x * x + 6.0 - 2.0 * b) / 6.0
            }
            Kernel::Cubic { b, c } if x < 2.0 => {
                let cubic = (-b - 6.0 * c) * x + 6.0 * b + 30.0 * c;
                ((cubic * x - 12.0 * b - 48.0 * c) * x + 8.0 * b + 24.0 * c) / 6.0
            }
            Kernel::Lanczos { lobes } if x < lobes => sinc(x) * sinc(x / lobes),
            _ => 0.0,
        }
    }
}

/// Returns sin(πx)/(πx).
fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    (PI * x).sin() / (PI * x)
}
