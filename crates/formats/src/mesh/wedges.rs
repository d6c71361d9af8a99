//! Texture coordinates of the corners of faces.

use super::MeshData;
use std::collections::HashMap;

/// Maximum memory for a vertex, and for a corner, while vertices are split, in bytes.
pub(super) const BYTES_PER_VERTEX: u64 = 32;
pub(super) const BYTES_PER_CORNER: u64 = 320;

/// Texture coordinates of corners without any, until all corners are known.
const NONE: [f64; 2] = [f64::NAN; 2];

/// Splitting of vertices whose corners differ in texture coordinates.
pub(super) struct Wedges {
    /// Texture coordinates of each vertex, once a corner has some.
    uvs: Vec<Option<[f64; 2]>>,
    originals: Vec<u32>,
    copies: HashMap<(u32, [u64; 2]), u32>,
}

impl Wedges {
    /// Prepares a mesh of `vertices` vertices.
    pub(super) fn new(vertices: usize) -> Self {
        Wedges {
            uvs: vec![None; vertices],
            originals: (0..vertices as u32).collect(),
            copies: HashMap::new(),
        }
    }

    /// Returns the vertex of a corner with optional texture coordinates: the given vertex, or a
    /// copy of it.
    pub(super) fn vertex(&mut self, vertex: u32, uv: Option<[f64; 2]>) -> u32 {
        let is_finite = |uv: &[f64; 2]| uv.iter().all(|v| v.is_finite());
        let uv = uv.filter(is_finite).unwrap_or(NONE);
        let bits = uv.map(f64::to_bits);
        let known = self.uvs[vertex as usize].get_or_insert(uv);
        if known.map(f64::to_bits) == bits {
            return vertex;
        }
        let next = self.uvs.len() as u32;
        let copy = *self.copies.entry((vertex, bits)).or_insert(next);
        if copy == next {
            self.uvs.push(Some(uv));
            self.originals.push(vertex);
        }
        copy
    }

    /// Adds the copies and the texture coordinates to the mesh, if corners have any.
    pub(super) fn finish(self, mesh: &mut MeshData) {
        let uvs = self.uvs.into_iter().map(|uv| uv.unwrap_or(NONE));
        let mut uvs: Vec<[f64; 2]> = uvs.collect();
        if uvs.iter().all(|uv| uv[0].is_nan()) {
            return;
        }
        let copies = &self.originals[mesh.positions.len()..];
        extend(&mut mesh.positions, copies);
        mesh.normals.iter_mut().for_each(|all| extend(all, copies));
        mesh.colours.iter_mut().for_each(|all| extend(all, copies));
        for attribute in mesh.attributes.iter_mut().filter(|a| !a.is_of_faces()) {
            extend(&mut attribute.values, copies);
        }
        for (vertex, uv) in (0..).zip(&mut uvs) {
            if uv[0].is_nan() {
                *uv = [0.0; 2];
                mesh.without_uvs.push(vertex);
            }
        }
        mesh.uvs = Some(uvs);
        mesh.originals = Some(self.originals);
    }
}

fn extend<T: Copy>(values: &mut Vec<T>, copies: &[u32]) {
    values.reserve_exact(copies.len());
    for original in copies {
        values.push(values[*original as usize]);
    }
}
