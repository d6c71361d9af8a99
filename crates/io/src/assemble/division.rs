//! Division of label volumes into parts, and the surfaces between the parts. Scenes that divide a
//! volume in the same way share them.

use super::content::{Content, label_grid, labels_content};
use crate::mesh::label_surfaces::{self, PartSurface};
use glam::DAffine3;
use std::collections::BTreeMap;
use std::sync::Arc;
use transport::shape::{Mesh, Shape, ShapeError, VoxelFaces};
use transport::shared::Shared;
use transport::volume::{GridError, LabelGrid, TetrahedralMesh};

/// Surfaces of divided volumes in use, by the parts of the voxels, their position and the kind of
/// surfaces.
static SURFACES: Shared<Content, Surfaces> = Shared::new();

/// Number of voxels of each label of a volume.
pub(super) type LabelCounts = BTreeMap<u32, usize>;

/// Part of the volume to which a label belongs, and the label's number within that part. Part 0 is
/// outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Place {
    pub part: u8,
    pub member: u8,
}

/// Part of each label of a volume, and the label's number within the part.
pub(super) type Places = BTreeMap<u32, Place>;

/// Volume divided into parts, numbered from 1.
pub(super) struct Division {
    /// Surfaces between the parts.
    pub surfaces: Arc<Surfaces>,
    /// Label numbers of the voxels within each part; `None` for a part that has only one label.
    pub members: Vec<Option<Arc<LabelGrid>>>,
}

/// Volume whose voxels belong to parts numbered from 1. Part 0 is outside.
pub(super) struct Parts {
    /// Number of voxels along x, y, z.
    pub size: [usize; 3],
    /// Part of each voxel, x fastest.
    pub numbers: Vec<u8>,
    /// Map from the unit cube to the world.
    pub to_world: DAffine3,
}

/// Surfaces between all parts of a volume.
pub(super) struct Surfaces {
    /// Placed cells with their parts, if the surfaces are faces of cells.
    pub cells: Option<Cells>,
    /// Surfaces between parts: one for each pair of parts that touch.
    pub list: Vec<Surface>,
}

/// Cells of a divided volume, with the number of their part.
#[derive(Clone)]
pub(super) enum Cells {
    Voxels(Arc<LabelGrid>),
    Tetrahedra(Arc<TetrahedralMesh>),
}

/// Surface between two parts.
#[derive(Clone)]
pub(super) struct Surface {
    /// Parts behind the surface and in front of it, as its normals point; reversed if `turned`.
    pub parts: [u8; 2],
    /// True if normals point into the first part.
    pub turned: bool,
    /// Shape of the surface, placed in the world.
    pub shape: Shape,
}

/// Reason why surfaces cannot be built.
#[derive(Debug, thiserror::Error)]
pub(super) enum SurfacesError {
    /// The volume cannot be placed.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// A surface cannot be built.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

impl Parts {
    /// Builds the surfaces between the parts: smooth surfaces, or faces of voxels.
    ///
    /// # Errors
    /// A place that has no inverse; a volume that is too thin or has too many voxels.
    pub(super) fn surfaces(self, smooth: bool) -> Result<Arc<Surfaces>, SurfacesError> {
        let content = labels_content(self.size, &self.numbers, self.to_world)
            .bytes(&[u8::from(smooth)])
            .finish();
        SURFACES.try_get(content, || {
            if smooth {
                self.smooth_surfaces()
            } else {
                self.voxel_faces()
            }
        })
    }

    fn smooth_surfaces(self) -> Result<Surfaces, SurfacesError> {
        let division = label_surfaces::Division {
            size: self.size,
            parts: &self.numbers,
        };
        Surfaces::of_meshes(division.surfaces(), self.to_world, None)
    }

    fn voxel_faces(self) -> Result<Surfaces, SurfacesError> {
        let grid = label_grid(self.size, self.numbers, self.to_world)?;
        let faces = VoxelFaces::all(&grid)?;
        Ok(Surfaces {
            cells: Some(Cells::Voxels(grid)),
            list: faces.into_iter().map(Surface::from).collect(),
        })
    }
}

impl Surfaces {
    /// Places meshes in the world. `cells` are the cells whose faces they are, if there are any.
    ///
    /// # Errors
    /// A place that has no inverse.
    pub(super) fn of_meshes(
        meshes: Vec<PartSurface>,
        to_world: DAffine3,
        cells: Option<Cells>,
    ) -> Result<Self, SurfacesError> {
        let placed = meshes.into_iter().map(|mesh| placed(mesh, to_world));
        Ok(Surfaces {
            cells,
            list: placed.collect::<Result<_, _>>()?,
        })
    }
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

/// Places a smooth surface in the world.
fn placed(surface: PartSurface, to_world: DAffine3) -> Result<Surface, ShapeError> {
    let mesh = Mesh::new(surface.mesh.positions, surface.mesh.triangles, None)?;
    Ok(Surface {
        parts: surface.parts,
        turned: mesh.was_inside_out(),
        shape: mesh.transformed(to_world)?.into(),
    })
}
