//! Meshes from arrays.

use super::MeshData;
use super::build::check_mesh;
use crate::error::Problem;
use crate::tensor::Tensor;
use glam::DVec3;

/// Arrays of a mesh, with Mitsuba's names.
#[derive(Clone, Copy, Debug)]
pub struct Tensors<'a> {
    /// Positions, (n, 3).
    pub vertex_positions: &'a Tensor,
    /// Numbers of vertices from 0, (m, 3), counter-clockwise as seen from the front.
    pub faces: &'a Tensor,
    /// Texture coordinates, (n, 2).
    pub vertex_texcoords: Option<&'a Tensor>,
    /// Normals, (n, 3).
    pub vertex_normals: Option<&'a Tensor>,
    /// Linear colours, (n, 3).
    pub vertex_color: Option<&'a Tensor>,
}

impl MeshData {
    /// Makes a mesh from arrays.
    ///
    /// # Errors
    ///
    /// Name of an array, with its problem: another shape, a number that is not finite, or a face
    /// that is not three vertices.
    pub fn of_tensors(tensors: Tensors) -> Result<Self, (&'static str, Problem)> {
        let Tensors {
            vertex_positions,
            faces,
            ..
        } = tensors;
        let positions = vertex_positions.rows::<3>();
        let positions = positions.map_err(|p| ("vertex_positions", p))?;
        let count = positions.len();
        let of_vertices = |name, tensor: Option<&Tensor>| match tensor {
            Some(tensor) if tensor.shape().first() != Some(&count) => {
                let expected = format!("a row for each of {count} vertices");
                let found = format!("shape {:?}", tensor.shape());
                Err((name, Problem::Mismatch { expected, found }))
            }
            _ => Ok(()),
        };
        of_vertices("vertex_texcoords", tensors.vertex_texcoords)?;
        of_vertices("vertex_normals", tensors.vertex_normals)?;
        of_vertices("vertex_color", tensors.vertex_color)?;
        let uvs = tensors.vertex_texcoords.map(Tensor::rows::<2>);
        let normals = tensors.vertex_normals.map(Tensor::rows::<3>);
        let normals = normals.transpose().map_err(|p| ("vertex_normals", p))?;
        let vectors = |rows: Vec<[f64; 3]>| rows.into_iter().map(DVec3::from_array).collect();
        let colours = tensors.vertex_color.map(Tensor::rows::<3>);
        let colours = colours.transpose().map_err(|p| ("vertex_color", p))?;
        let mesh = MeshData {
            triangles: triangles(faces, count).map_err(|p| ("faces", p))?,
            positions: vectors(positions),
            normals: normals.map(vectors),
            uvs: uvs.transpose().map_err(|p| ("vertex_texcoords", p))?,
            colours: colours.map(|rows| rows.iter().map(|row| row.map(|v| v as f32)).collect()),
            ..MeshData::default()
        };
        check_mesh(mesh).map_err(|p| ("faces", p))
    }
}

fn triangles(faces: &Tensor, vertices: usize) -> Result<Vec<[u32; 3]>, Problem> {
    let rows = faces.rows::<3>()?;
    let is_vertex = |v: &f64| v.fract() == 0.0 && (0.0..vertices as f64).contains(v);
    if let Some(i) = rows.iter().position(|row| !row.iter().all(is_vertex)) {
        let message = format!(
            "face {i} is {:?}: expected numbers of vertices from 0 to {}",
            rows[i],
            vertices.saturating_sub(1)
        );
        return Err(Problem::Malformed(message));
    }
    Ok(rows.iter().map(|row| row.map(|v| v as u32)).collect())
}
