//! Groups of labels. Labels with equal indices share a medium whose other properties vary by label.

use super::super::super::context::Context;
use super::super::super::division::{LabelCounts, Place, Places};
use super::table::{LabelMedium, Sameness, SharedPhase, Table};
use crate::diagnostic::lints;
use crate::scene::ObjectDescription;
use std::sync::Arc;
use transport::Spectrum;
use transport::medium::{Medium, MediumLabel, MediumLabels};
use transport::phase::{Phase, PhaseByLabel};
use transport::volume::{GridError, LabelGrid, VolumeGrid, VolumeTexture};

/// Maximum number of groups, and of labels in a group: their numbers are stored as bytes.
const MAX_GROUPS: usize = 255;

/// Groups of the labels of a volume.
pub(super) struct Groups {
    pub groups: Vec<Group>,
    /// Group and member of each label. Groups are parts, numbered from 1.
    pub places: Places,
    /// Index of the surroundings, if the labels give it.
    pub outer_index: Option<f64>,
}

/// Labels with equal indices.
pub(super) struct Group {
    pub members: Vec<(u32, LabelMedium)>,
}

impl Groups {
    /// Groups the labels that cells have; `None` after an error. Unless `joins` is set, each label
    /// is a group of its own.
    pub(super) fn of(
        counts: &LabelCounts,
        table: Table,
        joins: bool,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<Self> {
        // Warn about media without voxels.
        let absent = table
            .meanings
            .keys()
            .filter(|label| !counts.contains_key(label));
        let absent: Vec<String> = absent.map(u32::to_string).collect();
        if !absent.is_empty() && !table.is_array {
            let message = format!("no cell has label {}", absent.join(", "));
            context
                .diagnostics
                .push(lints::warning(lints::ABSENT_LABELS, message).at(&object.location));
        }
        let phase = table.phase.as_ref().map(|p| SharedPhase::of(p, context));
        let shared = match &phase {
            Some(built) => Some(built.as_ref()?),
            None => None,
        };
        // Sort the labels into groups by their index.
        let mut groups: Vec<Group> = Vec::new();
        let mut places = Places::new();
        let mut right = true;
        for (&label, &count) in counts {
            let Some(meaning) = table.meanings.get(&label) else {
                if label != 0 {
                    let message =
                        format!("{count} cells have label {label}, for which there is no medium");
                    context.error_at(&object.location, message);
                    right = false;
                }
                places.insert(label, Place { part: 0, member: 0 });
                continue;
            };
            match meaning.build(label, shared, object, context) {
                Some(medium) => {
                    let place = join(&mut groups, label, medium, joins);
                    right &= place.is_some();
                    places.insert(label, place.unwrap_or(Place { part: 0, member: 0 }));
                }
                None => right = false,
            }
        }
        if right && groups.is_empty() {
            context.error_at(&object.location, "no cell has a label with a medium");
            right = false;
        } else if groups.len() > MAX_GROUPS || groups.iter().any(|g| g.members.len() > MAX_GROUPS) {
            let message =
                format!("there are more than {MAX_GROUPS} indices, or labels of the same index");
            context.error_at(&object.location, message);
            right = false;
        }
        if !right {
            return None;
        }
        Some(Groups {
            groups,
            places,
            outer_index: table.outer_index,
        })
    }
}

/// Adds a label to the group of its index, or to a group of its own unless `joins` is set; `None` if
/// there are too many groups or members.
fn join(groups: &mut Vec<Group>, label: u32, medium: LabelMedium, joins: bool) -> Option<Place> {
    let alike = |g: &Group| joins && g.members[0].1.index == medium.index;
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
    /// Returns true if the group has the index of its surroundings.
    pub(super) fn is_open(&self) -> bool {
        self.members[0].1.is_open
    }

    /// Builds the medium of all labels of the group. `members` holds the number of the label at
    /// each voxel.
    pub(super) fn medium(
        &self,
        name: &str,
        members: Option<&Arc<LabelGrid>>,
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
        let Some(labels) = members.filter(|_| self.members[0].1.is_uniform) else {
            return Ok(Medium {
                name,
                ..first.clone()
            });
        };
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
            phase: self.phase(labels),
            emission: (!emission.is_zero()).then_some(emission),
            velocity: None,
            fluorescence: None,
            labels: self.labels(labels.clone(), regions),
        })
    }

    /// Returns the labels with their names, by which records separate them.
    fn labels(&self, grid: Arc<LabelGrid>, names: Vec<String>) -> Option<MediumLabels> {
        let label = |(name, (_, label)): (String, &(u32, LabelMedium))| MediumLabel {
            name,
            extinction: label.medium.uniform_extinction().unwrap_or(Spectrum::ZERO),
            absorption: label.medium.uniform_absorption().unwrap_or(Spectrum::ZERO),
            velocity: label.medium.velocity.clone(),
            fluorescence: label.medium.fluorescence.clone(),
        };
        let list = names.into_iter().zip(&self.members).map(label);
        MediumLabels::new(grid, list.collect())
    }

    /// Returns the phase function of each label, or a single one if all are equal. Labels that do
    /// not scatter do not count.
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
