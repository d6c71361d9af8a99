//! Triangle meshes.

mod inside;
mod intersect;
mod normals;
mod topology;

pub use inside::{DIRECTIONS, FirstCrossing};
pub(super) use intersect::LineTest;

use super::tree::{Frame, Tree};
use super::{AreaSample, Hit, Intersection, ShapeError, Uv};
use eikonal::Aabb;
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::sync::OnceLock;

/// Triangles over shared vertices, in scene coordinates. Normals follow the winding, which is
/// counter-clockwise seen from their side. A closed mesh that is wound inside out is reversed, so
/// that its normals point outwards.
#[derive(Clone, Debug)]
pub struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    uvs: Option<Vec<[f64; 2]>>,
    /// Normals of the vertices: unit vectors, or zero where a vertex has none.
    normals: Option<Vec<DVec3>>,
    /// Hierarchy over the triangles. It is built on first use, because most meshes need none: one
    /// hierarchy over all meshes finds where straight lines meet them.
    tree: OnceLock<Tree>,
    /// Coordinates of the hierarchy.
    frame: Frame,
    /// Cumulative sums of the triangle areas.
    areas: Vec<f64>,
    bounds: Aabb,
    dropped: usize,
    closed: bool,
    convex: bool,
    flipped: bool,
    /// True if the given triangles were wound inside out.
    inside_out: bool,
    /// Bound of the rounding error of coordinates near the mesh.
    noise: f64,
}

impl Mesh {
    /// Creates a mesh of triangles over `positions`, with texture coordinates per vertex if given.
    /// Triangles without area are dropped; see [`Mesh::dropped`].
    ///
    /// # Errors
    /// Fails if there are too many triangles, none with an area, or one that refers to a missing
    /// vertex. Fails if a vertex is not finite, or if the number of texture coordinates differs
    /// from the number of vertices.
    pub fn new(
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        uvs: Option<Vec<[f64; 2]>>,
    ) -> Result<Self, ShapeError> {
        validate(&positions, &triangles, uvs.as_deref())?;
        let closed = topology::is_closed(&positions, &triangles);
        Self::of(positions, triangles, uvs, closed)
    }

    /// Creates a mesh of valid triangles; `closed` states whether they enclose a volume.
    fn of(
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        uvs: Option<Vec<[f64; 2]>>,
        closed: bool,
    ) -> Result<Self, ShapeError> {
        // Drop triangles without area.
        let given = triangles.len();
        let mut triangles = triangles;
        triangles.retain(|t| !is_degenerate(corners(&positions, t)));
        let dropped = given - triangles.len();
        if triangles.is_empty() {
            return Err(ShapeError::EmptyMesh { dropped });
        }
        // Turn a closed mesh that is wound inside out.
        let inside_out = closed && topology::signed_volume(&positions, &triangles) < 0.0;
        if inside_out {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let boxes = boxes(&positions, &triangles);
        let bounds = boxes.fold(Aabb::EMPTY, Aabb::union);
        let far = bounds.min.abs().max(bounds.max.abs()).max_element();
        let areas = triangles.iter().scan(0.0, |sum, t| {
            *sum += 0.5 * cross(corners(&positions, t)).length();
            Some(*sum)
        });
        Ok(Mesh {
            areas: areas.collect(),
            tree: OnceLock::new(),
            frame: Frame::around(&bounds),
            bounds,
            dropped,
            closed,
            convex: closed && topology::is_convex(&positions, &triangles, &bounds),
            flipped: false,
            inside_out,
            noise: 8.0 * f64::EPSILON * far,
            positions,
            triangles,
            uvs,
            normals: None,
        })
    }

    /// Returns the image under an affine map. A mirror map reverses the winding, so that normals
    /// stay on the same side of the material.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted, or if [`Mesh::new`] refuses the
    /// result.
    pub fn transformed(self, map: DAffine3) -> Result<Self, ShapeError> {
        if !map.is_finite() {
            return Err(ShapeError::NonFiniteTransform);
        }
        let det = map.matrix3.determinant();
        if det == 0.0 {
            return Err(ShapeError::SingularTransform { det });
        }
        let Mesh {
            mut positions,
            mut triangles,
            uvs,
            mut normals,
            closed,
            flipped,
            inside_out,
            ..
        } = self;
        let place = |p: &mut DVec3| *p = map.transform_point3(*p);
        positions.iter_mut().for_each(place);
        if det < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let to_normals = map.matrix3.inverse().transpose();
        let turn = |n: &mut DVec3| *n = (to_normals * *n).normalize_or_zero();
        normals.iter_mut().flatten().for_each(turn);
        validate(&positions, &triangles, uvs.as_deref())?;
        let mesh = Self::of(positions, triangles, uvs, closed)?;
        Ok(Mesh {
            inside_out: inside_out | mesh.inside_out,
            normals,
            flipped,
            ..mesh
        })
    }

    /// Returns the mesh with its vertices displaced by `distance` along the mean normals of the
    /// triangles around them. Vertices at the same position move equally, so that no cracks open.
    ///
    /// # Errors
    /// Fails if [`Mesh::new`] refuses the result.
    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        let key = |p: &DVec3| p.to_array().map(f64::to_bits);
        let mut normals: HashMap<[u64; 3], DVec3> = HashMap::new();
        for t in &self.triangles {
            let corners = corners(&self.positions, t);
            let normal = cross(corners).normalize_or_zero();
            for p in &corners {
                *normals.entry(key(p)).or_default() += normal;
            }
        }
        let moved = |p: &DVec3| {
            let normal = normals.get(&key(p)).copied().unwrap_or_default();
            *p + normal.normalize_or_zero() * distance
        };
        let positions = self.positions.iter().map(moved).collect();
        let mesh = Mesh::new(positions, self.triangles.clone(), self.uvs.clone())?;
        Ok(Mesh {
            normals: self.normals.clone(),
            dropped: self.dropped,
            inside_out: self.inside_out,
            ..mesh
        })
    }

