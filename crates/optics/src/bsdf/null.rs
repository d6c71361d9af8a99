//! A boundary that light passes straight through, such as the hull of a medium.

use super::{BsdfSample, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;

/// Always straight on.
pub(super) fn sample(s: &Surface, toward: DVec3) -> BsdfSample {
    BsdfSample {
        direction: -toward,
        weight: Spectrum::splat(weight(s, toward)),
        pdf: 1.0,
        delta: true,
        transmitted: true,
    }
}

/// nᵢ²/nₒ², with o the side of `toward`: the factor on L̃ = L/n² from the far side.
///
/// A null boundary is declared index-matched: the ray does not bend, so L itself goes through, and with
/// it the energy. Where the indices match, as they should, this is 1. Where they do not, the
/// boundary is unphysical (it keeps energy but not étendue), and not reciprocal: a walk from an emitter
/// carries power, which passes without any factor.
pub fn weight(s: &Surface, toward: DVec3) -> f64 {
    let side = s.facing(toward);
    let ratio = side.n_far / side.n_near;
    ratio * ratio
}
