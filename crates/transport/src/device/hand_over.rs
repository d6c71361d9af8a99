//! Particles as devices receive them: where they enter the voxels, or start in them
//! (docs/theory.md#particles-on-a-device).

use super::volume::{DeviceVolume, Gates};
use crate::path::WalkRay;
use crate::sampling::Sampler;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Value of [`DeviceRay::face`] of a particle that starts in the voxels.
pub const INSIDE: u32 = 6;
/// Number of values of a 32-bit word.
const WORDS: f64 = 4_294_967_296.0;
/// Length that no particle reaches, in single precision.
const FAR: f64 = 1e30;

/// Particle as a device receives it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DeviceRay {
    /// Position in its voxel, from 0 to 1.
    pub place: [f32; 3],
    /// Power, relative to the mean over all particles.
    pub weight: f32,
    /// Unit direction along the edges of voxels.
    pub direction: [f32; 3],
    /// Optical path length up to the end of the gate, in units of length.
    pub to_gate_end: f32,
    /// Indices of the voxel.
    pub cell: [u32; 3],
    /// Face through which the particle enters, 2 · axis + 1 for an upper one; [`INSIDE`] if it
    /// starts in the voxel.
    pub face: u32,
    /// Address of its random numbers.
    pub key: [u32; 2],
    /// Index of the gate; −1 before the first, and the number of gates after the last.
    pub gate: i32,
    /// Index of its batch.
    pub batch: u32,
}

/// Emitted particle.
pub(super) enum HandOver {
    /// A particle for the device.
    Ray(DeviceRay),
    /// A particle that misses the volume, with its power.
    Miss(f64),
}

impl DeviceVolume {
    /// Prepares an emitted particle. Its power is divided by `power`.
    pub(super) fn hand_over(&self, ray: &WalkRay, power: f64, sampler: &mut Sampler) -> HandOver {
        let weight = ray.throughput[0] / power;
        let start = self.frame.to_cells.transform_point3(ray.start.x);
        let direction = self.frame.axes.transpose() * ray.start.direction;
        let speed = direction * self.per_length / self.unit;
        let (mut place, mut face, mut length) = (start, INSIDE, 0.0);
        if !self.media.contains(&ray.start.medium) && !self.is_around(start) {
            let Some(entry) = self.entry(start, speed) else {
                return HandOver::Miss(weight);
            };
            (face, length) = entry;
            place = start + speed * length;
        }
        let optical_length = (ray.optical_length + self.exterior_n * length) / self.unit;
        let (gate, to_gate_end) = self.gates.at(optical_length);
        let (cell, place) = self.split(place, face);
        let mut key = || (sampler.next_1d() * WORDS) as u32;
        HandOver::Ray(DeviceRay {
            place: place.as_vec3().to_array(),
            weight: weight as f32,
            direction: direction.as_vec3().to_array(),
            to_gate_end: to_gate_end.min(FAR) as f32,
            cell,
            face,
            key: [key(), key()],
            gate,
            batch: 0,
        })
    }

    /// Returns true if a position is in a voxel of the medium around the volume.
    fn is_around(&self, place: DVec3) -> bool {
        let top = DVec3::from_array(self.size.map(|n| n as f64));
        if !(place.cmpgt(DVec3::ZERO).all() && place.cmplt(top).all()) {
            return false;
        }
        let [i, j, k] = self.split(place, INSIDE).0.map(|n| n as usize);
        let label = self.labels[i + self.size[0] * (j + self.size[1] * k)];
        Some(usize::from(label)) == self.around
    }

    /// Returns the face through which a straight line enters the volume, and the length up to it.
    fn entry(&self, start: DVec3, speed: DVec3) -> Option<(u32, f64)> {
        let top = DVec3::from_array(self.size.map(|n| n as f64));
        let (mut first, mut last, mut face) = (f64::NEG_INFINITY, f64::INFINITY, INSIDE);
        for axis in 0..3 {
            let ends = [0.0, top[axis]].map(|plane| (plane - start[axis]) / speed[axis]);
            if speed[axis] == 0.0 {
                if !(0.0..=top[axis]).contains(&start[axis]) {
                    return None;
                }
                continue;
            }
            let is_upper = speed[axis] < 0.0;
            let [near, far] = if is_upper { [ends[1], ends[0]] } else { ends };
            if near > first {
                (first, face) = (near, 2 * axis as u32 + u32::from(is_upper));
            }
            last = last.min(far);
        }
        (first <= last && last > 0.0 && face != INSIDE).then_some((face, first.max(0.0)))
    }

    /// Splits a position into the indices of its voxel and the position in it. A position on a face
    /// belongs to the voxel behind this face.
    fn split(&self, place: DVec3, face: u32) -> ([u32; 3], DVec3) {
        let mut within = DVec3::ZERO;
        let cell = std::array::from_fn(|axis| {
            let last = (self.size[axis] - 1) as f64;
            let cell = if face as usize / 2 == axis {
                let is_upper = face % 2 == 1;
                within[axis] = f64::from(u8::from(is_upper));
                if is_upper { last } else { 0.0 }
            } else {
                let cell = place[axis].floor().clamp(0.0, last);
                within[axis] = (place[axis] - cell).clamp(0.0, 1.0);
                cell
            };
            cell as u32
        });
        (cell, within)
    }
}

impl Gates {
    /// Returns the gate at an optical path length, and the length up to its end.
    fn at(&self, optical_length: f64) -> (i32, f64) {
        if self.width.is_infinite() {
            return (0, f64::INFINITY);
        }
        let position = (optical_length - self.start) / self.width;
        if position < 0.0 {
            return (-1, -position * self.width);
        }
        if position >= self.count as f64 {
            return (self.count as i32, f64::INFINITY);
        }
        let gate = position.floor();
        (gate as i32, (gate + 1.0 - position) * self.width)
    }
}
