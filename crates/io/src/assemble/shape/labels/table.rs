//! Media of labels, from nested media or from the rows of a table.

use super::super::super::context::Context;
use super::super::super::{medium, phase};
use crate::query::Query;
use crate::scene::{ObjectDescription, ObjectId, PluginKind};
use eikonal::field::Constant;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;
use transport::Spectrum;
use transport::medium::Medium;
use transport::phase::{Phase, PhaseError};
use transport::volume::VolumeTexture;

/// Medium of a label, before it is built.
#[derive(Clone)]
pub(super) enum Meaning {
    /// Medium that an object describes.
    Described(Arc<ObjectDescription>),
    /// Coefficients μ_a and μ_s, mean cosine g and index n.
    Row([f64; 4]),
}

/// Media of all labels.
pub(super) struct Table {
    pub meanings: BTreeMap<u32, Meaning>,
    /// Index of the surroundings, if the table gives it.
    pub outer_index: Option<f64>,
    /// True if the table has a row for every label, used or not.
    pub is_array: bool,
    /// Phase function of all rows, instead of their mean cosines.
    pub phase: Option<Arc<ObjectDescription>>,
}

/// Phase function of all rows of a table.
pub(super) struct SharedPhase {
    pub phase: Phase,
    pub sameness: Sameness,
}

/// Identity of a property, by which media are compared without comparing values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sameness {
    /// Default, because the scene gives nothing.
    Default,
    /// Bits of a number.
    Number(u64),
    /// Object that describes the property.
    Object(ObjectId),
}

/// Medium of a label.
pub(super) struct LabelMedium {
    pub medium: Medium,
    /// True if properties other than the index are constant in space.
    pub is_uniform: bool,
    /// True if the label's medium has the index of its surroundings.
    pub is_open: bool,
    pub index: Sameness,
    pub phase: Sameness,
}

impl Table {
    /// Reads the object's nested media, named by their labels, or its array `properties`; `None`
    /// after an error.
    pub(super) fn of(object: &ObjectDescription, q: &mut Query) -> Option<Self> {
        let tensor = q.has("properties").then(|| q.tensor("properties"));
        let media = q.children(PluginKind::Medium);
        let phase = q.child(PluginKind::Phase).cloned();
        if let Some(phase) = phase.as_ref().filter(|_| tensor.is_none()) {
            let message =
                "a phase function of all labels needs 'properties': move it into a medium";
            q.error_at(&phase.location, message);
        }
        match tensor {
            Some(_) if !media.is_empty() => {
                q.error("properties", "give media or 'properties', not both");
                None
            }
            Some(tensor) => {
                let rows = tensor?.rows();
                let rows: Vec<[f64; 4]> = rows
                    .map_err(|e| {
                        q.error(
                            "properties",
                            format!("a row for each label, mu_a, mu_s, g, n: {e}"),
                        )
                    })
                    .ok()?;
                Some(Table::of_rows(&rows, phase))
            }
            None => Table::of_media(object, q),
        }
    }

    /// Makes the table of an array with the rows μ_a, μ_s, g and n, in the order of the labels.
    fn of_rows(rows: &[[f64; 4]], phase: Option<Arc<ObjectDescription>>) -> Self {
        let row = |(label, row): (usize, &[f64; 4])| (label as u32, Meaning::Row(*row));
        let mut meanings: BTreeMap<_, _> = rows.iter().enumerate().map(row).collect();
        // Ignore the row of label 0, except for its index: it stands for the surroundings.
        meanings.remove(&0);
        Table {
            meanings,
            outer_index: rows.first().map(|row| row[3]),
            is_array: true,
            phase,
        }
    }

    /// Makes the table of nested media, whose names list their labels; `None` after an error.
    fn of_media(object: &ObjectDescription, q: &mut Query) -> Option<Self> {
        let mut meanings = BTreeMap::new();
        let mut right = true;
        let children = object.children.iter();
        for child in children.filter(|c| c.object.kind == PluginKind::Medium) {
            let name = child.name.as_deref().unwrap_or("");
            if name == "exterior" {
                continue;
            }
            let Some(ranges) = ranges(name) else {
                let message = format!(
                    "the name of a medium says which labels it stands for, such as \"1\" or \"2, 5-7\"; this one is \
                     named \"{name}\""
                );
                q.error_at(&child.location, message);
                right = false;
                continue;
            };
            for label in ranges.into_iter().flatten() {
                let meaning = Meaning::Described(child.object.clone());
                if meanings.insert(label, meaning).is_some() {
                    let message = format!("label {label} has a medium already");
                    q.error_at(&child.location, message);
                    right = false;
                }
            }
        }
        right.then_some(Table {
            meanings,
            outer_index: None,
            is_array: false,
            phase: None,
        })
    }
}

