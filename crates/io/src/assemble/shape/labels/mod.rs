//! Volumes of labels, each of which stands for a medium.

mod groups;
mod table;

use super::super::context::{Context, Divided, MeterPlace};
use super::super::medium;
use super::super::volume_source::{SOURCE, Source, read};
use super::super::wish::Wish;
use crate::mesh::label_surfaces::{Division, PartSurface};
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use crate::volume::Volume;
use groups::Groups;
use std::sync::Arc;
use table::Table;
use transport::Spectrum;
use transport::bsdf::{Bsdf, Dielectric};
use transport::meter::MeterSurface;
use transport::scene::MediumId;
use transport::shape::{Mesh, Shape, ShapeError, VoxelFaces};
use transport::volume::{LabelGrid, VoxelMedia};

/// Labels are numbers up to this one, which single precision tells apart.
const LARGEST: f64 = 16_777_215.0;

/// How a shape of labels is to be divided.
struct Wanted {
    smooth: bool,
    refraction: bool,
    exterior: Option<MediumId>,
}

/// Adds the media of a volume of labels and the surfaces between them.
pub(super) fn add(object: &ObjectDescription, context: &mut Context) {
    let (volume, source) = read::<f32>(object, context);
    let mut q = Query::new(object, context.diagnostics);
    for known in SOURCE {
        q.has(known);
    }
    let smooth = q.one_of("surface", &["voxels", "smooth"]) == 1;
    let refraction = q.boolean_or("refraction", true);
    let exterior = q.role(PluginKind::Medium, "exterior").cloned();
    let table = Table::of(object, &mut q);
    let meters: Vec<_> = q
        .children(PluginKind::Sensor)
        .into_iter()
        .cloned()
        .collect();
    q.finish(&[]);
    let (Some(volume), Some(table)) = (volume, table) else {
        return;
    };
    let size = volume.size();
    let Some(labels) = whole(volume, &source, object, context) else {
        return;
    };
    let wanted = Wanted {
        smooth,
        refraction,
        exterior: exterior.map(|m| medium::medium(&m, context)),
    };
    let Some(groups) = Groups::of(labels, size, table, object, context) else {
        return;
    };
    let outer = divide(object, groups, &source, &wanted, context);
    context
        .meters
        .extend(meters.into_iter().map(|meter| MeterPlace {
            meter,
            surfaces: outer.clone(),
            is_shape: false,
        }));
}

/// The labels of all voxels, x fastest; `None` if they are none (reported then).
fn whole(
    volume: Volume,
    source: &Source,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Vec<u32>> {
    let location = &object.location;
    if source.placement != 0 {
        let message = "labels are those of voxels: their placement is 'centers'";
        context.error_at(location, message);
        return None;
    }
    if volume.channels() != 1 {
        let message = format!(
            "labels have one channel, the volume has {}",
            volume.channels()
        );
        context.error_at(location, message);
        return None;
    }
    let is_label = |v: &f32| v.fract() == 0.0 && (0.0..=LARGEST).contains(&f64::from(*v));
    let [nx, ny, _] = volume.size();
    if let Some(i) = volume.data().iter().position(|v| !is_label(v)) {
        let message = format!(
            "labels are whole numbers from 0 to {LARGEST}; that of voxel ({}, {}, {}) is {}",
            i % nx,
            i / nx % ny,
            i / nx / ny,
            volume.data()[i]
        );
        context.error_at(location, message);
        return None;
    }
    // Numbers of the same size stay in place.
    Some(volume.into_data().into_iter().map(|v| v as u32).collect())
}

/// Adds the media of groups of labels and the surfaces between them. Returns those around the volume.
fn divide(
    object: &ObjectDescription,
    groups: Groups,
    source: &Source,
    wanted: &Wanted,
    context: &mut Context,
) -> Vec<MeterSurface> {
    let mut outer = Vec::new();
    let name = object.id.clone().unwrap_or_else(|| object.plugin.clone());
    let mut media: Vec<MediumId> = Vec::new();
    for (i, group) in groups.groups.iter().enumerate() {
        let medium = group.medium(&name, i as u8 + 1, &groups, source.to_world);
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
    let (surfaces, voxels) = if wanted.smooth {
        let division = Division {
            size: groups.size,
            parts: &groups.parts,
        };
        let surfaces = division.surfaces().into_iter();
        let made: Result<Vec<Surface>, ShapeError> =
            surfaces.map(|surface| smooth(surface, source)).collect();
        let Some(made) = context.accept(&object.location, made) else {
            return outer;
        };
        (made, None)
    } else {
        let parts = LabelGrid::new(groups.size, groups.parts, source.to_world).map(Arc::new);
        let Some(parts) = context.accept(&object.location, parts) else {
            return outer;
        };
        let Some(faces) = context.accept(&object.location, VoxelFaces::all(&parts)) else {
            return outer;
        };
        let made = faces.into_iter().map(Surface::from).collect();
        (made, Some(Arc::new(VoxelMedia::new(parts, media.clone()))))
    };
    let first = context.objects.len();
    let mut sides = Vec::new();
    for surface in surfaces {
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
        super::push(object, surface.shape, bsdf, None, Wish::default(), context);
    }
    context.divided.push(Divided {
        voxels,
        objects: first..context.objects.len(),
        exterior: wanted.exterior,
        sides,
        outer_index: groups.outer_index,
        location: object.location.clone(),
    });
    outer
}

/// The surface between two parts.
struct Surface {
    /// The part behind its normals, and the one before them, unless they are turned.
    parts: [u8; 2],
    turned: bool,
    shape: Shape,
}

impl From<VoxelFaces> for Surface {
    fn from(faces: VoxelFaces) -> Self {
        Surface {
            parts: faces.labels(),
            turned: faces.is_turned(),
            shape: faces.into(),
        }
    }
}

/// A smooth surface in its place.
fn smooth(surface: PartSurface, source: &Source) -> Result<Surface, ShapeError> {
    let mesh = Mesh::new(surface.mesh.positions, surface.mesh.triangles, None)?;
    Ok(Surface {
        parts: surface.parts,
        turned: mesh.was_inside_out(),
        shape: mesh.transformed(source.to_world)?.into(),
    })
}
