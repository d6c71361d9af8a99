//! Triangles of the zero surface of a trilinear function on a grid.
//!
//! Each cell is divided into six tetrahedra around a diagonal. Vertices lie on the edges of
//! tetrahedra, exactly where the function is zero. The deviation of triangles between them is
//! proportional to the square of the cell size.

use std::collections::HashMap;

use glam::DVec3;

use super::MeshData;
use super::build::check_mesh;
use crate::error::Problem;

/// Corners of the tetrahedra of a cell: bit k of a corner's number is its position along axis k.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];
/// Number of bisections of an edge.
const HALVINGS: usize = 40;

/// Values at the nodes of a grid over the cube [0, 1]³, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct Distances<'a> {
    /// Numbers of nodes along x, y and z.
    pub size: [usize; 3],
    /// Values, negative inside.
    pub values: &'a [f64],
}

impl Distances<'_> {
    /// Returns the surface; its front side has positive values. Its texture coordinates are 0.
    ///
    /// # Errors
    ///
    /// Fewer than two nodes along an axis. A number of values that does not match the size. Values
    /// that are not finite. No neighbours of opposite sign.
    pub fn surface(&self) -> Result<MeshData, Problem> {
        let [nx, ny, nz] = self.size;
        let expected = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz));
        if self.size.iter().any(|n| *n < 2) || expected != Some(self.values.len()) {
            return Err(Problem::Mismatch {
                expected: "two or more values along each axis".to_owned(),
                found: format!("{} of size {:?}", self.values.len(), self.size),
            });
        }
        if let Some(i) = self.values.iter().position(|v| !v.is_finite()) {
            return Err(Problem::NotFinite {
                place: format!("value {i}"),
                value: self.values[i],
            });
        }
        let mut builder = Builder {
            distances: *self,
            mesh: MeshData::default(),
            vertices: HashMap::new(),
        };
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                for x in 0..nx - 1 {
                    builder.cell([x, y, z]);
                }
            }
        }
        // Use one point of a texture everywhere, as in Mitsuba.
        let uvs = vec![[0.0; 2]; builder.mesh.positions.len()];
        builder.mesh.uvs = Some(uvs);
        check_mesh(builder.mesh)
    }

    /// Returns the index of the node at a corner of a cell.
    fn node(&self, cell: [usize; 3], corner: usize) -> usize {
        let [x, y, z] = [0, 1, 2].map(|k| cell[k] + (corner >> k & 1));
        (z * self.size[1] + y) * self.size[0] + x
    }
}

struct Builder<'a> {
    distances: Distances<'a>,
    mesh: MeshData,
    /// Vertices by the nodes of their edges.
    vertices: HashMap<[usize; 2], u32>,
}

impl Builder<'_> {
    fn cell(&mut self, cell: [usize; 3]) {
        let grid = self.distances;
        let values: [f64; 8] = std::array::from_fn(|corner| grid.values[grid.node(cell, corner)]);
        if values.iter().all(|v| *v < 0.0) || values.iter().all(|v| *v >= 0.0) {
            return;
        }
        for tetrahedron in TETRAHEDRA {
            let (inside, outside): (Vec<usize>, Vec<usize>) = tetrahedron
                .iter()
                .partition(|corner| values[**corner] < 0.0);
            let vertex =
                |builder: &mut Self, i: usize, o: usize| builder.vertex(cell, &values, [i, o]);
            match (&inside[..], &outside[..]) {
                (&[a], &[b, c, d]) => {
                    let corners = [b, c, d].map(|o| vertex(self, a, o));
                    self.triangle(corners, place(b) - place(a));
                }
                (&[b, c, d], &[a]) => {
                    let corners = [b, c, d].map(|i| vertex(self, i, a));
                    self.triangle(corners, place(a) - place(b));
                }
                (&[a, b], &[c, d]) => {
                    let [ac, bc, bd, ad] =
                        [[a, c], [b, c], [b, d], [a, d]].map(|[i, o]| vertex(self, i, o));
                    let outward = place(c) + place(d) - place(a) - place(b);
                    self.triangle([ac, bc, bd], outward);
                    self.triangle([ac, bd, ad], outward);
                }
                _ => {}
            }
        }
    }

    /// Adds a triangle that faces `outward`.
    fn triangle(&mut self, corners: [u32; 3], outward: DVec3) {
        let [a, b, c] = corners;
        let [p, q, r] = corners.map(|i| self.mesh.positions[i as usize]);
        // Compare directions in units of cells, which need not be cubes.
        let cells = DVec3::from_array(self.distances.size.map(|n| (n - 1) as f64));
        let normal = ((q - p) * cells).cross((r - p) * cells);
        let turned = normal.dot(outward) < 0.0;
        self.mesh
            .triangles
            .push(if turned { [a, c, b] } else { [a, b, c] });
    }

    /// Returns the vertex on the edge between two corners of a cell. The first corner is inside,
    /// the second outside.
    fn vertex(&mut self, cell: [usize; 3], values: &[f64; 8], ends: [usize; 2]) -> u32 {
        let grid = self.distances;
        let mut key = ends.map(|corner| grid.node(cell, corner));
        key.sort_unstable();
        if let Some(known) = self.vertices.get(&key) {
            return *known;
        }
        let [inside, outside] = ends.map(place);
        let mut range = [0.0, 1.0];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (range[0] + range[1]);
            let is_inside = trilinear(values, inside.lerp(outside, middle)) < 0.0;
            range[usize::from(!is_inside)] = middle;
        }
        let within = inside.lerp(outside, range[1]);
        let first = DVec3::from_array(cell.map(|c| c as f64));
        let cells = DVec3::from_array(grid.size.map(|n| (n - 1) as f64));
        let number = self.mesh.positions.len() as u32;
        self.mesh.positions.push((first + within) / cells);
        self.vertices.insert(key, number);
        number
    }
}

/// Returns the position of a corner in its cell.
fn place(corner: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|k| (corner >> k & 1) as f64))
}

fn trilinear(values: &[f64; 8], p: DVec3) -> f64 {
    let weight = |corner: usize| {
        let along = |k: usize| {
            if corner >> k & 1 == 1 {
                p[k]
            } else {
                1.0 - p[k]
            }
        };
        along(0) * along(1) * along(2)
    };
    (0..8).map(|corner| weight(corner) * values[corner]).sum()
}
