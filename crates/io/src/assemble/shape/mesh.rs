//! Shapes from files.

use crate::error::FileError;
use crate::mesh::{MeshData, serialized};
use crate::query::Query;
use crate::scene::{FileRegistry, Object, ObjectId};
use glam::DAffine3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use transport::shape::{Mesh, Shape, ShapeError};

/// Linear colours of the vertices of a mesh.
pub(super) type Colours = Option<Arc<Vec<[f32; 3]>>>;

/// Triangles of all copies together: some ten gigabytes of memory.
const MOST_COPIED: usize = 100_000_000;

/// Meshes of groups, before they are placed.
#[derive(Default)]
pub(in super::super) struct Originals {
    meshes: HashMap<ObjectId, (Arc<Mesh>, Colours)>,
    /// Number of triangles of all copies.
    copied: usize,
}

/// The mesh that a shape names, in place; `None` if its file cannot be read (reported then). The originals of copies
/// are kept.
pub(super) fn mesh(
    object: &Object,
    (frame, copied): (DAffine3, bool),
    q: &mut Query,
    (files, originals): (&mut FileRegistry, &mut Originals),
) -> Option<Result<(Shape, Colours), ShapeError>> {
    let path = q.path("filename", files);
    // Normals are geometric throughout: interpolated ones would break the laws of refraction.
    q.boolean_or("face_normals", true);
    // Most programs that write .obj files have v grow upwards, whereas images begin at the top.
    let flip = match object.plugin.as_str() {
        "serialized" => false,
        kind => q.boolean_or("flip_tex_coords", kind == "obj"),
    };
    let index = match object.plugin.as_str() {
        "serialized" => Some(q.integer_in("shape_index", 0.., 0) as usize),
        _ => None,
    };
    let (mesh, colours) = match originals.meshes.get(&object.number) {
        Some(known) => known.clone(),
        None => {
            let data = read(&path, index).map_err(|e| q.file_error("filename", &e));
            match original(data.ok()?, flip) {
                Ok(original) => original,
                Err(error) => return Some(Err(error)),
            }
        }
    };
    if copied {
        originals.copied += mesh.triangles().len();
        if originals.copied > MOST_COPIED {
            let message =
                format!("instances are copies, and there are more than {MOST_COPIED} triangles");
            q.error("filename", message);
            return None;
        }
        let kept = (mesh.clone(), colours.clone());
        originals.meshes.entry(object.number).or_insert(kept);
    }
    Some(
        mesh.transformed(frame)
            .map(|mesh| (Shape::from(mesh), colours)),
    )
}

fn read(path: &Path, index: Option<usize>) -> Result<MeshData, FileError> {
    match index {
        Some(index) => serialized::read(path, index),
        None => MeshData::read(path),
    }
}

fn original(mut data: MeshData, flip: bool) -> Result<(Arc<Mesh>, Colours), ShapeError> {
    if flip {
        let uvs = data.uvs.iter_mut().flatten();
        uvs.for_each(|uv| uv[1] = 1.0 - uv[1]);
    }
    let colours = data.colours.map(Arc::new);
    let mesh = Mesh::new(data.positions, data.triangles, data.uvs)?;
    Ok((Arc::new(mesh), colours))
}
