//! Spheres and ellipsoids.

use super::curve::{Curve, Surface, Track};
use super::line::Line;
use super::placement::Placement;
use super::{
    AreaDensity, AreaSample, Hit, Intersection, ShapeError, Tessellation, Uv, circle,
    polar_tangents, turn,
};
use eikonal::Aabb;
use eikonal::bounds::symmetric_eigenvalues;
use eikonal::ray::Arc;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::PI;

const LOCAL: Aabb = Aabb {
    min: DVec3::NEG_ONE,
    max: DVec3::ONE,
};

/// Unit sphere under an affine map; uv = (φ/2π, ϑ/π), ϑ from the local +z axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    pub(super) placement: Placement,
    area: f64,
}

/// Number of rows of triangles from pole to pole.
const ROWS: usize = 32;

/// Squared distance from the centre below which a local point is certainly not on the surface,
/// whatever the rounding.
const INNER_SQUARED_RADIUS: f64 = 1.0 - 1e-6;

impl Sphere {
    /// Returns twice the largest singular value of the linear part: the longest axis of the
    /// ellipsoid.
    pub fn diameter(&self) -> f64 {
        let column = |axis| self.placement.point(axis) - self.placement.point(DVec3::ZERO);
        let m = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
        2.0 * symmetric_eigenvalues(m * m.transpose())[2].max(0.0).sqrt()
    }

    pub(super) fn misses(&self, region: &Aabb) -> bool {
        self.placement
            .local_box(region)
            .nearest_distance(DVec3::ZERO)
            > 1.0
    }

