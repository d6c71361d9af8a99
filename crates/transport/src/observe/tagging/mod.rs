//! Tagged light: what sound does to the phase of light along its way, from the sensor or from an emitter.
//!
//! Theory: docs/theory.md#tagged-light.

mod check;
mod follow;
mod path;
mod recorder;
mod representatives;
mod sound_along;
mod steps;

pub use check::{prepare, problems};
pub(crate) use path::{PathModulation, SoundInMedia, TaggedPath};
pub(crate) use recorder::TaggedRecorder;
pub(crate) use representatives::{Representative, representatives};
pub(crate) use sound_along::SoundAlong;
pub(crate) use steps::Step;
