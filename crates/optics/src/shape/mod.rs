//! Surfaces, and their intersections with curved and straight rays.
//!
//! Analytic shapes are affine images of a canonical shape. A curved arc is a Bézier curve, and so
//! is its affine image. Inserting the arc into the equation of a canonical shape gives a polynomial
//! in θ of degree five (planes) or ten (quadrics). Its first root is found to round-off. No chord
//! ever replaces the arc.

mod accel;
mod chart;
mod cube;
mod curve;
mod cylinder;
mod disk;
mod error;
mod line;
mod line_search;
mod mesh;
mod offset;
mod placement;
mod planar;
mod rectangle;
mod shading;
mod sphere;
mod split;
mod sweep;
mod tessellation;
mod tree;
mod uv;
mod voxel_faces;

pub use accel::Accel;
pub use accel::Except;
use chart::AreaDensity;
pub(crate) use chart::Chart;
pub use cube::Cube;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use error::ShapeError;
pub use mesh::Mesh;
pub use mesh::{DIRECTIONS, FirstCrossing};
pub use rectangle::Rectangle;
pub use sphere::Sphere;
pub use tessellation::Tessellation;
pub use tree::Tree;
pub use uv::Uv;
pub use voxel_faces::VoxelFaces;

use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Intersection of an arc with a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter of the arc at the intersection.
    pub theta: f64,
    /// Position, projected onto the surface to round-off.
    pub position: DVec3,
    /// Geometric unit normal. It points out of closed shapes and along the image of +z for flat
    /// ones; `flip_normals` reverses it.
    pub normal: DVec3,
    /// Surface coordinates.
    pub uv: Uv,
    /// Part that was hit: the face of a cube, the side (0) or a cap (1, 2) of a cylinder, the
    /// triangle of a mesh.
    pub primitive: u32,
}

/// Intersection of an arc with a shape, before the position, normal and uv are computed: see
/// [`Shape::hit`].
#[derive(Clone, Copy, Debug)]
pub struct Intersection {
    /// Parameter of the arc, as in [`Hit`].
    pub theta: f64,
    /// Position in the coordinates of the canonical shape. Meshes store the barycentric coordinates
    /// in the triangle, faces of voxels a position in voxels.
    local: DVec3,
    /// Part that was hit, as in [`Hit`].
    primitive: u32,
}

impl Intersection {
    /// Orders the intersections of an arc with one shape. Of two at the same place, as on the edge
    /// between two triangles, the one with the part that comes first in the list is first.
    fn order(&self, other: &Intersection) -> std::cmp::Ordering {
        let by_theta = self.theta.total_cmp(&other.theta);
        by_theta.then(self.primitive.cmp(&other.primitive))
    }
}

/// Point sampled on the surface of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// The point.
    pub position: DVec3,
    /// Geometric unit normal, as in [`Hit`].
    pub normal: DVec3,
    /// Surface coordinates, as in [`Hit`].
    pub uv: Uv,
    /// Part of the shape, as in [`Hit`].
    pub primitive: u32,
    /// Density per area, in scene units⁻², at this point.
    pub pdf: f64,
}

/// Surface point with the data that textures need.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Site {
    /// Position.
    pub position: DVec3,
    /// Texture coordinates, in Mitsuba's convention.
    pub uv: Uv,
    /// Part of the shape, as in [`Hit`].
    pub primitive: u32,
}

/// A surface.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Unit sphere; an ellipsoid under a general affine map.
    Sphere(Sphere),
    /// Cube \[−1, 1\]³.
    Cube(Cube),
    /// Square \[−1, 1\]² at z = 0, facing +z.
    Rectangle(Rectangle),
    /// Unit disk at z = 0, facing +z.
    Disk(Disk),
    /// Cylinder of unit radius from z = 0 to z = 1, open or capped.
    Cylinder(Cylinder),
    /// Triangle mesh, shared between copies of the shape.
    Mesh(std::sync::Arc<Mesh>),
    /// Faces between voxels of two labels, shared between copies of the shape.
    VoxelFaces(std::sync::Arc<VoxelFaces>),
}

