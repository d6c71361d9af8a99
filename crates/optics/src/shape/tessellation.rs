//! Triangulated approximations of shapes for programs that draw them. Transport uses the exact
//! shapes.

use super::{Shape, each};
use glam::DVec3;
use std::f64::consts::TAU;

/// Number of segments into which circles are tessellated.
const CIRCLE_SEGMENTS: usize = 64;

/// Triangles that approximate a shape. Their corners lie on the shape to round-off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// Positions of the corners.
    pub positions: Vec<DVec3>,
    /// Corners of each triangle, as indices into `positions`. The winding is arbitrary.
    pub triangles: Vec<[u32; 3]>,
}

impl Tessellation {
    /// Adds the image of the square \[−1, 1\]² under `place`.
    pub(super) fn add_square(&mut self, place: impl Fn([f64; 2]) -> DVec3) {
        self.add_grid([1, 1], |ij| place(ij.map(|k| 2.0 * k as f64 - 1.0)));
    }

    /// Adds a grid of `columns` × `rows` cells, whose corners `place` returns.
    fn add_grid(&mut self, [columns, rows]: [usize; 2], place: impl Fn([usize; 2]) -> DVec3) {
        let first = self.positions.len();
        let corner = |i: usize, j: usize| (first + j * (columns + 1) + i) as u32;
        for j in 0..=rows {
            self.positions.extend((0..=columns).map(|i| place([i, j])));
        }
        for j in 0..rows {
            for i in 0..columns {
                let [a, b] = [corner(i, j), corner(i + 1, j)];
                let [c, d] = [corner(i, j + 1), corner(i + 1, j + 1)];
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }

    /// Adds a surface of revolution about the z axis, in `rows` rows. `profile` returns the radius
    /// and the height at each end of a row.
    pub(super) fn add_turned(&mut self, rows: usize, profile: impl Fn(usize) -> [f64; 2]) {
        self.add_grid([CIRCLE_SEGMENTS, rows], |[i, j]| {
            let [radius, z] = profile(j);
            (radius * circle(i)).with_z(z)
        });
    }

    /// Adds the unit disk at height `z`.
    pub(super) fn add_disk(&mut self, z: f64) {
        self.add_turned(1, |j| [j as f64, z]);
    }
}

/// Returns a point of the unit circle around z.
fn circle(step: usize) -> DVec3 {
    // The last point equals the first bit for bit.
    let (sin, cos) = (TAU * (step % CIRCLE_SEGMENTS) as f64 / CIRCLE_SEGMENTS as f64).sin_cos();
    DVec3::new(cos, sin, 0.0)
}

impl Shape {
    /// Returns the shape as triangles: at least 64 around a circle, the triangles of a mesh
    /// unchanged, two for each face of voxels.
    pub fn tessellation(&self) -> Tessellation {
        let mut all = Tessellation::default();
        let placement = each!(self, s => {
            s.tessellate(&mut all);
            &s.placement
        }, {
            Shape::VoxelFaces(faces) => return faces.tessellation(),
            Shape::Mesh(mesh) => {
                return Tessellation {
                    positions: mesh.positions().to_vec(),
                    triangles: mesh.triangles().to_vec(),
                };
            }
        });
        all.positions
            .iter_mut()
            .for_each(|x| *x = placement.point(*x));
        all
    }
}
