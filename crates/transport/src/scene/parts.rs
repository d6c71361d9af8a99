//! Parts of scenes.

use crate::bsdf::Bsdf;
use crate::emitter::Emitter;
use crate::film::FilmSpec;
use crate::medium::Medium;
use crate::sensor::Sensor;
use crate::shape::Shape;
use crate::volume::{TetrahedraMedia, VoxelMedia};
use eikonal::{Aabb, Tolerance};
use std::ops::Range;
use std::sync::Arc;

/// Index of a medium in [`Parts::media`].
pub type MediumId = usize;

/// The medium outside every shape that names no other exterior.
pub const AMBIENT: MediumId = 0;

/// A shape with its surface and the media on its two sides.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name used in messages.
    pub name: String,
    /// Geometry.
    pub shape: Shape,
    /// Surface scattering.
    pub bsdf: Bsdf,
    /// Media on the two sides. `None` if both sides are in one medium, the medium around the
    /// object.
    pub sides: Option<Sides>,
    /// Index of the emitter that covers the surface.
    pub emitter: Option<usize>,
}

impl Object {
    /// Returns true if rays continue deterministically beyond the surface, possibly in another
    /// medium. Connections pass such surfaces.
    pub(crate) fn is_interface(&self) -> bool {
        match self.bsdf {
            Bsdf::Null | Bsdf::Dielectric(_) => true,
            _ => self.sides.is_some() && self.bsdf.is_partial(),
        }
    }

    /// Returns the medium inside, if the surface separates media.
    pub fn interior(&self) -> Option<MediumId> {
        self.sides.map(|s| s.interior)
    }
}

/// The media on the two sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Medium inside a closed shape, regardless of the direction of its normals, or behind the
    /// normal of an open shape.
    pub interior: MediumId,
    /// Medium outside a closed shape, or in front of the normal of an open shape.
    pub exterior: MediumId,
}

/// Surfaces that together divide a volume into media: the faces between cells of different labels,
/// or meshes. Each surface has one medium on either side. The surfaces join without gaps.
#[derive(Clone, Debug)]
pub struct Partition {
    /// Surfaces of the partition, as a range of objects.
    pub objects: Range<usize>,
    /// Medium around the partition.
    pub exterior: MediumId,
    /// Cells of the partition, if its surfaces are the faces between cells of different media.
    pub cells: Option<CellMedia>,
}

/// Cells that fill a divided volume, each with a medium.
#[derive(Clone, Debug)]
pub enum CellMedia {
    /// Voxels of a grid.
    Voxels(Arc<VoxelMedia>),
    /// Tetrahedra.
    Tetrahedra(Arc<TetrahedraMedia>),
}

impl CellMedia {
    /// Returns true if both consist of the same cells, in memory once, with equal media.
    pub fn is_same(&self, other: &CellMedia) -> bool {
        match (self, other) {
            (CellMedia::Voxels(a), CellMedia::Voxels(b)) => a.is_same(b),
            (CellMedia::Tetrahedra(a), CellMedia::Tetrahedra(b)) => a.is_same(b),
            _ => false,
        }
    }
}

impl Partition {
    /// Returns the voxels of the partition, if its cells are voxels.
    pub fn voxels(&self) -> Option<&Arc<VoxelMedia>> {
        match &self.cells {
            Some(CellMedia::Voxels(voxels)) => Some(voxels),
            _ => None,
        }
    }

    /// Returns the tetrahedra of the partition, if its cells are tetrahedra.
    pub fn tetrahedra(&self) -> Option<&Arc<TetrahedraMedia>> {
        match &self.cells {
            Some(CellMedia::Tetrahedra(tetrahedra)) => Some(tetrahedra),
            _ => None,
        }
    }
}

/// Everything that a scene consists of.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Objects.
    pub objects: Vec<Object>,
    /// Groups of objects that together divide volumes into media.
    pub partitions: Vec<Partition>,
    /// Media; the first is the ambient one, whose index must be constant.
    pub media: Vec<Medium>,
    /// Emitters.
    pub emitters: Vec<Emitter>,
    /// Sensor.
    pub sensor: Sensor,
    /// Film.
    pub film: FilmSpec,
    /// Tolerance of rays.
    pub tolerance: Tolerance,
    /// Largest number of reflections at smooth dielectrics, where refraction is possible, through
    /// which connections are searched for. Total reflections are not counted.
    pub reflections: u32,
    /// A box around the grids of meters, which light from infinity must fill like the rest of the
    /// scene; empty without meters.
    pub measured: Aabb,
}
