//! Labels of the same index share a medium, whose other properties are those of each label.

use super::super::super::context::Context;
use super::table::{LabelMedium, Sameness, Table};
use crate::diagnostic::Diagnostic;
use crate::scene::ObjectDescription;
use glam::DAffine3;
use std::collections::BTreeMap;
use std::sync::Arc;
use transport::Spectrum;
use transport::medium::{Medium, MediumLabel, MediumLabels};
use transport::phase::{Phase, PhaseByLabel};
use transport::volume::{GridError, LabelGrid, VolumeGrid, VolumeTexture};

/// The most groups, and the most labels in one: their numbers are kept as bytes.
const MOST: usize = 255;

/// The groups of the labels of a volume.
pub(super) struct Groups {
    pub size: [usize; 3],
    /// For each voxel the number of its group, from 1; 0 outside.
    pub parts: Vec<u8>,
    /// For each voxel which of its group's labels it has.
    members: Vec<u8>,
    pub groups: Vec<Group>,
    /// Index of what is outside, if the labels say.
    pub outer_index: Option<f64>,
}

/// Labels of the same index.
pub(super) struct Group {
    pub members: Vec<(u32, LabelMedium)>,
}

/// Which group a label is in, and which of its members it is.
#[derive(Clone, Copy)]
struct Place {
    part: u8,
    member: u8,
}

impl Groups {
    /// Those of the labels that voxels have; `None` after an error.
    pub(super) fn of(
        labels: Vec<u32>,
        size: [usize; 3],
        table: Table,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<Self> {
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for run in labels.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        let absent = table
            .meanings
            .keys()
            .filter(|label| !counts.contains_key(label));
        let absent: Vec<String> = absent.map(u32::to_string).collect();
        if !absent.is_empty() && !table.is_array {
            let message = format!("no voxel has label {}", absent.join(", "));
            context
                .diagnostics
                .push(Diagnostic::warning(message).at(&object.location));
        }
        let mut groups: Vec<Group> = Vec::new();
        let mut places: BTreeMap<u32, Place> = BTreeMap::new();
        let mut right = true;
        for (label, count) in counts {
            let Some(meaning) = table.meanings.get(&label) else {
                if label != 0 {
                    let message =
                        format!("{count} voxels have label {label}, for which there is no medium");
                    context.error_at(&object.location, message);
                    right = false;
                }
                places.insert(label, Place { part: 0, member: 0 });
                continue;
            };
            match meaning.build(label, object, context) {
                Some(medium) => {
                    let place = join(&mut groups, label, medium);
                    right &= place.is_some();
                    places.insert(label, place.unwrap_or(Place { part: 0, member: 0 }));
                }
                None => right = false,
            }
        }
        if right && groups.is_empty() {
            context.error_at(&object.location, "no voxel has a label with a medium");
            right = false;
        } else if groups.len() > MOST || groups.iter().any(|g| g.members.len() > MOST) {
            let message =
                format!("there are more than {MOST} indices, or labels of the same index");
            context.error_at(&object.location, message);
            right = false;
        }
        if !right {
            return None;
        }
        let (mut parts, mut members) = (Vec::new(), Vec::new());
        parts.reserve_exact(labels.len());
        members.reserve_exact(labels.len());
        for run in labels.chunk_by(|a, b| a == b) {
            let Place { part, member } = places[&run[0]];
            let end = parts.len() + run.len();
            parts.resize(end, part);
            members.resize(end, member);
        }
        Some(Groups {
            size,
            parts,
            members,
            groups,
            outer_index: table.outer_index,
        })
    }
}

/// Puts a label into the group of its index; `None` if there are too many.
fn join(groups: &mut Vec<Group>, label: u32, medium: LabelMedium) -> Option<Place> {
    let alike = |g: &Group| g.members[0].1.index == medium.index;
    let group = groups.iter().position(alike).unwrap_or(groups.len());
    if group == groups.len() {
        groups.push(Group {
            members: Vec::new(),
        });
    }
    let members = &mut groups[group].members;
    members.push((label, medium));
    Some(Place {
        part: u8::try_from(group + 1).ok()?,
        member: u8::try_from(members.len() - 1).ok()?,
    })
}

impl Group {
    /// Whether its index is that of what is around.
    pub(super) fn is_open(&self) -> bool {
        self.members[0].1.is_open
    }

