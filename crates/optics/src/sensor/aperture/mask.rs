//! Apertures of square cells.

use super::ApertureError;
use super::mask_pattern::MaskPattern;
use crate::sampling::Grid2;
use glam::DVec2;
use std::sync::{Arc, OnceLock};

/// Cells across the square around the disc of radius one, row by row from the top left as seen from
/// behind.
#[derive(Debug)]
pub(super) struct Mask {
    /// Number of cells along each side.
    side: usize,
    /// Amplitude of the field in each cell.
    amplitudes: Vec<f64>,
    /// Density proportional to the power that each cell transmits.
    power: Grid2,
    pattern: OnceLock<Arc<MaskPattern>>,
}

impl Mask {
    /// Creates the mask from amplitudes and powers, which are in [0, 1]. Where a power exceeds the
    /// square of its amplitude, the cell is partly open.
    pub(super) fn new(
        side: usize,
        amplitudes: Vec<f64>,
        powers: &[f64],
    ) -> Result<Self, ApertureError> {
        Ok(Mask {
            side,
            power: Grid2::new(side, side, powers)?,
            amplitudes,
            pattern: OnceLock::new(),
        })
    }

    /// Samples a point, uniformly by power; +x is to the left and +y upwards.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec2 {
        let ([x, y], _) = self.power.sample(u);
        DVec2::new(1.0 - 2.0 * x, 1.0 - 2.0 * y)
    }

    /// Returns the integral of the transmitted power.
    pub(super) fn area(&self) -> f64 {
        4.0 * self.power.integral()
    }

    /// Returns the diffraction pattern, which is computed once.
    pub(super) fn pattern(&self) -> Arc<MaskPattern> {
        let cells = (self.side * self.side) as f64;
        let compute = || {
            let power = cells * self.power.integral();
            Arc::new(MaskPattern::new(self.side, &self.amplitudes, power))
        };
        self.pattern.get_or_init(compute).clone()
    }
}