/// Evaluates an expression on whichever shape this is. Meshes and faces of voxels may have arms of
/// their own.
macro_rules! each {
    ($self:expr, $s:ident => $e:expr) => {
        each!($self, $s => $e, { Shape::Mesh($s) => $e, Shape::VoxelFaces($s) => $e })
    };
    ($self:expr, $s:ident => $e:expr, { $($arms:tt)* }) => {
        match $self {
            Shape::Sphere($s) => $e,
            Shape::Cube($s) => $e,
            Shape::Rectangle($s) => $e,
            Shape::Disk($s) => $e,
            Shape::Cylinder($s) => $e,
            $($arms)*
        }
    };
}
use each;

impl Shape {
    /// Returns the shape with its normals reversed if `flip` is set, and not reversed otherwise.
    pub fn with_flipped_normals(mut self, flip: bool) -> Self {
        each!(&mut self, s => s.set_flipped(flip), {
            // Keep a shared mesh shared if its normals need no change.
            Shape::Mesh(s) if s.is_flipped() == flip => {}
            Shape::Mesh(s) => std::sync::Arc::make_mut(s).set_flipped(flip),
            Shape::VoxelFaces(s) if s.is_flipped() == flip => {}
            Shape::VoxelFaces(s) => std::sync::Arc::make_mut(s).set_flipped(flip),
        });
        self
    }

    /// Returns true if the normals are reversed.
    pub fn has_flipped_normals(&self) -> bool {
        each!(self, s => s.is_flipped())
    }

    /// Finds the intersection with the smallest θ in (theta_min, theta_max].
    ///
    /// The search excludes a surface that passes through the point at `theta_min` to round-off. It
    /// includes a surface that passes through the point at `theta_max`. Hence a search that
    /// continues from a hit, or from arc to arc, neither finds a hit twice nor loses one.
    pub fn first_hit(&self, arc: &Arc, theta_min: f64, theta_max: f64) -> Option<Hit> {
        let intersection = self.intersect(arc, [theta_min, theta_max])?;
        Some(self.hit(&intersection))
    }