    /// Creates the image of the unit sphere.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3) -> Result<Self, ShapeError> {
        let placement = Placement::new(to_world, &LOCAL)?;
        let unit = Sphere {
            placement,
            area: 4.0 * PI,
        };
        let area = if unit.is_even() {
            unit.area * unit.placement.axis_stretch(0)
        } else {
            area(&unit.placement)
        };
        Ok(Sphere { area, ..unit })
    }

    /// Creates the sphere around `center`.
    ///
    /// # Errors
    /// Fails like [`Sphere::frame`], or if the centre is not finite. Fails if the map of the sphere
    /// cannot be inverted, because it is too small or too far away.
    pub fn around(center: DVec3, radius: f64) -> Result<Self, ShapeError> {
        Sphere::new(Sphere::frame(center, radius)?)
    }

    /// Returns the map from the unit sphere to the sphere around `center`.
    ///
    /// # Errors
    /// Fails if the radius is not positive and finite.
    pub fn frame(center: DVec3, radius: f64) -> Result<DAffine3, ShapeError> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(ShapeError::Radius { radius });
        }
        let scale = DMat3::from_diagonal(DVec3::splat(radius));
        Ok(DAffine3::from_mat3_translation(scale, center))
    }

    pub(super) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        let within = |p: DVec3| p.length_squared() < INNER_SQUARED_RADIUS;
        if arc.is_straight() {
            cross(&Line::new(arc, theta, &self.placement))
        } else {
            let curve = Curve::leaving(arc, theta, &self.placement, &LOCAL, within);
            cross(&curve?)
        }
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        let local = at.local.normalize();
        Hit {
            theta: at.theta,
            position: self.placement.point(local),
            normal: self.placement.normal(local),
            uv: Uv::Sphere(local),
            primitive: 0,
        }
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.placement.aabb(|d| d.length())
    }

    pub(super) fn contains(&self, p: DVec3) -> bool {
        self.placement.local(p).length_squared() < 1.0
    }

    pub(super) fn volume(&self) -> f64 {
        4.0 / 3.0 * PI * self.placement.determinant()
    }

    /// Returns the corners of a parallelepiped around the sphere.
    pub(super) fn hull(&self) -> Vec<DVec3> {
        LOCAL.corners().map(|p| self.placement.point(p)).to_vec()
    }

    pub(super) fn area(&self) -> f64 {
        self.area
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let z = 1.0 - 2.0 * u[0];
        let [x, y] = circle(u[1]);
        let r = (1.0 - z * z).max(0.0).sqrt();
        let local = DVec3::new(r * x, r * y, z);
        AreaSample {
            position: self.placement.point(local),
            normal: self.placement.normal(local),
            uv: Uv::Sphere(local),
            primitive: 0,
            pdf: self.pdf(local),
        }
    }

    pub(super) fn pdf_area(&self, position: DVec3) -> f64 {
        self.pdf(self.placement.local(position).normalize())
    }

    pub(super) fn inverse_area(&self, position: DVec3, _primitive: u32) -> [f64; 2] {
        let [x, y, z] = self.placement.local(position).normalize().to_array();
        [0.5 * (1.0 - z), turn(x, y)]
    }

    pub(super) fn area_density(&self, _primitive: u32) -> Option<AreaDensity> {
        self.is_even().then_some(AreaDensity::Polar)
    }

    pub(super) fn local_tangents(&self, local: DVec3, _primitive: u32) -> [DVec3; 2] {
        let [outward, around] = polar_tangents(local);
        let meridian = (outward * local.z).with_z(-local.truncate().length());
        [around, meridian * PI]
    }

    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        Sphere::new(self.placement.grown(distance, DVec3::ZERO))
    }

    pub(super) fn tessellate(&self, all: &mut Tessellation) {
        all.add_turned(ROWS, |j| {
            let (sin, cos) = (PI * j as f64 / ROWS as f64).sin_cos();
            // Planted error "poles of spheres as wide as their equators", found by morgana-transport/transport::shape::tessellation::corners_lie_on_the_surface:
            // [1.0, cos]
            [sin, cos]
        });
    }

    /// Returns true if area grows uniformly, as under a similarity. The growth factor is
    /// proportional to the length of the image of the normal. Six normals suffice to distinguish an
    /// ellipsoid from a sphere.
    pub fn is_even(&self) -> bool {
        let [x, y, z] = DVec3::AXES;
        let normals = [x, y, z, x + y, y + z, z + x];
        self.placement.is_even(&normals.map(DVec3::normalize))
    }

    /// Returns the density: uniform on the unit sphere, then divided by the growth of the area.
    fn pdf(&self, local: DVec3) -> f64 {
        1.0 / (4.0 * PI * self.placement.stretch(local))
    }

    /// Returns the shape operator of f = (|p|² − 1)/2 in local coordinates.
    pub(super) fn shape_operator(&self, position: DVec3) -> DMat3 {
        let local = self.placement.local(position);
        self.placement.shape_operator(local, DVec3::ONE)
    }
}

#[inline]
fn cross(track: &impl Track) -> Option<Intersection> {
    let u = track.first(Surface::Radial(3), 1.0, |_| true)?;
    Some(Intersection {
        theta: track.theta(u),
        local: track.position(u),
        primitive: 0,
    })
}

/// Computes ∫ |det M| |M⁻ᵀ n| dn over the unit sphere. It uses Simpson's rule in z and the
/// trapezoidal rule, which converges geometrically, in φ.
fn area(placement: &Placement) -> f64 {
    const RINGS: usize = 256;
    const POINTS: usize = 128;
    let ring = |z: f64| -> f64 {
        let r = (1.0 - z * z).max(0.0).sqrt();
        let stretch = |i: usize| {
            let [x, y] = circle(i as f64 / POINTS as f64);
            placement.stretch(DVec3::new(r * x, r * y, z))
        };
        (0..POINTS).map(stretch).sum::<f64>() * 2.0 * PI / POINTS as f64
    };
    let h = 2.0 / RINGS as f64;
    let weight = |i: usize| match i {
        0 | RINGS => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=RINGS)
        .map(|i| weight(i) * ring(i as f64 * h - 1.0))
        .sum::<f64>()
        * h
        / 3.0
}
