//! Devices that walk particles through voxels in single precision: graphics processors
//! (docs/theory.md#particles-on-a-device).
//!
//! The processor emits the particles, with the same random numbers as ever (`hand_over`), and decides
//! whether a scene suits a device (`volume`). The device walks them to their ends and returns the
//! sums of batches of particles. A batch is one sample of every mean (`batches`): errors follow from
//! the differences between batches.

mod batches;
mod hand_over;
mod volume;

pub(crate) use batches::DeviceBatches;
pub use batches::DeviceRun;
pub use hand_over::{DeviceRay, INSIDE};
pub use volume::check_device;
pub use volume::{DeviceIndex, DeviceMatter, DeviceVolume, Gates, Unsuitable};

use crate::stop::Stop;
use std::fmt::Debug;

/// Device that walks particles through voxels.
pub trait Device: Debug + Send + Sync {
    /// Returns the name of the device, for people.
    fn name(&self) -> &str;

    /// Copies a volume to the device. Particles end where the limits say.
    ///
    /// # Errors
    /// If the volume does not fit into the device's memory, or the device fails.
    fn load(
        &self,
        volume: &DeviceVolume,
        limits: WalkLimits,
    ) -> Result<Box<dyn DeviceWalk>, DeviceError>;
}

/// A volume on a device, through which particles walk.
pub trait DeviceWalk: Debug + Send + Sync {
    /// Returns the number of batches whose sums fit into the device's memory at once; at least one.
    fn max_batches(&self) -> usize;

    /// Walks particles to their ends. Each names its batch, below `batches`, which must not exceed
    /// [`DeviceWalk::max_batches`]. Returns the sums of each batch. The sums do not depend on the
    /// order in which the device walks the particles.
    ///
    /// # Errors
    /// If the device fails, or loses power. Sums are worthless once `stop` is raised.
    fn walk(
        &self,
        rays: &[DeviceRay],
        batches: usize,
        stop: &Stop,
    ) -> Result<Vec<BatchSums>, DeviceError>;
}

/// Ends of walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkLimits {
    /// Largest number of edges and specular events.
    pub max_depth: u32,
    /// Number of edges and specular events after which Russian roulette begins.
    pub rr_depth: u32,
}

/// Sums over the particles of a batch, relative to the power 1 of a particle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchSums {
    /// Integral ∫ power ds of each voxel in each gate, in units of [`DeviceVolume::unit`]. Voxels
    /// vary fastest.
    pub fluence: Vec<f64>,
    /// Absorbed power.
    pub absorbed: f64,
    /// Power that left the volume.
    pub escaped: f64,
    /// Power left at the largest depth.
    pub cut: f64,
    /// Power of particles that took too many segments.
    pub lost: f64,
    /// Power of particles that Russian roulette ended.
    pub ended: f64,
    /// Power that Russian roulette added to other particles.
    pub boosted: f64,
    /// Number of particles that took too many segments.
    pub lost_particles: u64,
    /// Number of straight segments.
    pub segments: u64,
}

impl BatchSums {
    /// Returns the power that was emitted, according to its destinations.
    pub fn power(&self) -> f64 {
        self.absorbed + self.escaped + self.cut + self.lost + self.ended - self.boosted
    }
}

/// Failure of a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// The scene does not suit the device.
    #[error(transparent)]
    Unsuitable(#[from] Unsuitable),
    /// The device has too little memory.
    #[error(
        "{name} has too little memory: the voxels and gates need {} MiB at once, and it gives {} MiB: use fewer gates or voxels, or the CPU",
        needed.div_ceil(1 << 20), available >> 20
    )]
    Memory {
        /// Name of the device.
        name: String,
        /// Bytes that the volume needs.
        needed: u64,
        /// Bytes that the device gives.
        available: u64,
    },
    /// The device failed, or was reset.
    #[error("{name} failed: {problem}; the CPU computes the same")]
    Failed {
        /// Name of the device.
        name: String,
        /// Message of its driver.
        problem: String,
    },
    /// Particles vanished.
    #[error(
        "{name} lost particles: {found} of the power {emitted} reached an end, so its driver cuts loops: use the CPU"
    )]
    LostPower {
        /// Name of the device.
        name: String,
        /// Emitted power.
        emitted: String,
        /// Power at all ends.
        found: String,
    },
}
