//! Labels of voxels, as read from a file or an array.

use super::super::super::content::label_grid;
use super::super::super::context::Context;
use super::super::super::division::{Division, LabelCounts, Parts, Place, Places, SurfacesError};
use super::super::super::volume_source::read;
use crate::scene::ObjectDescription;
use eikonal::field::Placement;
use glam::DAffine3;
use std::collections::BTreeMap;

/// Largest label: the largest integer that single precision separates from both neighbours.
const MAX_LABEL: f64 = 16_777_215.0;

/// Labels of the voxels of a volume.
pub(super) struct Voxels {
    size: [usize; 3],
    /// Label of each voxel, x fastest.
    labels: Vec<u32>,
    /// Map from the unit cube to the world.
    to_world: DAffine3,
}

impl Voxels {
    /// Reads the labels of a shape; `None` if the values are not labels (reported).
    pub(super) fn read(object: &ObjectDescription, context: &mut Context) -> Option<Self> {
        let location = &object.location;
        let (volume, source) = read::<f32>(object, context);
        let volume = volume?;
        if source.placement != Placement::Centers {
            let message = "the placement of labels must be 'centers'";
            context.error_at(location, message);
            return None;
        }
        if volume.channels() != 1 {
            let message = format!(
                "labels must have one channel, but the volume has {}",
                volume.channels()
            );
            context.error_at(location, message);
            return None;
        }
        let is_label = |v: &f32| v.fract() == 0.0 && (0.0..=MAX_LABEL).contains(&f64::from(*v));
        // Planted error "labels in memory twice", found by morgana-io/label_memory::voxels_take_a_few_bytes:
        // let (size @ [nx, ny, _], _twice) = (volume.size(), volume.clone());
        let size @ [nx, ny, _] = volume.size();
        if let Some(i) = volume.data().iter().position(|v| !is_label(v)) {
            let message = format!(
                "labels must be whole numbers from 0 to {MAX_LABEL}, but voxel ({}, {}, {}) has {}",
                i % nx,
                i / nx % ny,
                i / nx / ny,
                volume.data()[i]
            );
            context.error_at(location, message);
            return None;
        }
        // The conversion reuses the memory, because the types have equal size.
        let labels = volume.into_data().into_iter().map(|v| v as u32).collect();
        Some(Voxels {
            size,
            labels,
            to_world: source.to_world,
        })
    }

    /// Counts the voxels of each label.
    pub(super) fn counts(&self) -> LabelCounts {
        let mut counts = LabelCounts::new();
        for run in self.labels.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        counts
    }

    /// Divides the volume into parts by the places of its labels.
    ///
    /// # Errors
    /// Returns the errors of [`Parts::surfaces`].
    pub(super) fn divide(self, places: &Places, smooth: bool) -> Result<Division, SurfacesError> {
        let Voxels {
            size,
            labels,
            to_world,
        } = self;
        let split = Split::of(size, labels, places);
        let mut most: BTreeMap<u8, u8> = BTreeMap::new();
        for place in places.values().filter(|place| place.part > 0) {
            let known = most.entry(place.part).or_default();
            *known = place.member.max(*known);
        }
        let members = most.into_iter().map(|(part, last)| {
            let grid = (last > 0).then(|| label_grid(size, split.filled(part), to_world));
            grid.transpose()
        });
        let members = members.collect::<Result<Vec<Option<_>>, _>>()?;
        let parts = Parts {
            size,
            numbers: split.parts,
            to_world,
        };
        Ok(Division {
            surfaces: parts.surfaces(smooth)?,
            members,
        })
    }
}

/// Voxels divided by the places of their labels.
struct Split {
    size: [usize; 3],
    /// Part of each voxel.
    parts: Vec<u8>,
    /// Number of each voxel's label within its part.
    members: Vec<u8>,
}

impl Split {
    fn of(size: [usize; 3], labels: Vec<u32>, places: &Places) -> Self {
        let (mut parts, mut members) = (Vec::new(), Vec::new());
        parts.reserve_exact(labels.len());
        members.reserve_exact(labels.len());
        for run in labels.chunk_by(|a, b| a == b) {
            let Place { part, member } = places[&run[0]];
            let end = parts.len() + run.len();
            parts.resize(end, part);
            members.resize(end, member);
        }
        Split {
            size,
            parts,
            members,
        }
    }

    /// Returns for each voxel the number of its label within a part. Voxels of other parts up to
    /// two steps away get the number of a neighbour, so that smooth surfaces and rounding make no
    /// difference. All other voxels get 0.
    fn filled(&self, part: u8) -> Vec<u8> {
        let mut known: Vec<bool> = self.parts.iter().map(|p| *p == part).collect();
        let own = self.members.iter().zip(&known);
        let mut filled: Vec<u8> = own.map(|(m, known)| if *known { *m } else { 0 }).collect();
        let at_other = |i: &usize| known[*i] && self.neighbours(*i).any(|k| !known[k]);
        let mut ends: Vec<usize> = (0..known.len()).filter(at_other).collect();
        for _ in 0..2 {
            let unknown = |i: &usize| !known[*i];
            let beside = ends.iter().flat_map(|i| self.neighbours(*i));
            let mut next: Vec<usize> = beside.filter(unknown).collect();
            next.sort_unstable();
            next.dedup();
            let nearest = |i: &usize| self.neighbours(*i).find(|k| known[*k]);
            let values: Vec<u8> = next
                .iter()
                .map(|i| nearest(i).map_or(0, |k| filled[k]))
                .collect();
            for (i, value) in next.iter().zip(values) {
                (known[*i], filled[*i]) = (true, value);
            }
            ends = next;
        }
        filled
    }

    /// Returns the voxels that share a face with a voxel.
    fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + use<> {
        let size = self.size;
        let strides = [1, size[0], size[0] * size[1]];
        (0..3).flat_map(move |axis| {
            let place = i / strides[axis] % size[axis];
            let below = (place > 0).then(|| i - strides[axis]);
            let above = (place + 1 < size[axis]).then(|| i + strides[axis]);
            below.into_iter().chain(above)
        })
    }
}