    /// The medium of all its labels, for the part with a number.
    pub(super) fn medium(
        &self,
        name: &str,
        part: u8,
        groups: &Groups,
        to_world: DAffine3,
    ) -> Result<Medium, GridError> {
        let first = &self.members[0].1.medium;
        let listed: Vec<String> = self
            .members
            .iter()
            .map(|(label, _)| label.to_string())
            .collect();
        let region = |label: &str| format!("{name}: label {label}");
        let regions: Vec<String> = listed.iter().map(|label| region(label)).collect();
        let name = match &listed[..] {
            [label] => region(label),
            labels => format!("{name}: labels {}", labels.join(", ")),
        };
        if self.members.len() == 1 {
            return Ok(Medium {
                name,
                ..first.clone()
            });
        }
        let labels = Arc::new(LabelGrid::new(groups.size, groups.filled(part), to_world)?);
        let of = |value: fn(&Medium) -> Spectrum| -> Result<VolumeTexture, GridError> {
            let values: Vec<Spectrum> =
                self.members.iter().map(|(_, m)| value(&m.medium)).collect();
            if values.iter().all(|v| *v == values[0]) {
                return Ok(VolumeTexture::Uniform(values[0]));
            }
            let gray = values.iter().all(|v| v.0.iter().all(|c| *c == v[0]));
            let channels = if gray { 1 } else { Spectrum::CHANNELS };
            let grid = VolumeGrid::by_label(labels.clone(), &values, channels)?;
            Ok(VolumeTexture::Grid(Arc::new(grid)))
        };
        let sigma_t = of(|m| m.uniform_extinction().unwrap_or(Spectrum::ZERO))?;
        let albedo = of(|m| m.albedo.uniform().unwrap_or(Spectrum::ZERO))?;
        let emission = of(Medium::uniform_emission)?;
        Ok(Medium {
            name,
            index: first.index.clone(),
            sigma_t,
            scale: 1.0,
            albedo,
            phase: self.phase(&labels),
            emission: (!emission.is_zero()).then_some(emission),
            velocity: None,
            labels: self.labels(labels, regions),
        })
    }

    /// The labels by their names, which records tell apart.
    fn labels(&self, grid: Arc<LabelGrid>, names: Vec<String>) -> Option<MediumLabels> {
        let label = |(name, (_, label)): (String, &(u32, LabelMedium))| MediumLabel {
            name,
            extinction: label.medium.uniform_extinction().unwrap_or(Spectrum::ZERO),
            absorption: label.medium.uniform_absorption().unwrap_or(Spectrum::ZERO),
            velocity: label.medium.velocity.clone(),
        };
        let list = names.into_iter().zip(&self.members).map(label);
        MediumLabels::new(grid, list.collect())
    }

    /// The phase functions of all labels; that of one, if they are the same. Those of labels that do not scatter do not count.
    fn phase(&self, labels: &Arc<LabelGrid>) -> Phase {
        let scattering = self.members.iter().filter(|(_, m)| m.medium.scatters());
        let mut known: Vec<Sameness> = scattering.clone().map(|(_, m)| m.phase).collect();
        known.dedup();
        let first = scattering.map(|(_, m)| &m.medium.phase).next();
        let first = first.cloned().unwrap_or_else(Phase::isotropic);
        if known.len() < 2 {
            return first;
        }
        let each = self.members.iter().map(|(_, m)| m.medium.phase.clone());
        match PhaseByLabel::new(labels.clone(), each.collect()) {
            Some(phases) => Phase::ByLabel(Box::new(phases)),
            None => first,
        }
    }
}

impl Groups {
    /// For each voxel which of the labels of a part it has. Voxels of other parts up to two steps away have that of a neighbour, so that
    /// smooth surfaces and rounding do not matter, and others 0.
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

    /// The voxels beside one.
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