/// Maximum number of labels in a range.
const MAX_LABELS: u32 = 65_536;

/// Parses labels: numbers and ranges, separated by commas.
fn ranges(name: &str) -> Option<Vec<RangeInclusive<u32>>> {
    let range = |word: &str| {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        let (first, last) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        (first <= last && last - first < MAX_LABELS).then_some(first..=last)
    };
    name.split(',').map(range).collect()
}

impl SharedPhase {
    /// Builds the phase function that an object describes; `None` after an error.
    pub(super) fn of(described: &ObjectDescription, context: &mut Context) -> Option<Self> {
        let errors = context.diagnostics.error_count();
        let phase = phase::build(described, context);
        (context.diagnostics.error_count() == errors).then(|| SharedPhase {
            phase,
            sameness: Sameness::Object(described.number),
        })
    }
}

impl Meaning {
    /// Builds the medium, with a phase function of all rows if there is one; `None` after an error.
    pub(super) fn build(
        &self,
        label: u32,
        shared: Option<&SharedPhase>,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<LabelMedium> {
        match self {
            Meaning::Described(described) => described_medium(described, context),
            Meaning::Row(row) => {
                let made = of_row(label, *row, shared);
                context.accept(&object.location, made)
            }
        }
    }
}

/// Builds the medium of a label from an object; `None` after an error. A medium that varies in space
/// is alone with its index.
fn described_medium(described: &ObjectDescription, context: &mut Context) -> Option<LabelMedium> {
    let errors = context.diagnostics.error_count();
    let (medium, is_open) = medium::build(described, context);
    let is_uniform = |texture: &VolumeTexture| texture.uniform().is_some();
    let uniform = medium.uniform_extinction().is_some()
        && is_uniform(&medium.albedo)
        && medium.emission.as_ref().is_none_or(is_uniform);
    let child = |kind: PluginKind, name: Option<&str>| {
        let mut children = described.children.iter();
        let found = children
            .find(|c| c.object.kind == kind && (name.is_none() || c.name.as_deref() == name));
        found.map(|c| Sameness::Object(c.object.number))
    };
    let index = match child(PluginKind::Volume, Some("ior")) {
        _ if !uniform => Sameness::Object(described.number),
        Some(volume) if !medium.index.is_constant() => volume,
        _ if is_open => Sameness::Default,
        _ => Sameness::Number(medium.index.n(glam::DVec3::ZERO).to_bits()),
    };
    (context.diagnostics.error_count() == errors).then(|| LabelMedium {
        medium,
        is_uniform: uniform,
        is_open,
        index,
        phase: child(PluginKind::Phase, None).unwrap_or(Sameness::Default),
    })
}

/// Error in a row of a table.
#[derive(Debug, thiserror::Error)]
enum RowError {
    #[error("properties of label {0}: {1} is {2}; it must be {3}")]
    Range(u32, &'static str, f64, &'static str),
    #[error("properties of label {0}: {1}")]
    Phase(u32, PhaseError),
}

/// Builds the medium of a label from a row of the table.
fn of_row(
    label: u32,
    [mu_a, mu_s, g, n]: [f64; 4],
    shared: Option<&SharedPhase>,
) -> Result<LabelMedium, RowError> {
    let coefficient = "at least 0";
    for (name, value) in [("mu_a", mu_a), ("mu_s", mu_s)] {
        if value < 0.0 {
            return Err(RowError::Range(label, name, value, coefficient));
        }
    }
    if !crate::schema::NumberRange::INDEX.contains(n) {
        return Err(RowError::Range(label, "n", n, "from 0.001 to 1000"));
    }
    // With g = 1 scattering does not change the direction, so it can be omitted. A phase function of
    // all rows replaces g.
    let mu_s = if g == 1.0 && shared.is_none() {
        0.0
    } else {
        mu_s
    };
    let total = mu_a + mu_s;
    let albedo = if total > 0.0 { mu_s / total } else { 0.0 };
    let g = if mu_s == 0.0 { 0.0 } else { g };
    let (phase, sameness) = match shared {
        Some(shared) => (shared.phase.clone(), shared.sameness),
        None => {
            let phase = Phase::henyey_greenstein(g).map_err(|e| RowError::Phase(label, e))?;
            (phase, Sameness::Number(g.to_bits()))
        }
    };
    let name = format!("label {label}");
    let medium = Medium::homogeneous(
        name,
        Constant::new(n),
        Spectrum::splat(total),
        Spectrum::splat(albedo),
    );
    Ok(LabelMedium {
        medium: medium.with_phase(phase),
        is_uniform: true,
        is_open: false,
        index: Sameness::Number(n.to_bits()),
        phase: sameness,
    })
}
