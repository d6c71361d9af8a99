//! Triangulated approximations of shapes for programs that draw them. Light meets the exact shapes.

use super::Shape;
use super::placement::Placement;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Number of segments of a circle.
const AROUND: usize = 64;
/// Number of segments from pole to pole.
const DOWN: usize = 32;

/// Triangles that approximate a shape. Their corners lie on the shape to round-off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// Positions of the corners.
    pub positions: Vec<DVec3>,
    /// Corners of each triangle, as indices into `positions`. The winding is arbitrary.
    pub triangles: Vec<[u32; 3]>,
}

impl Tessellation {
    /// Adds the rectangle between four corners in order.
    fn add_rectangle(&mut self, corners: [DVec3; 4]) {
        self.add_grid([1, 1], |[u, v]| {
            let (u, v) = (u as f64, v as f64);
            corners[0]
                .lerp(corners[1], u)
                .lerp(corners[3].lerp(corners[2], u), v)
        });
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

    /// Adds the unit disk at height `z`.
    fn add_disk(&mut self, z: f64) {
        self.add_grid([AROUND, 1], |[i, j]| (j as f64 * circle(i)).with_z(z));
    }
}

/// Returns a point of the unit circle around z.
fn circle(step: usize) -> DVec3 {
    // The last point equals the first bit for bit.
    let (sin, cos) = (TAU * (step % AROUND) as f64 / AROUND as f64).sin_cos();
    DVec3::new(cos, sin, 0.0)
}

impl Shape {
    /// Returns the shape as triangles: at least 64 around a circle, the triangles of a mesh
    /// unchanged, two for each face of voxels.
    pub fn tessellation(&self) -> Tessellation {
        let mut all = Tessellation::default();
        let placement: &Placement = match self {
            Shape::Sphere(s) => {
                all.add_grid([AROUND, DOWN], |[i, j]| {
                    let (sin, cos) = (PI * j as f64 / DOWN as f64).sin_cos();
                    // Planted error "poles of spheres as wide as their equators", found by morgana-transport/transport::shape::tessellation::corners_lie_on_the_surface:
                    // circle(i).with_z(cos)
                    (sin * circle(i)).with_z(cos)
                });
                &s.placement
            }
            Shape::Cube(s) => {
                for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
                    let corner = |u: f64, v: f64| {
                        let mut x = [side; 3];
                        (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (u, v);
                        DVec3::from_array(x)
                    };
                    all.add_rectangle([
                        corner(-1.0, -1.0),
                        corner(1.0, -1.0),
                        corner(1.0, 1.0),
                        corner(-1.0, 1.0),
                    ]);
                }
                &s.placement
            }
            Shape::Rectangle(s) => {
                let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
                all.add_rectangle([
                    corner(-1.0, -1.0),
                    corner(1.0, -1.0),
                    corner(1.0, 1.0),
                    corner(-1.0, 1.0),
                ]);
                &s.placement
            }
            Shape::Disk(s) => {
                all.add_disk(0.0);
                &s.placement
            }
            Shape::Cylinder(s) => {
                all.add_grid([AROUND, 1], |[i, j]| circle(i).with_z(j as f64));
                if s.is_capped() {
                    all.add_disk(0.0);
                    all.add_disk(1.0);
                }
                &s.placement
            }
            Shape::VoxelFaces(faces) => return faces.tessellation(),
            Shape::Mesh(mesh) => {
                return Tessellation {
                    positions: mesh.positions().to_vec(),
                    triangles: mesh.triangles().to_vec(),
                };
            }
        };
        all.positions
            .iter_mut()
            .for_each(|x| *x = placement.point(*x));
        all
    }
}
