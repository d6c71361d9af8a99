//! Point that radiates in all directions from a face between media.

use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, EndSample};
use crate::sampling::sphere::{uniform_sphere_pdf, uniform_sphere_sample};
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::PI;

/// Largest cosine between normals that count as orthogonal.
const MAX_ORTHOGONAL_COSINE: f64 = 1e-9;

/// Point on a face, or at the intersection of up to three faces. In each direction, its light
/// starts in the medium on that side.
///
/// It consists of several points, just off the faces on all sides of them. Each point radiates into
/// the directions of its own side. A connection ends at one of them, chosen at random.
#[derive(Clone, Debug, PartialEq)]
pub struct PointOnFace {
    position: DVec3,
    intensity: Spectrum,
    /// Unit normals of the faces, linearly independent.
    normals: SmallVec<[DVec3; 3]>,
    /// Displacements of the points from `position`, one for each combination of sides. Bit k of the
    /// index is set on the side to which normal k points.
    offsets: SmallVec<[DVec3; 8]>,
    /// True if the normals are orthogonal, so that all sides have the same solid angle.
    orthogonal: bool,
}

impl PointOnFace {
    /// Creates a point of the given radiant intensity. `offsets` holds, for each side of the faces
    /// with the given `normals`, the displacement of the point there; the index is the result of
    /// `side`.
    pub fn new(
        position: DVec3,
        intensity: Spectrum,
        normals: SmallVec<[DVec3; 3]>,
        offsets: SmallVec<[DVec3; 8]>,
    ) -> Self {
        let pairs = (0..normals.len()).flat_map(|k| (0..k).map(move |l| (k, l)));
        let orthogonal = pairs.map(|(k, l)| normals[k].dot(normals[l]).abs());
        PointOnFace {
            position,
            intensity,
            orthogonal: orthogonal.fold(0.0, f64::max) < MAX_ORTHOGONAL_COSINE,
            normals,
            offsets,
        }
    }

    /// Returns the position on the faces.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the radiant intensity.
    pub fn intensity(&self) -> Spectrum {
        self.intensity
    }

    /// Returns the total power.
    pub(super) fn power(&self) -> Spectrum {
        self.intensity * (4.0 * PI)
    }

    /// Chooses one of the points by a number uniform in [0, 1).
    pub(super) fn sample_end(&self, u: f64) -> EndSample {
        let count = self.offsets.len();
        let side = ((u * count as f64) as usize).min(count - 1);
        EndSample {
            end: ConnectionEnd::at(self.position + self.offsets[side]),
            pdf: 1.0 / count as f64,
            delta: true,
        }
    }

    /// Returns the number of the side on which a start lies.
    fn side_of(&self, start: DVec3) -> usize {
        side(&self.normals, start - self.position)
    }

    /// Returns the radiant intensity in a direction from the point at `start`; zero for directions
    /// of other sides.
    pub(super) fn emitted(&self, start: DVec3, direction: DVec3) -> Spectrum {
        if self.side_of(start) == side(&self.normals, direction) {
            self.intensity
        } else {
            Spectrum::ZERO
        }
    }

    /// Samples a unit direction from the point at `start`. If the normals are orthogonal, it always
    /// belongs to the side of the point.
    pub(super) fn sample(&self, start: DVec3, u: [f64; 2]) -> DVec3 {
        let mut direction = uniform_sphere_sample(u);
        if self.orthogonal {
            let wanted = self.side_of(start);
            for (k, normal) in self.normals.iter().enumerate() {
                let along = normal.dot(direction);
                if (along > 0.0) != (wanted >> k & 1 == 1) {
                    direction -= *normal * (2.0 * along);
                }
            }
        }
        direction
    }

    /// Returns the density of [`PointOnFace::sample`] per steradian, for directions of the side of
    /// `start`.
    pub(super) fn pdf(&self, start: DVec3, direction: DVec3) -> f64 {
        if !self.orthogonal {
            uniform_sphere_pdf()
        } else if self.side_of(start) == side(&self.normals, direction) {
            uniform_sphere_pdf() * self.offsets.len() as f64
        } else {
            0.0
        }
    }
}

/// Returns the number of the side of all faces to which a vector points. Bit k is set if the vector
/// points along normal k.
fn side(normals: &[DVec3], vector: DVec3) -> usize {
    let bit = |(k, n): (usize, &DVec3)| usize::from(n.dot(vector) > 0.0) << k;
    normals.iter().enumerate().map(bit).sum()
}
