//! Cylinders, open or capped.

use super::curve::{Curve, Surface, Track};
use super::line::Line;
use super::placement::Placement;
use super::planar::Flat;
use super::{
    AreaDensity, AreaSample, Hit, Intersection, ShapeError, Tessellation, Uv, circle, disk,
    polar_tangents, turn,
};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::TAU;

const LOCAL: Aabb = Aabb {
    min: DVec3::new(-1.0, -1.0, 0.0),
    max: DVec3::ONE,
};

const CAPS: [Flat; 2] = [
    Flat {
        axis: 2,
        at: 0.0,
        side: -1.0,
        primitive: 1,
    },
    Flat {
        axis: 2,
        at: 1.0,
        side: 1.0,
        primitive: 2,
    },
];

/// Cylinder x² + y² = 1 from z = 0 to z = 1 under an affine map, with normals pointing away from
/// the axis. Part 0 is the side, with uv = (φ/2π, z). If the cylinder is capped, parts 1 and 2 are
/// the caps at z = 0 and z = 1, with uv = (r, φ/2π).
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    pub(super) placement: Placement,
    capped: bool,
    side_area: f64,
}

impl Cylinder {
    pub(super) fn misses(&self, region: &Aabb) -> bool {
        let local = self.placement.local_box(region);
        let axis = Aabb::new(DVec3::ZERO, DVec3::Z);
        let flat = |p: DVec3| p.with_z(0.0);
        let across = Aabb::new(flat(local.min), flat(local.max)).nearest_distance(DVec3::ZERO);
        across > 1.0 || local.max.z < axis.min.z || local.min.z > axis.max.z
    }