    /// Returns the hierarchy over the triangles.
    pub(super) fn tree(&self) -> &Tree {
        let boxes = || boxes(&self.positions, &self.triangles);
        self.tree.get_or_init(|| Tree::new(boxes()))
    }

    /// Returns true if the given triangles were wound inside out and have been reversed.
    pub fn was_inside_out(&self) -> bool {
        self.inside_out
    }

    /// Returns the positions of the vertices.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Returns the signed volume between the surface and `apex`: the enclosed volume of closed
    /// meshes.
    pub fn cone_volume(&self, apex: DVec3) -> f64 {
        topology::cone_volume(&self.positions, &self.triangles, apex)
    }

    /// Returns the triangles with an area, as vertex indices. [`Hit::primitive`] is an index into
    /// this list.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns barycentric coordinates of the point of triangle `i` nearest to `p`, where `p` lies
    /// on the triangle to rounding.
    pub fn weights(&self, i: usize, p: DVec3) -> [f64; 3] {
        let t = self.triangle(i);
        let n = cross(t);
        let area = |k: usize| {
            let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
            n.dot((b - a).cross(p - a)).max(0.0)
        };
        let areas = [area(0), area(1), area(2)];
        areas.map(|a| a / areas.iter().sum::<f64>())
    }

    /// Returns the number of triangles dropped because they have no area.
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    pub(super) fn set_flipped(&mut self, flipped: bool) {
        self.flipped = flipped;
    }

    pub(super) fn is_flipped(&self) -> bool {
        self.flipped
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed
    }

    pub(super) fn is_convex(&self) -> bool {
        self.convex
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.bounds.grown(self.noise)
    }

    /// Returns the bound of the rounding error of coordinates near the mesh.
    pub(super) fn noise(&self) -> f64 {
        self.noise
    }

    pub(super) fn area(&self) -> f64 {
        self.areas[self.areas.len() - 1]
    }

