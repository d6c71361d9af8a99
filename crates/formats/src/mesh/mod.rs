//! Triangle meshes.

mod attributes;
mod build;
pub mod curves;
pub mod gltf;
pub mod hair;
pub mod isosurface;
pub mod label_surfaces;
pub mod obj;
pub mod ply;
pub mod serialized;
mod tensors;
pub mod tetrahedra;
mod wedges;

use std::path::Path;

use glam::DVec3;

use crate::error::{FileError, Problem};
use crate::input::Limits;

pub use attributes::MeshAttribute;
pub use tensors::Tensors;

/// Triangle mesh. All indices are valid, and positions are finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions of the vertices.
    pub positions: Vec<DVec3>,
    /// Three vertices for each triangle, counter-clockwise as seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the vertices; zero for vertices without any.
    pub uvs: Option<Vec<[f64; 2]>>,
    /// Vertices without texture coordinates, if other vertices have some.
    pub without_uvs: Vec<u32>,
    /// Normals of the vertices, of any length; zero for vertices without any.
    pub normals: Option<Vec<DVec3>>,
    /// Original of each vertex, which may be the vertex itself: seams of texture coordinates split
    /// vertices of the file.
    pub originals: Option<Vec<u32>>,
    /// Number of faces that were skipped because they have fewer than three corners.
    pub skipped_faces: usize,
    /// Linear colours of the vertices.
    pub colours: Option<Vec<[f32; 3]>>,
    /// Linear colours of the triangles.
    pub face_colours: Option<Vec<[f32; 3]>>,
    /// Other quantities of the vertices and triangles.
    pub attributes: Vec<MeshAttribute>,
}

impl MeshData {
    /// Reads an `.obj`, `.ply`, `.gltf` or `.glb` file, by its extension.
    ///
    /// # Errors
    ///
    /// See [`obj::read`], [`ply::read`] and [`gltf::read`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::read_within(path, Limits::default())
    }

    /// Reads a file within a limit of memory, as [`MeshData::read`].
    ///
    /// # Errors
    ///
    /// As for [`MeshData::read`].
    pub fn read_within(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("obj") => obj::read(path, limits),
            Some("ply") => ply::read(path, limits),
            Some("gltf" | "glb") => gltf::read(path, limits),
            _ => {
                let message = "meshes are read from .obj, .ply, .gltf and .glb";
                Err(Problem::Unsupported(message.into()).at(path))
            }
        }
    }
}