    /// Creates the image of the cylinder.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3, capped: bool) -> Result<Self, ShapeError> {
        let placement = Placement::new(to_world, &LOCAL)?;
        Ok(Cylinder {
            side_area: side_area(&placement),
            placement,
            capped,
        })
    }

    /// Creates the circular cylinder around the segment from `p0` to `p1`.
    ///
    /// # Errors
    /// Fails like [`Cylinder::frame`], and if the cylinder is so thin or so far away that its map
    /// cannot be inverted.
    pub fn between(p0: DVec3, p1: DVec3, radius: f64, capped: bool) -> Result<Self, ShapeError> {
        Cylinder::new(Cylinder::frame(p0, p1, radius)?, capped)
    }

    /// Returns the map from the canonical cylinder to the cylinder around the segment from `p0` to
    /// `p1`.
    ///
    /// # Errors
    /// Fails if the radius is not positive and finite, or if the ends coincide or are not finite.
    pub fn frame(p0: DVec3, p1: DVec3, radius: f64) -> Result<DAffine3, ShapeError> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(ShapeError::Radius { radius });
        }
        let axis = (p1 - p0).try_normalize().ok_or(ShapeError::CylinderEnds)?;
        let (x, y) = axis.any_orthonormal_pair();
        let linear = DMat3::from_cols(x * radius, y * radius, p1 - p0);
        Ok(DAffine3::from_mat3_translation(linear, p0))
    }

    /// Returns true if caps close the ends.
    pub(crate) fn is_capped(&self) -> bool {
        self.capped
    }

    pub(super) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        if arc.is_straight() {
            self.cross(&Line::new(arc, theta, &self.placement))
        } else {
            self.cross(&Curve::new(arc, theta, &self.placement, &LOCAL)?)
        }
    }

    fn cross(&self, track: &impl Track) -> Option<Intersection> {
        // Accept points slightly beyond the rim, so that no curve slips between side and cap.
        let slack = if self.capped {
            4.0 * self.placement.noise()
        } else {
            0.0
        };
        let wall = |p: DVec3| p.z >= -slack && p.z <= 1.0 + slack;
        let side = track.first(Surface::Radial(2), 1.0, wall);
        let mut best: Option<(f64, &Flat)> = None;
        if self.capped {
            let inside = |p: DVec3| p.truncate().length_squared() <= 1.0 + slack;
            for cap in &CAPS {
                let until = best.map_or(side.unwrap_or(1.0), |(u, _)| u);
                if let Some(u) = cap.first(track, until, inside) {
                    best = Some((u, cap));
                }
            }
        }
        if let Some((u, cap)) = best {
            return Some(cap.intersection(track, u));
        }
        let u = side?;
        Some(Intersection {
            theta: track.theta(u),
            local: track.position(u),
            primitive: 0,
        })
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        let (p, theta) = (at.local, at.theta);
        if at.primitive > 0 {
            let cap = &CAPS[at.primitive as usize - 1];
            let local = p.truncate().clamp_length_max(1.0).extend(cap.at);
            return cap.hit(&self.placement, theta, local, Uv::Disk(local));
        }
        let n = p.with_z(0.0).normalize();
        let local = n.with_z(p.z.clamp(0.0, 1.0));
        Hit {
            theta,
            position: self.placement.point(local),
            normal: self.placement.normal(n),
            uv: Uv::Cylinder(local),
            primitive: 0,
        }
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.placement
            .aabb(|d| d.truncate().length() + d.z.max(0.0))
    }

    pub(super) fn contains(&self, p: DVec3) -> bool {
        let p = self.placement.local(p);
        self.capped && p.z > 0.0 && p.z < 1.0 && p.truncate().length_squared() < 1.0
    }

    pub(super) fn volume(&self) -> f64 {
        std::f64::consts::PI * self.placement.determinant()
    }

    /// Returns the corners of a parallelepiped around the cylinder.
    pub(super) fn hull(&self) -> Vec<DVec3> {
        LOCAL.corners().map(|p| self.placement.point(p)).to_vec()
    }

    pub(super) fn area(&self) -> f64 {
        let caps = if self.capped {
            2.0 * self.cap_area()
        } else {
            0.0
        };
        self.side_area + caps
    }

    pub(super) fn part_areas(&self) -> Vec<f64> {
        let caps = if self.capped { 2 } else { 0 };
        let caps = std::iter::repeat_n(self.cap_area(), caps);
        [self.side_area].into_iter().chain(caps).collect()
    }

    fn cap_area(&self) -> f64 {
        0.5 * TAU * self.placement.axis_stretch(2)
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let v = u[0] * self.area();
        if v < self.side_area || !self.capped {
            let z = (v / self.side_area).min(1.0);
            return self.side_sample([u[1], z]);
        }
        let v = (v - self.side_area) / self.cap_area();
        let (cap, v) = if v < 1.0 {
            (&CAPS[0], v)
        } else {
            (&CAPS[1], v - 1.0)
        };
        let local = disk::point([v.min(1.0), u[1]]).extend(cap.at);
        cap.sample(&self.placement, local, Uv::Disk(local), self.area().recip())
    }

    fn side_sample(&self, uv: [f64; 2]) -> AreaSample {
        let [x, y] = circle(uv[0]);
        let n = DVec3::new(x, y, 0.0);
        AreaSample {
            position: self.placement.point(n.with_z(uv[1])),
            normal: self.placement.normal(n),
            uv: Uv::Plain(uv),
            primitive: 0,
            pdf: self.side_pdf(n),
        }
    }

    pub(super) fn pdf_area(&self, position: DVec3, primitive: u32) -> f64 {
        match primitive {
            0 => self.side_pdf(self.placement.local(position).with_z(0.0).normalize()),
            _ => self.area().recip(),
        }
    }

    pub(super) fn inverse_area(&self, position: DVec3, primitive: u32) -> [f64; 2] {
        let local = self.placement.local(position);
        if primitive == 0 {
            let share = self.side_area / self.area();
            return [share * local.z, turn(local.x, local.y)];
        }
        let [u, turn] = disk::inverse(local);
        let before = self.side_area + f64::from(primitive - 1) * self.cap_area();
        [(before + u * self.cap_area()) / self.area(), turn]
    }

    pub(super) fn area_density(&self, primitive: u32) -> Option<AreaDensity> {
        match primitive {
            0 => self.is_even().then_some(AreaDensity::Even),
            _ => Some(AreaDensity::Radial),
        }
    }

    pub(super) fn local_tangents(&self, local: DVec3, primitive: u32) -> [DVec3; 2] {
        let [outward, around] = polar_tangents(local);
        match primitive {
            0 => [around, DVec3::Z],
            _ => [outward, around],
        }
    }

    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        let map = self.placement.grown(distance, DVec3::new(0.0, 0.0, 0.5));
        Cylinder::new(map, self.capped)
    }

    pub(super) fn tessellate(&self, all: &mut Tessellation) {
        all.add_turned(1, |j| [1.0, j as f64]);
        if self.capped {
            all.add_disk(0.0);
            all.add_disk(1.0);
        }
    }

    /// Returns true if area grows uniformly around the side, as on a circular cylinder.
    pub(super) fn is_even(&self) -> bool {
        let [x, y, _] = DVec3::AXES;
        self.placement.is_even(&[x, y, (x + y).normalize()])
    }

    /// Returns the density on the side, which is chosen in proportion to its area. φ and z are
    /// uniform.
    fn side_pdf(&self, n: DVec3) -> f64 {
        self.side_area / self.area() / (TAU * self.placement.stretch(n))
    }

    /// Returns the shape operator. On the side, it uses f = (x² + y² − 1)/2 in local coordinates.
    pub(super) fn shape_operator(&self, position: DVec3, primitive: u32) -> DMat3 {
        if primitive != 0 {
            return DMat3::ZERO;
        }
        let n = self.placement.local(position).with_z(0.0);
        self.placement.shape_operator(n, DVec3::new(1.0, 1.0, 0.0))
    }
}

/// Computes ∫ |det M| |M⁻ᵀ n| dφ by the trapezoidal rule, which converges geometrically.
fn side_area(placement: &Placement) -> f64 {
    const POINTS: usize = 1024;
    let stretch = |i: usize| {
        let [x, y] = circle(i as f64 / POINTS as f64);
        placement.stretch(DVec3::new(x, y, 0.0))
    };
    (0..POINTS).map(stretch).sum::<f64>() * TAU / POINTS as f64
}
