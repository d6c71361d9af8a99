//! Rayleigh integral as a sum over surface points: P = (i p₀/λ) ∫ e^{−ikR}/R dA
//! (docs/theory.md#transducers).

use super::aperture::SurfacePoint;
use fearless_simd::{Level, dispatch};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Number of points whose sums vector instructions compute in parallel.
const BLOCK: usize = 8;
/// Constant 1.5 · 2⁵². Adding and then subtracting it rounds to a whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Points of a surface, with positions in wavelengths.
pub(super) struct Sources {
    points: Vec<Source>,
    wavelength: f64,
}

struct Source {
    place: DVec3,
    /// Complex factor of e^{−ikR}/R.
    strength: [f64; 2],
}

impl Sources {
    /// Makes the sources for points of a surface with the pressure ρcv `pressure`.
    pub(super) fn new(points: &[SurfacePoint], wavelength: f64, pressure: f64) -> Self {
        let source = |p: &SurfacePoint| {
            let size = pressure * p.weight * p.area / (wavelength * wavelength);
            let (sin, cos) = p.lag.sin_cos();
            // Multiply by i e^{−i lag}.
            Source {
                place: p.place / wavelength,
                strength: [size * sin, size * cos],
            }
        };
        Sources {
            points: points.iter().map(source).collect(),
            wavelength,
        }
    }

    /// Returns the number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns the amplitudes at `count` points. Each sum has a fixed order, whatever the number of
    /// threads.
    pub(super) fn amplitudes(
        &self,
        count: usize,
        place: impl Fn(usize) -> DVec3 + Sync,
    ) -> Vec<[f64; 2]> {
        let level = Level::new();
        let mut amplitudes = vec![[0.0; 2]; count];
        let blocks = amplitudes.par_chunks_mut(BLOCK).enumerate();
        blocks.for_each(|(block, amplitudes)| {
            // Fill the last block with copies of the last point.
            let places = std::array::from_fn(|i| {
                place((block * BLOCK + i).min(count - 1)) / self.wavelength
            });
            // Products and sums are rounded separately, so that all processors give equal bits.
            let sums = dispatch!(level, _simd => sums(&self.points, &places));
            amplitudes.copy_from_slice(&sums[..amplitudes.len()]);
        });
        amplitudes
    }
}

#[inline(always)]
fn sums(points: &[Source], places: &[DVec3; BLOCK]) -> [[f64; 2]; BLOCK] {
    let [x, y, z] = [0, 1, 2].map(|axis| places.map(|p| p[axis]));
    let (mut re, mut im) = ([0.0; BLOCK], [0.0; BLOCK]);
    for source in points {
        let (at, [a, b]) = (source.place, source.strength);
        for i in 0..BLOCK {
            let (dx, dy, dz) = (x[i] - at.x, y[i] - at.y, z[i] - at.z);
            let r = (dx * dx + dy * dy + dz * dz).sqrt();
            let [cos, sin] = turn(r);
            let per = 1.0 / r;
            re[i] += per * (a * cos + b * sin);
            im[i] += per * (b * cos - a * sin);
        }
    }
    std::array::from_fn(|i| [re[i], im[i]])
}

/// Returns cos 2πt and sin 2πt for t below 2⁵¹ turns, with errors up to 2e-9 and equal bits on all
/// processors.
#[inline(always)]
fn turn(t: f64) -> [f64; 2] {
    let half = PI * (t - ((t + ROUND) - ROUND));
    let q = half * half;
    // Use the Taylor series up to π/2.
    let sin = half
        * (1.0
            + q * (-1.0 / 6.0
                + q * (1.0 / 120.0
                    + q * (-1.0 / 5040.0
                        + q * (1.0 / 362_880.0
                            + q * (-1.0 / 39_916_800.0 + q / 6_227_020_800.0))))));
    let cos = 1.0
        + q * (-0.5
            + q * (1.0 / 24.0
                + q * (-1.0 / 720.0
                    + q * (1.0 / 40320.0
                        + q * (-1.0 / 3_628_800.0
                            + q * (1.0 / 479_001_600.0 - q / 87_178_291_200.0))))));
    [1.0 - 2.0 * sin * sin, 2.0 * sin * cos]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn turns_are_those_of_the_library() {
        for i in 0..100_000 {
            let t = 1e-3 * f64::from(i) + 1e-7 * f64::from(i % 7);
            let (sin, cos) = (TAU * t.fract()).sin_cos();
            let [c, s] = turn(t);
            assert!(
                (c - cos).abs() < 4e-9 && (s - sin).abs() < 4e-9,
                "{t}: {c} {cos} {s} {sin}"
            );
        }
    }
}
