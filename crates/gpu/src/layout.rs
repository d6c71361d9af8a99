//! Data of the shader `walk.wgsl`, in its layout.

use bytemuck::{Pod, Zeroable};
use transport::device::{BatchSums, DeviceVolume, WalkLimits};

/// Bytes of the state of a thread.
pub(crate) const STATE_BYTES: u64 = 128;
/// Bytes of a slot of sums.
pub(crate) const SLOT_BYTES: u64 = 8;
/// Totals of a batch, after its fluence.
pub(crate) const TOTALS: usize = 8;
/// Largest number of segments of a particle. Without absorption, a walk could last for ever.
const SEGMENT_BUDGET: u32 = 10_000_000;
/// Unit of fixed-point sums.
const FIXED_POINT: f64 = 1.0 / (1u64 << 30) as f64;

/// Uniform parameters of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Params {
    size: [u32; 3],
    rays: u32,
    per_length: [f32; 3],
    step: f32,
    spline_size: [u32; 3],
    n2_ref: f32,
    to_spline: [[f32; 4]; 4],
    gates: u32,
    gate_width: f32,
    exterior_n: f32,
    refracts: u32,
    max_depth: u32,
    rr_depth: u32,
    segments: u32,
    budget: u32,
    slots: u32,
    pub threads: u32,
    padding: [u32; 2],
}

/// Matter of voxels.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Matter {
    n: f32,
    extinction: f32,
    albedo: f32,
    g: f32,
}

impl Params {
    pub(crate) fn new(
        volume: &DeviceVolume,
        limits: WalkLimits,
        [segments, threads]: [u32; 2],
    ) -> Self {
        let mut params = Params {
            size: volume.size.map(|n| n as u32),
            per_length: volume.per_length.as_vec3().to_array(),
            gates: volume.gates.count as u32,
            gate_width: volume.gates.width.min(f64::from(f32::MAX)) as f32,
            exterior_n: volume.exterior_n as f32,
            refracts: u32::from(volume.refracts),
            max_depth: limits.max_depth,
            rr_depth: limits.rr_depth,
            segments,
            budget: SEGMENT_BUDGET,
            slots: slots(volume) as u32,
            threads,
            ..Params::zeroed()
        };
        if let Some(index) = &volume.index {
            params.step = index.step as f32;
            params.spline_size = index.spline.dims.map(|n| n as u32);
            params.n2_ref = index.spline.n2_ref as f32;
            let (matrix, translation) = (index.to_spline.matrix3, index.to_spline.translation);
            let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis, translation];
            params.to_spline = columns.map(|c| c.as_vec3().extend(0.0).to_array());
        }
        params
    }

    /// Returns the parameters for a number of particles.
    pub(crate) fn with_rays(self, rays: u32) -> Self {
        Params { rays, ..self }
    }
}

/// Returns the slots of a batch.
pub(crate) fn slots(volume: &DeviceVolume) -> usize {
    volume.slots() + TOTALS
}

/// Returns the matter of all labels.
pub(crate) fn matter(volume: &DeviceVolume) -> Vec<Matter> {
    let matter = volume.matter.iter().map(|of| Matter {
        // Curved rays take the index from the spline.
        n: if of.n.is_nan() { 1.0 } else { of.n as f32 },
        extinction: of.extinction as f32,
        albedo: of.albedo as f32,
        g: of.g as f32,
    });
    matter.collect()
}

/// Returns the labels, four in a word.
pub(crate) fn labels(volume: &DeviceVolume) -> Vec<u8> {
    let mut labels = volume.labels.clone();
    labels.resize(labels.len().next_multiple_of(4), 0);
    labels
}

/// Converts the sums of a batch.
pub(crate) fn batch_sums(words: &[u64]) -> BatchSums {
    let (fluence, totals) = words.split_at(words.len() - TOTALS);
    let power = |i: usize| totals[i] as f64 * FIXED_POINT;
    BatchSums {
        fluence: fluence
            .iter()
            .map(|sum| *sum as f64 * FIXED_POINT)
            .collect(),
        absorbed: power(0),
        escaped: power(1),
        cut: power(2),
        lost: power(3),
        ended: power(4),
        boosted: power(5),
        lost_particles: totals[6],
        segments: totals[7],
    }
}
