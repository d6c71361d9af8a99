//! Volumes of labels: voxels or tetrahedra. Each label belongs to a medium.

mod cells;
mod groups;
mod table;
mod tetrahedra;
mod voxels;

use super::super::context::{Context, Divided, MeterPlace};
use super::super::division::{self, Division, LabelCounts, Places};
use super::super::medium;
use super::super::side_request::SideRequest;
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use cells::Cells;
use groups::Groups;
use std::sync::Arc;
use table::Table;
use transport::Spectrum;
use transport::bsdf::{Bsdf, Dielectric};
use transport::meter::MeterSurface;
use transport::scene::{CellMedia, MediumId};
use transport::volume::{TetrahedraMedia, VoxelMedia};

/// Requested division of a volume of labels.
struct Wanted {
    refraction: bool,
    exterior: Option<MediumId>,
}

/// Adds the media of a volume of labels and the surfaces between them.
pub(super) fn add(object: &ObjectDescription, context: &mut Context) {
    let mut read = None;
    let counts = counts(object, &mut read, context);
    let mut q = Query::new(object, context.diagnostics);
    let options = cells::Options::of(&mut q);
    let refraction = q.boolean("refraction");
    let exterior = q.role(PluginKind::Medium, "exterior").cloned();
    let table = Table::of(object, &mut q);
    let meters: Vec<_> = q
        .children(PluginKind::Sensor)
        .into_iter()
        .cloned()
        .collect();
    q.finish(&[]);
    let (Some(counts), Some(table)) = (counts, table) else {
        return;
    };
    let wanted = Wanted {
        refraction,
        exterior: exterior.map(|m| medium::medium(&m, context)),
    };
    let Some(groups) = Groups::of(&counts, table, options.joins_labels(), object, context) else {
        return;
    };
    let Some(division) = division(object, &groups.places, options, read, context) else {
        return;
    };
    let outer = add_parts(object, &groups, &division, &wanted, context);
    context
        .meters
        .extend(meters.into_iter().map(|meter| MeterPlace {
            meter,
            surfaces: outer.clone(),
            is_shape: false,
        }));
}

/// Returns the labels of a volume with their counts; `None` if the volume cannot be read
/// (reported). Stores the cells in `read` if it reads them.
fn counts(
    object: &ObjectDescription,
    read: &mut Option<Cells>,
    context: &mut Context,
) -> Option<Arc<LabelCounts>> {
    if let Some(known) = context.assets.label_counts.get(&object.number) {
        return Some(known.clone());
    }
    let cells = Cells::read(object, context)?;
    let counts = Arc::new(cells.counts());
    *read = Some(cells);
    let known = &mut context.assets.label_counts;
    known.insert(object.number, counts.clone());
    Some(counts)
}

/// Returns the volume divided into parts. `read` holds its cells if they were just read.
fn division(
    object: &ObjectDescription,
    places: &Places,
    options: cells::Options,
    read: Option<Cells>,
    context: &mut Context,
) -> Option<Arc<Division>> {
    let key = (object.number, places.clone());
    if let Some(known) = context.assets.divisions.get(&key) {
        return Some(known.clone());
    }
    let cells = read.or_else(|| Cells::read(object, context))?;
    let division = context.accept(&object.location, cells.divide(places, options))?;
    let division = Arc::new(division);
    let assets = &mut context.assets;
    assets.held.push(division.surfaces.clone());
    assets.divisions.insert(key, division.clone());
    Some(division)
}

/// Adds the media of groups of labels and the surfaces between them. Returns the outer surfaces of
/// the volume.
fn add_parts(
    object: &ObjectDescription,
    groups: &Groups,
    division: &Division,
    wanted: &Wanted,
    context: &mut Context,
) -> Vec<MeterSurface> {
    let mut outer = Vec::new();
    let name = object.id.clone().unwrap_or_else(|| object.plugin.clone());
    // Add the media of the groups.
    let mut media: Vec<MediumId> = Vec::new();
    for (group, members) in groups.groups.iter().zip(&division.members) {
        let medium = group.medium(&name, members.as_ref());
        let Some(medium) = context.accept(&object.location, medium) else {
            return outer;
        };
        let place = Some(object.location.clone());
        media.push(context.add_medium(medium, group.is_open(), place));
    }
    let clear = Dielectric::new(Spectrum::ONE, Spectrum::ONE);
    let Some(dielectric) = context.accept(&object.location, clear) else {
        return outer;
    };
    // Add the surfaces, with the media on their sides.
    let surfaces = &division.surfaces;
    let cells = surfaces.cells.clone().map(|cells| match cells {
        division::Cells::Voxels(grid) => {
            CellMedia::Voxels(Arc::new(VoxelMedia::new(grid, media.clone())))
        }
        division::Cells::Tetrahedra(mesh) => CellMedia::Tetrahedra(Arc::new(TetrahedraMedia {
            mesh,
            media: media.clone(),
        })),
    });
    let first = context.objects.len();
    let mut sides = Vec::new();
    for surface in &surfaces.list {
        let of = |part: u8| match part.checked_sub(1) {
            Some(group) => Some(media[usize::from(group)]),
            None => wanted.exterior,
        };
        let is_outer = surface.parts.contains(&0);
        let [behind, before] = surface.parts.map(of);
        if is_outer {
            outer.push(MeterSurface {
                object: context.objects.len(),
                inverted: surface.turned,
            });
        }
        sides.push(if surface.turned {
            [before, behind]
        } else {
            [behind, before]
        });
        let bsdf = if wanted.refraction {
            Bsdf::Dielectric(dielectric)
        } else {
            Bsdf::Null
        };
        super::push(
            object,
            surface.shape.clone(),
            bsdf,
            None,
            SideRequest::default(),
            context,
        );
    }
    context.divided.push(Divided {
        cells,
        objects: first..context.objects.len(),
        exterior: wanted.exterior,
        sides,
        outer_index: groups.outer_index,
        location: object.location.clone(),
    });
    outer
}