    pub(super) fn part_areas(&self) -> Vec<f64> {
        let before = [0.0].iter().chain(&self.areas);
        before.zip(&self.areas).map(|(a, b)| b - a).collect()
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let v = u[0] * self.area();
        let last = self.areas.len() - 1;
        let i = self.areas.partition_point(|a| *a <= v).min(last);
        let below = if i > 0 { self.areas[i - 1] } else { 0.0 };
        let v = ((v - below) / (self.areas[i] - below)).clamp(0.0, 1.0);
        // The square root makes the distance from vertex 0 uniform in area.
        let r = v.sqrt();
        let weights = [1.0 - r, r * (1.0 - u[1]), r * u[1]];
        let hit = self.hit(&Intersection {
            theta: 0.0,
            local: weights.into(),
            primitive: i as u32,
        });
        AreaSample {
            position: hit.position,
            normal: hit.normal,
            uv: hit.uv,
            primitive: hit.primitive,
            pdf: self.area().recip(),
        }
    }

    pub(super) fn inverse_area(&self, position: DVec3, triangle: u32) -> [f64; 2] {
        let i = triangle as usize;
        let [_, b, c] = self.weights(i, position);
        let r = b + c;
        let below = if i > 0 { self.areas[i - 1] } else { 0.0 };
        let area = below + r * r * (self.areas[i] - below);
        [area / self.area(), if r > 0.0 { c / r } else { 0.0 }]
    }

    /// Returns true if texture coordinates were given. Otherwise they are the barycentric
    /// coordinates of each triangle.
    pub fn has_uvs(&self) -> bool {
        self.uvs.is_some()
    }

    /// Returns the corners of triangle `i`.
    pub(super) fn triangle(&self, i: usize) -> [DVec3; 3] {
        corners(&self.positions, &self.triangles[i])
    }

    #[inline]
    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        let (i, w) = (at.primitive as usize, at.local.to_array());
        let [a, b, c] = self.triangle(i);
        let side = if self.flipped { -1.0 } else { 1.0 };
        Hit {
            theta: at.theta,
            position: a + (b - a) * w[1] + (c - a) * w[2],
            normal: cross([a, b, c]).normalize() * side,
            uv: Uv::Plain(self.uv(i, w)),
            primitive: at.primitive,
        }
    }

    pub(super) fn uv(&self, i: usize, w: [f64; 3]) -> [f64; 2] {
        let Some(uvs) = &self.uvs else {
            return [w[1], w[2]];
        };
        let [a, b, c] = self.triangles[i].map(|v| uvs[v as usize]);
        [0, 1].map(|k| a[k] * w[0] + b[k] * w[1] + c[k] * w[2])
    }
}

fn corners(positions: &[DVec3], t: &[u32; 3]) -> [DVec3; 3] {
    t.map(|v| positions[v as usize])
}

/// Returns the boxes around the triangles.
fn boxes(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
) -> impl ExactSizeIterator<Item = Aabb> + Clone {
    triangles
        .iter()
        .map(|t| Aabb::around(corners(positions, t)))
}

/// Returns a vector along the normal whose length is twice the area.
fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Returns true if a triangle has no area to rounding: its height is lost in the rounding of its
/// sides.
pub(super) fn is_degenerate(t: [DVec3; 3]) -> bool {
    let longest = (t[1] - t[0])
        .length_squared()
        .max((t[2] - t[0]).length_squared())
        .max((t[2] - t[1]).length_squared());
    let n = cross(t).length();
    n <= 16.0 * f64::EPSILON * longest || n.recip().is_infinite()
}

fn validate(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    uvs: Option<&[[f64; 2]]>,
) -> Result<(), ShapeError> {
    let count = positions.len();
    if triangles.len() > (u32::MAX / 2) as usize {
        return Err(ShapeError::TooManyTriangles {
            got: triangles.len(),
        });
    }
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        return Err(ShapeError::NonFiniteVertex { vertex });
    }
    if let Some(uvs) = uvs.filter(|uvs| uvs.len() != count) {
        return Err(ShapeError::UvCount {
            expected: count,
            got: uvs.len(),
        });
    }
    for (triangle, t) in triangles.iter().enumerate() {
        if let Some(&index) = t.iter().find(|v| **v as usize >= count) {
            return Err(ShapeError::VertexIndex {
                triangle,
                index,
                count,
            });
        }
    }
    Ok(())
}
