//! Collisions where the extinction varies
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use crate::Spectrum;
use crate::medium::Medium;
use crate::scene::{MediumId, Scene};
use crate::volume::{VolumeGrid, VolumeTexture};
use glam::DVec3;

/// Minimum probability of the rarer of real and null collisions. Where either vanishes, its
/// derivative does not.
const MIN_PROBABILITY: f64 = 0.0625;

/// Difference from 1 below which a fraction counts as 1.
const ROUNDING: f64 = 1e-12;

/// Extinction by which flights collide, for each medium of a scene: the medium's extinction if it
/// is uniform, otherwise its maximum over all positions and channels.
#[derive(Clone, Debug)]
pub(crate) struct Majorants(Vec<Spectrum>);

impl Majorants {
    /// Computes the majorants of a scene whose samples have `channels` channels.
    pub(crate) fn new(scene: &Scene, channels: usize) -> Self {
        let of = |medium: &Medium| match &medium.sigma_t {
            VolumeTexture::Uniform(sigma) => *sigma * medium.scale,
            VolumeTexture::Grid(grid) => {
                let [_, most] = grid.extremes(channels);
                Spectrum::splat(most * medium.scale)
            }
        };
        Majorants(scene.media().iter().map(of).collect())
    }

    pub(super) fn of(&self, medium: MediumId) -> Spectrum {
        self.0[medium]
    }

    /// Returns the probability that a collision in a medium is real; `None` if it always is.
    pub(super) fn acceptance_ratio<'a>(
        &self,
        scene: &'a Scene,
        medium: MediumId,
    ) -> Option<AcceptanceRatio<'a>> {
        let (most, medium) = (self.0[medium][0], scene.medium(medium));
        match &medium.sigma_t {
            VolumeTexture::Uniform(_) => None,
            VolumeTexture::Grid(grid) => Some(AcceptanceRatio {
                grid,
                unit: medium.scale / most,
            }),
        }
    }
}

/// Ratio of a varying extinction to its majorant: the probability of a real collision.
#[derive(Clone, Copy, Debug)]
pub(super) struct AcceptanceRatio<'a> {
    grid: &'a VolumeGrid,
    /// Factor on the grid.
    unit: f64,
}

impl AcceptanceRatio<'_> {
    /// Returns the ratio of each channel at a position.
    pub(super) fn at(&self, x: DVec3) -> Spectrum {
        (self.grid.at(x) * self.unit).map(|share| share.min(1.0))
    }

    /// Returns the gradient of Σ `channel_weights` × log(ratio) at a position, summed over
    /// channels. For a null collision it is the gradient of Σ `channel_weights` × log(1 − ratio).
    pub(super) fn log_gradient(&self, x: DVec3, channel_weights: Spectrum, is_real: bool) -> DVec3 {
        let share = self.at(x);
        let by = if is_real {
            over(channel_weights, share)
        } else {
            // Planted error "collisions that did not happen, and do not change where they move to", found by morgana-transport/transport::index_absorption:
            // Spectrum::ZERO
            over(channel_weights, share.map(|share| 1.0 - share)) * -1.0
        };
        self.grid.gradient(x, by * self.unit)
    }
}

/// Returns the probability with which a collision with this ratio is followed. Derivatives treat it
/// as constant.
pub(super) fn probability(share: f64) -> f64 {
    if share > 0.0 && share < 1.0 - ROUNDING {
        share.clamp(MIN_PROBABILITY, 1.0 - MIN_PROBABILITY)
    } else {
        share
    }
}

/// Returns the gradient of Σ `channel_weights` × log(albedo) at a position, summed over channels.
pub(super) fn log_albedo_gradient(medium: &Medium, x: DVec3, channel_weights: Spectrum) -> DVec3 {
    match &medium.albedo {
        VolumeTexture::Uniform(_) => DVec3::ZERO,
        // Planted error "albedo that does not change where a collision moves to", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
        // VolumeTexture::Grid(grid) => grid.gradient(x, over(channel_weights, grid.at(x))) * 0.0,
        VolumeTexture::Grid(grid) => grid.gradient(x, over(channel_weights, grid.at(x))),
    }
}

/// Returns a quotient, zero in channels where `channel_weights` is zero.
fn over(channel_weights: Spectrum, by: Spectrum) -> Spectrum {
    let each = |c: usize| {
        if channel_weights[c] == 0.0 {
            0.0
        } else {
            channel_weights[c] / by[c]
        }
    };
    Spectrum(std::array::from_fn(each))
}
