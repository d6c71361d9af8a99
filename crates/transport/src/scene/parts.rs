//! What scenes are made of.

use crate::bsdf::Bsdf;
use crate::emitter::Emitter;
use crate::film::FilmSpec;
use crate::medium::Medium;
use crate::sensor::Sensor;
use crate::shape::Shape;
use crate::volume::VoxelMedia;
use eikonal::{Aabb, Tolerance};
use std::ops::Range;
use std::sync::Arc;

/// Index of a medium in [`Parts::media`].
pub type MediumId = usize;

/// The medium outside every shape that does not say otherwise.
pub const AMBIENT: MediumId = 0;

/// A shape with its surface properties and what lies on either side of it.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name used in messages.
    pub name: String,
    /// Geometry.
    pub shape: Shape,
    /// Surface scattering.
    pub bsdf: Bsdf,
    /// What lies on either side; `None` if it is the same medium, whichever that is.
    pub sides: Option<Sides>,
    /// Index of the emitter that covers it.
    pub emitter: Option<usize>,
}

impl Object {
    /// Whether rays go on in another medium on a deterministic way: connections go through such a surface.
    pub(crate) fn is_interface(&self) -> bool {
        match self.bsdf {
            Bsdf::Null | Bsdf::Dielectric(_) => true,
            _ => self.sides.is_some() && self.bsdf.is_partial(),
        }
    }

    /// The medium inside, if the surface separates media.
    pub fn interior(&self) -> Option<MediumId> {
        self.sides.map(|s| s.interior)
    }
}

/// The media on the two sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Inside a closed shape, whichever way its normals point; behind the normal of an open one.
    pub interior: MediumId,
    /// On the other side.
    pub exterior: MediumId,
}

/// Surfaces that together divide a volume into media: the faces between voxels of different labels, or meshes. Each has one medium on
/// either side, and where one ends others go on, so that no way leads around them.
#[derive(Clone, Debug)]
pub struct Partition {
    /// Its surfaces, as numbers of objects.
    pub objects: Range<usize>,
    /// The medium around it.
    pub exterior: MediumId,
    /// Its voxels, if its surfaces are the faces between those of different media.
    pub voxels: Option<Arc<VoxelMedia>>,
}

/// Everything that a scene is made of.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Objects.
    pub objects: Vec<Object>,
    /// Which objects together divide volumes into media.
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
    /// Connections are looked for through at most this many reflections at smooth dielectrics where
    /// refraction is possible; total reflections are not counted.
    pub reflections: u32,
    /// A box around the grids of meters, which light from infinity fills as it does all else; empty if there are none.
    pub measured: Aabb,
}
