//! Reconstruction filters with negative lobes (docs/theory.md#film).

use std::f64::consts::PI;

/// Cells over which the density of samples is constant.
const CELLS: usize = 64;
/// Points of a cell by which its share is found, and the integral of the filter.
const POINTS: usize = 16;

/// Shapes of filters with negative lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kernel {
    /// Two cubics.
    Cubic { b: f64, c: f64 },
    /// A windowed sinc.
    Lanczos { lobes: f64 },
}

/// A filter with negative lobes. Samples are drawn nearly in proportion to its modulus, and weigh what the filter is there over
/// their density: their mean is the filtered image, and some weights are negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedFilter {
    kernel: Kernel,
    /// The integral of the kernel.
    integral: f64,
    /// Shares of the cells up to each bound.
    cdf: [f64; CELLS + 1],
}

impl SignedFilter {
    /// The cubic filters of Mitchell and Netravali (1988), of radius 2: `b` and `c` are finite; ⅓ and ⅓ are their choice, 0 and ½
    /// are Catmull and Rom's.
    pub fn cubic(b: f64, c: f64) -> Self {
        Self::new(Kernel::Cubic { b, c })
    }

    /// The sinc in the window of a wider one, with `lobes` lobes on either side: 1 to 16 pixels in radius.
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

    /// Largest distance at which it is not zero, in pixels.
    pub(super) fn radius(&self) -> f64 {
        match self.kernel {
            Kernel::Cubic { .. } => 2.0,
            Kernel::Lanczos { lobes } => lobes,
        }
    }

    /// The filter, per pixel: its integral is 1.
    pub(super) fn value(&self, offset: f64) -> f64 {
        self.kernel.at(offset) / self.integral
    }

    /// The offset of a sample.
    pub(super) fn sample(&self, u: f64) -> f64 {
        let cell = self
            .cdf
            .partition_point(|below| *below <= u)
            .clamp(1, CELLS)
            - 1;
        let share = self.cdf[cell + 1] - self.cdf[cell];
        self.bound(cell) + (u - self.cdf[cell]) / share * self.cell_width()
    }

    /// The density of samples, per pixel.
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

    /// Where a cell begins.
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

/// sin(πx)/(πx).
fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    (PI * x).sin() / (PI * x)
}
