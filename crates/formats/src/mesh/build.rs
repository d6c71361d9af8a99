//! Checks of meshes of all formats.

use glam::DVec3;

use super::MeshData;
use crate::error::Problem;

/// Appends a polygon as a fan of triangles around its first vertex.
pub(super) fn fan(triangles: &mut Vec<[u32; 3]>, polygon: &[u32]) {
    if let [first, rest @ ..] = polygon {
        triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}

/// Returns a position; an error if it is not finite.
pub(super) fn check_position(position: DVec3, index: usize) -> Result<DVec3, Problem> {
    match position.to_array().into_iter().find(|v| !v.is_finite()) {
        Some(value) => Err(Problem::NotFinite {
            place: format!("vertex {index}"),
            value,
        }),
        None => Ok(position),
    }
}

/// Returns a mesh; an error if it has no triangles.
pub(super) fn check_mesh(mesh: MeshData) -> Result<MeshData, Problem> {
    if mesh.triangles.is_empty() {
        return Err(Problem::Empty("the mesh has no faces".to_owned()));
    }
    Ok(mesh)
}