    /// Finds the intersection of [`Shape::first_hit`], without its position and normal.
    fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        each!(self, s => s.intersect(arc, theta))
    }

    /// Computes the position, normal and uv of an intersection with this shape.
    pub fn hit(&self, intersection: &Intersection) -> Hit {
        each!(self, s => s.hit(intersection))
    }

    /// Returns the data that textures need at a hit.
    pub fn site(&self, hit: &Hit) -> Site {
        self.site_at(hit.position, hit.uv, hit.primitive)
    }

    /// Returns the data that textures need at a sampled point of the surface.
    pub fn site_of(&self, sample: &AreaSample) -> Site {
        self.site_at(sample.position, sample.uv, sample.primitive)
    }

    fn site_at(&self, position: DVec3, uv: Uv, primitive: u32) -> Site {
        let uv = match self {
            Shape::Cube(_) => Uv::Plain(cube::texture_uv(primitive, uv.get())),
            _ => uv,
        };
        Site {
            position,
            uv,
            primitive,
        }
    }

    /// Returns a box around the surface.
    pub fn aabb(&self) -> Aabb {
        each!(self, s => s.aabb())
    }

    /// Returns an upper bound of the distance between two points of the shape; exact for spheres
    /// and ellipsoids.
    pub fn diameter(&self) -> f64 {
        match self {
            Shape::Sphere(s) => s.diameter(),
            _ => self.aabb().diagonal(),
        }
    }

    /// Returns true if a box certainly has no point in common with the inside of a closed shape.
    /// For a box close to the surface, it may return false although they have no common point.
    pub fn misses(&self, region: &Aabb) -> bool {
        match self {
            Shape::Sphere(s) => s.misses(region),
            Shape::Cylinder(s) => s.misses(region),
            _ => !self.aabb().overlaps(region),
        }
    }

    /// Returns true if the shape encloses a volume.
    pub fn is_closed(&self) -> bool {
        match self {
            Shape::Sphere(_) | Shape::Cube(_) => true,
            Shape::Rectangle(_) | Shape::Disk(_) => false,
            Shape::Cylinder(s) => s.is_capped(),
            Shape::Mesh(s) => s.is_closed(),
            Shape::VoxelFaces(s) => s.is_closed(),
        }
    }

    /// Returns true if `p` lies in the enclosed volume; false for open shapes.
    pub fn contains(&self, p: DVec3) -> bool {
        match self {
            Shape::Sphere(s) => s.contains(p),
            Shape::Cube(s) => s.contains(p),
            Shape::Rectangle(_) | Shape::Disk(_) => false,
            Shape::Cylinder(s) => s.contains(p),
            Shape::Mesh(s) => s.contains(p),
            Shape::VoxelFaces(s) => s.contains(p),
        }
    }

    /// Returns true if the shape encloses a convex volume. Large meshes are not checked and return
    /// false.
    pub fn is_convex(&self) -> bool {
        match self {
            Shape::Mesh(s) => s.is_convex(),
            Shape::VoxelFaces(s) => s.is_convex(),
            _ => self.is_closed(),
        }
    }

    /// Returns true if a straight line that leaves the surface along `direction`, from a point with
    /// normal `normal`, never meets the surface again.
    pub fn never_hit_again(&self, normal: DVec3, direction: DVec3) -> bool {
        // Planted error "lines that leave a ball inwards said not to meet it again", found by morgana-transport/transport::edges::straight_connections_are_those_of_the_solver:
        // let outward = || true;
        let outward = || (normal.dot(direction) > 0.0) != self.has_flipped_normals();
        match self {
            Shape::Mesh(_) | Shape::VoxelFaces(_) => false,
            _ => self.is_flat() || (self.is_closed() && outward()),
        }
    }

    /// Returns true if two shapes have equal parameters. Meshes and faces of voxels are equal only
    /// if they share memory.
    pub fn is_same(&self, other: &Shape) -> bool {
        each!(self, s => s.is_same(other), {
            Shape::Mesh(a) => matches!(other, Shape::Mesh(b) if std::sync::Arc::ptr_eq(a, b)),
            Shape::VoxelFaces(a) => {
                matches!(other, Shape::VoxelFaces(b) if std::sync::Arc::ptr_eq(a, b))
            }
        })
    }

    /// Returns true if the shape lies in one plane.
    pub fn is_flat(&self) -> bool {
        matches!(self, Shape::Rectangle(_) | Shape::Disk(_))
    }

    /// Returns the enclosed volume, in cubic scene units; `None` for open shapes.
    pub fn volume(&self) -> Option<f64> {
        match self {
            Shape::Sphere(s) => Some(s.volume()),
            Shape::Cube(s) => Some(s.volume()),
            Shape::Cylinder(s) => s.is_capped().then(|| s.volume()),
            Shape::Rectangle(_) | Shape::Disk(_) => None,
            Shape::Mesh(s) => s.is_closed().then(|| s.cone_volume(s.positions()[0]).abs()),
            Shape::VoxelFaces(s) => s.is_closed().then(|| s.volume()),
        }
    }

    /// Returns points whose convex hull contains the shape.
    pub fn hull(&self) -> Vec<DVec3> {
        match self {
            Shape::Sphere(s) => s.hull(),
            Shape::Cylinder(s) => s.hull(),
            Shape::Cube(s) => s.corners().to_vec(),
            Shape::Mesh(s) => s.positions().to_vec(),
            Shape::VoxelFaces(s) => s.hull(),
            Shape::Rectangle(_) | Shape::Disk(_) => self.aabb().corners().to_vec(),
        }
    }

    /// Calls `visit` with points around each patch of the surface: each triangle, each face of
    /// voxels, or the whole shape. The box of the points contains the patch.
    pub fn each_patch(&self, mut visit: impl FnMut(&[DVec3])) {
        match self {
            Shape::Mesh(s) => (0..s.triangles().len()).for_each(|i| visit(&s.triangle(i))),
            Shape::VoxelFaces(s) => s.each_face(visit),
            _ => visit(&self.aabb().corners()),
        }
    }

    /// Returns the area, in square scene units.
    pub fn area(&self) -> f64 {
        each!(self, s => s.area())
    }

    /// Returns the areas, in square scene units, of the parts that [`Hit::primitive`]
    /// distinguishes.
    pub fn part_areas(&self) -> Vec<f64> {
        match self {
            Shape::Cube(s) => s.part_areas(),
            Shape::Cylinder(s) => s.part_areas(),
            Shape::Mesh(s) => s.part_areas(),
            Shape::VoxelFaces(s) => s.part_areas(),
            whole => vec![whole.area()],
        }
    }

    /// Samples a point of the surface from two uniform numbers. The density is uniform in area,
    /// except on spheres and cylinders under maps other than similarities, where `pdf` varies.
    pub fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        each!(self, s => s.sample_area(u))
    }

    /// Returns the density per area, in scene units⁻², with which [`Shape::sample_area`] samples a
    /// point of part `primitive` of the surface.
    pub fn pdf_area(&self, position: DVec3, primitive: u32) -> f64 {
        match self {
            Shape::Sphere(s) => s.pdf_area(position),
            Shape::Cylinder(s) => s.pdf_area(position, primitive),
            flat => flat.area().recip(),
        }
    }

    /// Returns the two numbers for which [`Shape::sample_area`] gives a point of part `primitive`
    /// of the surface.
    pub fn inverse_area(&self, position: DVec3, primitive: u32) -> [f64; 2] {
        each!(self, s => s.inverse_area(position, primitive))
    }

    /// Returns the shape operator S at a point of part `primitive` of the surface
    /// (docs/theory.md#interfaces). The normal N turns by δN = S·δx for a tangential δx. S is
    /// symmetric, and S·N = 0.
    pub fn shape_operator(&self, position: DVec3, primitive: u32) -> DMat3 {
        match self {
            Shape::Sphere(s) => s.shape_operator(position),
            Shape::Cylinder(s) => s.shape_operator(position, primitive),
            _ => DMat3::ZERO,
        }
    }
}

