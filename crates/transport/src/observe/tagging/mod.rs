//! Tagged light: what sound does to the phase of light along its way, from the sensor or from an emitter.
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

/// Computes the amplitudes of sound in media, which the [memory](crate::medium::Medium::memory) of the media counts from then on. Renders of
/// tagged light compute them, too, unless they are there.
pub fn prepare(scene: &Scene) {
    SoundInMedia::of(scene);
}
