//! Flakes whose normals are distributed like the normals of an ellipsoid: SGGX (Heitz, Dupuy,
//! Crassin and Dachsbacher, "The SGGX microflake distribution", 2015).
//!
//! A positive definite matrix S = L Lᵀ describes the flakes at a position. Flakes seen along a unit
//! vector ω have the projected area σ(ω) = |Lᵀω| = √(ωᵀSω). The extinction of the medium is
//! proportional to this area. Normals have the density D(m) = 1/(π √|S| (mᵀS⁻¹m)²). Flakes reflect
//! light like mirrors: p = D(h)/(4 σ(ω)), where h is the normal halfway between both directions.
//!
//! L maps a sphere to the ellipsoid. A normal of the ellipsoid is L n/|L n|, where n is on the unit
//! sphere, and the visible area of the sphere along Lᵀω is proportional to the cosine. Normals
//! that light meets therefore follow from n with a cosine distribution about Lᵀω
//! (docs/theory.md#flakes).

use super::PhaseError;
use crate::sampling::Frame;
use crate::sampling::sphere::cosine_hemisphere_sample;
use crate::volume::VolumeTexture;
use eikonal::Shown;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Smallest pivot of a matrix, relative to its largest diagonal element. Single precision can
/// express smaller ones only for flakes that are aligned with the axes.
const MIN_PIVOT: f64 = 1e-6;
/// Limits of the largest diagonal element, within which densities neither overflow nor underflow.
const SIZES: [f64; 2] = [1e-30, 1e30];

/// SGGX phase function of mirror-like flakes.
#[derive(Clone, Debug)]
pub struct Sggx(Flakes);

/// Distribution of the normals of flakes.
#[derive(Clone, Debug)]
enum Flakes {
    /// Equal flakes at all positions.
    Uniform(Ellipsoid),
    /// Grids of (Sxx, Syy, Szz) and of (Sxy, Sxz, Syz).
    Varying(Arc<[VolumeTexture; 2]>),
}

/// Ellipsoid with the normals of flakes: the factor L of S = L Lᵀ.
#[derive(Clone, Copy, Debug)]
struct Ellipsoid {
    /// Lower triangular matrix L.
    root: DMat3,
    /// Determinant of L.
    determinant: f64,
}

impl Ellipsoid {
    /// Computes the factor of a matrix with the elements xx, yy, zz and xy, xz, yz by Cholesky's
    /// method. Returns `None` if the matrix is not positive definite.
    fn new([xx, yy, zz]: [f64; 3], [xy, xz, yz]: [f64; 3]) -> Option<Self> {
        let size = xx.max(yy).max(zz);
        let root = |pivot: f64| (pivot > MIN_PIVOT * size).then(|| pivot.sqrt());
        let a = root(xx)?;
        let (b, c) = (xy / a, xz / a);
        let d = root(yy - b * b)?;
        let e = (yz - b * c) / d;
        let f = root(zz - c * c - e * e)?;
        let columns = [
            DVec3::new(a, b, c),
            DVec3::new(0.0, d, e),
            DVec3::new(0.0, 0.0, f),
        ];
        (SIZES[0]..=SIZES[1]).contains(&size).then(|| Ellipsoid {
            root: DMat3::from_cols(columns[0], columns[1], columns[2]),
            determinant: a * d * f,
        })
    }

    /// Returns Lᵀω, as long as the projected area along the unit vector ω.
    fn seen_from(&self, direction: DVec3) -> DVec3 {
        self.root.transpose() * direction
    }

    /// Returns L⁻¹v.
    fn unscaled(&self, v: DVec3) -> DVec3 {
        let [a, b, c] = self.root.to_cols_array_2d();
        let x = v.x / a[0];
        let y = (v.y - a[1] * x) / b[1];
        DVec3::new(x, y, (v.z - a[2] * x - b[2] * y) / c[2])
    }

    /// Returns the density of scattering from one unit propagation direction into another.
    fn pdf(&self, [from, to]: [DVec3; 2]) -> f64 {
        let normal = to - from;
        let ratio = normal.length_squared() / self.unscaled(normal).length_squared();
        // Light that is not deflected meets flakes only at grazing angles, with any normal.
        let ratio = if ratio.is_nan() { 0.0 } else { ratio };
        ratio * ratio / (4.0 * PI * self.determinant * self.seen_from(from).length())
    }

    /// Samples the propagation direction after scattering.
    fn sample(&self, from: DVec3, u: [f64; 2]) -> DVec3 {
        let axis = self.seen_from(-from).normalize();
        let on_sphere = Frame::from_normal(axis).to_world(cosine_hemisphere_sample(u));
        let normal = (self.root * on_sphere).normalize();
        // Planted error "flakes that transmit light like windows", found by morgana-transport/transport::phase::samplers_of_flakes_follow_their_densities:
        // from
        (from - 2.0 * from.dot(normal) * normal).normalize()
    }
}

