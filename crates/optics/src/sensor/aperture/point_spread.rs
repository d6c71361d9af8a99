//! Diffraction at the aperture (docs/theory.md#diffraction-at-the-aperture).

use super::encircled_energy::EncircledEnergy;
use super::mask_pattern::MaskPattern;
use super::{ApertureShape, Shape};
use crate::sampling::Sampler;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Number of samples for computing a median.
const SAMPLES: u64 = 200_000;

/// Point spread function of an aperture: the diffraction image of a point in incoherent light of
/// one wavelength. The image of the sensor is the image of geometrical optics, convolved with this
/// function.
#[derive(Clone, Debug)]
pub struct PointSpread {
    pattern: Pattern,
    /// Image units along each axis of the image for a reduced radius of 1 in vacuum.
    scale: [f64; 2],
}

#[derive(Clone, Debug)]
enum Pattern {
    /// Pattern of a ring, which is rotationally symmetric.
    Ring(Arc<EncircledEnergy>),
    Mask(Arc<MaskPattern>),
}

impl PointSpread {
    /// Creates the function of an aperture; `scale` is the size on the image of a reduced radius of
    /// 1.
    pub(in crate::sensor) fn new(aperture: &ApertureShape, scale: [f64; 2]) -> Self {
        let pattern = match &aperture.0 {
            Shape::Ring(obscuration) => Pattern::Ring(Arc::new(EncircledEnergy::new(*obscuration))),
            Shape::Mask(mask) => Pattern::Mask(mask.pattern()),
        };
        PointSpread { pattern, scale }
    }

    /// Samples the displacement of light from its geometric image position, in units of the image.
    /// Its density is the point spread function. `draw` returns pairs of numbers uniform in [0, 1),
    /// and is called once or twice. `index` is the refractive index at the sensor.
    pub fn offset(&self, index: f64, mut draw: impl FnMut() -> [f64; 2]) -> [f64; 2] {
        let [x, y] = match &self.pattern {
            Pattern::Ring(energy) => {
                let [u, turn] = draw();
                let (sin, cos) = (TAU * turn).sin_cos();
                [cos, sin].map(|along| energy.radius(u) * along)
            }
            Pattern::Mask(pattern) => pattern.sample(draw(), draw()),
        };
        // Planted error "diffraction as wide in a medium as in vacuum", found by morgana-transport/transport::diffraction::the_pattern_shrinks_in_a_medium_and_stays_in_place_in_a_crop:
        // [x / index.signum() * self.scale[0], y / index.signum() * self.scale[1]]
        [x / index * self.scale[0], y / index * self.scale[1]]
    }

    /// Returns the median distance of light from its geometric position, in units such as pixels.
    /// `size` is the width and height of the image in these units. The error is 0.5 %.
    pub fn median(&self, index: f64, size: [f64; 2]) -> f64 {
        let distance = |sample: u64| {
            let mut sampler = Sampler::new(0, 0, sample);
            let [x, y] = self.offset(index, || sampler.next_2d());
            (x * size[0]).hypot(y * size[1])
        };
        let mut distances: Vec<f64> = (0..SAMPLES).map(distance).collect();
        let (_, median, _) = distances.select_nth_unstable_by(SAMPLES as usize / 2, f64::total_cmp);
        *median
    }
}
