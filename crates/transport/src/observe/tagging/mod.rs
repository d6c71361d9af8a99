//! Tagged light: the effect of sound on the phase of light along its path, from the sensor or from
//! an emitter.
//!
//! Theory: docs/theory.md#tagged-light.

mod fold;
mod follow;
mod path;
mod representatives;
mod sound_along;
mod steps;

use crate::scene::Scene;
pub(crate) use fold::TaggedFold;
pub(crate) use path::{PathModulation, SoundInMedia, TaggedPath};
pub(crate) use representatives::{Representative, representatives};
pub(crate) use sound_along::SoundAlong;
pub(crate) use steps::Step;

/// Computes the amplitudes of sound in media. The [memory](crate::medium::Medium::memory) of the
/// media includes them from then on. Renders of tagged light compute them if they are missing.
pub fn prepare(scene: &Scene) {
    SoundInMedia::of(scene);
}