impl Sggx {
    /// Creates flakes with equal normals everywhere, from the elements xx, yy, zz, xy, xz, yz of
    /// the matrix S.
    ///
    /// # Errors
    /// Fails if the matrix is not positive definite.
    pub fn new(matrix: [f64; 6]) -> Result<Self, PhaseError> {
        let [xx, yy, zz, xy, xz, yz] = matrix;
        match Ellipsoid::new([xx, yy, zz], [xy, xz, yz]) {
            Some(ellipsoid) => Ok(Sggx(Flakes::Uniform(ellipsoid))),
            None => Err(not_definite(matrix)),
        }
    }

    /// Creates flakes whose normals vary in space, from (Sxx, Syy, Szz) and (Sxy, Sxz, Syz): two
    /// quantities with three channels.
    ///
    /// # Errors
    /// Fails if the matrix of a sample is not positive definite.
    pub fn varying(diagonal: VolumeTexture, others: VolumeTexture) -> Result<Self, PhaseError> {
        let at = |x| [diagonal.at(x).0, others.at(x).0];
        let positions: Vec<DVec3> = match (&diagonal, &others) {
            (VolumeTexture::Uniform(_), VolumeTexture::Uniform(_)) => {
                let [[xx, yy, zz, _], [xy, xz, yz, _]] = at(DVec3::ZERO);
                return Sggx::new([xx, yy, zz, xy, xz, yz]);
            }
            (VolumeTexture::Grid(grid), _) | (_, VolumeTexture::Grid(grid)) => {
                grid.sample_positions().collect()
            }
        };
        // Mixtures of positive definite matrices are positive definite.
        for x in positions {
            let [[xx, yy, zz, _], [xy, xz, yz, _]] = at(x);
            if Ellipsoid::new([xx, yy, zz], [xy, xz, yz]).is_none() {
                return Err(not_definite([xx, yy, zz, xy, xz, yz]));
            }
        }
        Ok(Sggx(Flakes::Varying(Arc::new([diagonal, others]))))
    }

    /// Returns the area of flakes at `x` that light along the unit vector `direction` meets, per
    /// unit area of flakes: a factor of the extinction.
    pub fn projected_area(&self, x: DVec3, direction: DVec3) -> f64 {
        // Planted error "flakes of equal area from all sides", found by morgana-transport/transport::flakes::clear_slabs_absorb_by_the_projected_area:
        // return 1.0;
        self.at(x).seen_from(direction).length()
    }

    /// Returns true if flakes are equal at all positions.
    pub fn is_uniform(&self) -> bool {
        matches!(self.0, Flakes::Uniform(_))
    }

    /// Returns the longest piece of a line over which the projected area is integrated: half a
    /// voxel.
    pub(crate) fn spacing(&self) -> f64 {
        let Flakes::Varying(parts) = &self.0 else {
            return f64::INFINITY;
        };
        let of = |part: &VolumeTexture| match part {
            VolumeTexture::Uniform(_) => f64::INFINITY,
            VolumeTexture::Grid(grid) => 0.5 * grid.voxel(),
        };
        of(&parts[0]).min(of(&parts[1]))
    }

    /// Returns the density per steradian at `x` of scattering from one unit propagation direction
    /// into another.
    pub fn pdf(&self, x: DVec3, directions: [DVec3; 2]) -> f64 {
        self.at(x).pdf(directions)
    }

    /// Samples the direction after scattering at `x` of the unit propagation direction `from`.
    /// Returns it with its density.
    pub(super) fn sample(&self, x: DVec3, from: DVec3, u: [f64; 2]) -> (DVec3, f64) {
        let flakes = self.at(x);
        let to = flakes.sample(from, u);
        (to, flakes.pdf([from, to]))
    }

    /// Returns the memory of grids in bytes.
    pub(super) fn memory(&self) -> usize {
        match &self.0 {
            Flakes::Uniform(_) => 0,
            Flakes::Varying(parts) => parts.iter().map(VolumeTexture::memory).sum(),
        }
    }

    fn at(&self, x: DVec3) -> Ellipsoid {
        match &self.0 {
            Flakes::Uniform(ellipsoid) => *ellipsoid,
            Flakes::Varying(parts) => {
                let [[xx, yy, zz, _], [xy, xz, yz, _]] = [parts[0].at(x).0, parts[1].at(x).0];
                let found = Ellipsoid::new([xx, yy, zz], [xy, xz, yz]);
                // Interpolation keeps matrices positive definite, except for its rounding errors.
                found.unwrap_or_else(|| Ellipsoid::sphere(xx.max(yy).max(zz)))
            }
        }
    }
}

impl Ellipsoid {
    /// Returns the ellipsoid of flakes with all normals, S = `size`·1.
    fn sphere(size: f64) -> Self {
        let root = size.max(SIZES[0]).sqrt();
        Ellipsoid {
            root: DMat3::from_diagonal(DVec3::splat(root)),
            determinant: root.powi(3),
        }
    }
}

/// Returns the error about a matrix that is not positive definite.
fn not_definite(matrix: [f64; 6]) -> PhaseError {
    PhaseError::NotDefinite(matrix.map(|v| Shown(v).to_string()).join(", "))
}
