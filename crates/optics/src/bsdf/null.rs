//! Boundary that light passes straight through, such as the hull of a medium.

use super::{BsdfSample, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;

/// Samples the direction straight on.
pub(super) fn sample(s: &Surface, toward: DVec3) -> BsdfSample {
    BsdfSample {
        direction: -toward,
        weight: Spectrum::splat(weight(s, toward)),
        pdf: 1.0,
        delta: true,
        transmitted: true,
    }
}

/// Returns nᵢ²/nₒ², with o the side of `toward`: the factor of L̃ = L/n² from the far side.
///
/// A null boundary is declared index-matched. The ray does not bend, so L itself passes, and with
/// it the energy. For matched indices the factor is 1. For different indices the boundary is
/// unphysical, because it preserves energy but not étendue. It is not reciprocal either: a walk
/// from an emitter carries power, which passes without a factor.
pub fn weight(s: &Surface, toward: DVec3) -> f64 {
    let side = s.facing(toward);
    let ratio = side.n_far / side.n_near;
    ratio * ratio
}