/// Implements `From` for [`Shape`], and the methods that all placed shapes share.
macro_rules! placed {
    ($($shape:ident),*) => {$(
        impl From<$shape> for Shape {
            fn from(s: $shape) -> Self {
                Shape::$shape(s)
            }
        }

        impl $shape {
            fn set_flipped(&mut self, flip: bool) {
                self.placement.set_flipped(flip);
            }

            fn is_flipped(&self) -> bool {
                self.placement.is_flipped()
            }

            fn is_same(&self, other: &Shape) -> bool {
                matches!(other, Shape::$shape(other) if self == other)
            }
        }
    )*};
}

placed!(Sphere, Cube, Rectangle, Disk, Cylinder);

impl From<Mesh> for Shape {
    fn from(s: Mesh) -> Self {
        std::sync::Arc::new(s).into()
    }
}

impl From<std::sync::Arc<Mesh>> for Shape {
    fn from(s: std::sync::Arc<Mesh>) -> Self {
        Shape::Mesh(s)
    }
}

impl From<VoxelFaces> for Shape {
    fn from(s: VoxelFaces) -> Self {
        Shape::VoxelFaces(std::sync::Arc::new(s))
    }
}

/// Returns the angle of (x, y) as a fraction of a turn, in [0, 1).
fn turn(x: f64, y: f64) -> f64 {
    let t = libm::atan2(y, x) / TAU;
    if t < 0.0 {
        (t + 1.0).min(1.0f64.next_down())
    } else {
        t
    }
}

/// Returns the point of the unit circle at a fraction of a turn.
fn circle(turn: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(turn * TAU);
    [cos, sin]
}

/// Returns the derivatives of a local point with respect to its distance from the z axis and its
/// angle around the axis. The angle is a fraction of a turn.
fn polar_tangents(local: DVec3) -> [DVec3; 2] {
    let around = DVec3::new(-local.y, local.x, 0.0) * TAU;
    [local.with_z(0.0).normalize_or_zero(), around]
}
