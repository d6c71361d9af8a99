//! Stokes vectors, and Mueller matrices of events that are symmetric about a plane.
//!
//! Theory: docs/theory.md#stokes-vectors.

use glam::{DMat4, DVec4};
use num_complex::Complex64;

/// Number of Stokes parameters: S0 to S3.
pub const STOKES_PARAMETERS: usize = 4;

/// Mueller matrix of scattering or of an interface, relative to its effect on unpolarised light:
///
/// ```text
/// a1  b1  0   0
/// b1  a2  0   0
/// 0   0   a3  b2
/// 0   0  -b2  a4
/// ```
///
/// The first axis x of the frames of both Stokes vectors is perpendicular to the plane of symmetry:
/// the plane of incidence or of scattering. The second axis is y = k × x, where k is the direction
/// of the light before or after the event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneMueller {
    /// Factor from S0 to S0, which scalar renders use too. It is 1, except for panes, whose faces
    /// reflect each polarisation differently.
    pub a1: f64,
    /// Diattenuation: transmission along x minus transmission along y, over their sum.
    pub b1: f64,
    /// Factor from Q to Q.
    pub a2: f64,
    /// Factor from U to U.
    pub a3: f64,
    /// Factor from V to V.
    pub a4: f64,
    /// Factor from V to U.
    pub b2: f64,
}

impl PlaneMueller {
    /// Matrix that removes all polarisation.
    pub const DEPOLARIZER: Self = PlaneMueller {
        a1: 1.0,
        b1: 0.0,
        a2: 0.0,
        a3: 0.0,
        a4: 0.0,
        b2: 0.0,
    };

    /// Matrix that leaves polarisation unchanged.
    pub const IDENTITY: Self = PlaneMueller {
        a1: 1.0,
        b1: 0.0,
        a2: 1.0,
        a3: 1.0,
        a4: 1.0,
        b2: 0.0,
    };

    /// Creates the matrix from complex amplitudes along x and y, for fields that vary as e^(−iωt).
    /// Amplitudes of zero give a depolariser.
    pub fn of_amplitudes(x: Complex64, y: Complex64) -> Self {
        let (xx, yy) = (x.norm_sqr(), y.norm_sqr());
        let sum = xx + yy;
        if sum <= 0.0 {
            return PlaneMueller::DEPOLARIZER;
        }
        // (U + iV) = 2 Ex Ey* becomes x y* (U + iV).
        let xy = x * y.conj() * (2.0 / sum);
        PlaneMueller {
            a1: 1.0,
            b1: (xx - yy) / sum,
            a2: 1.0,
            a3: xy.re,
            a4: xy.re,
            b2: -xy.im,
        }
    }

    /// Creates the matrix from real amplitudes along x and y.
    pub fn of_real_amplitudes(x: f64, y: f64) -> Self {
        PlaneMueller::of_amplitudes(x.into(), y.into())
    }

    /// Returns (1 − `weight`) times this matrix plus `weight` times `other`.
    pub(crate) fn mixed(&self, other: &Self, weight: f64) -> Self {
        let mix = |a: f64, b: f64| a + weight * (b - a);
        PlaneMueller {
            a1: mix(self.a1, other.a1),
            b1: mix(self.b1, other.b1),
            a2: mix(self.a2, other.a2),
            a3: mix(self.a3, other.a3),
            a4: mix(self.a4, other.a4),
            b2: mix(self.b2, other.b2),
        }
    }

    /// Returns the product `before` · `self`: the effect on light that meets this event first and
    /// `before` afterwards.
    pub fn then(&self, before: DMat4) -> DMat4 {
        let [i, q, u, v] = columns(before);
        DMat4::from_cols(
            i * self.a1 + q * self.b1,
            i * self.b1 + q * self.a2,
            u * self.a3 - v * self.b2,
            u * self.b2 + v * self.a4,
        )
    }

    /// Applies the matrix to a Stokes vector.
    pub fn of(&self, s: DVec4) -> DVec4 {
        DVec4::new(
            self.a1 * s.x + self.b1 * s.y,
            self.b1 * s.x + self.a2 * s.y,
            self.a3 * s.z + self.b2 * s.w,
            self.a4 * s.w - self.b2 * s.z,
        )
    }
}

/// Rotation of a frame about the direction of light. Stores the cosine and sine of twice the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    cos: f64,
    sin: f64,
}

impl Rotation {
    /// Creates the rotation to the frame whose first axis has components `x` and `y` in the old
    /// frame. The axis may have any length.
    pub fn to_axis(x: f64, y: f64) -> Self {
        let square = x * x + y * y;
        if square > 0.0 {
            Rotation {
                cos: (x - y) * (x + y) / square,
                sin: 2.0 * x * y / square,
            }
        } else {
            Rotation { cos: 1.0, sin: 0.0 }
        }
    }

    /// Returns the product `before` · `self`.
    pub fn then(self, before: DMat4) -> DMat4 {
        let [i, q, u, v] = columns(before);
        DMat4::from_cols(
            i,
            q * self.cos - u * self.sin,
            q * self.sin + u * self.cos,
            v,
        )
    }

    /// Returns the Stokes vector in the new frame.
    pub fn of(self, s: DVec4) -> DVec4 {
        DVec4::new(
            s.x,
            s.y * self.cos + s.z * self.sin,
            s.z * self.cos - s.y * self.sin,
            s.w,
        )
    }
}

fn columns(m: DMat4) -> [DVec4; 4] {
    [m.x_axis, m.y_axis, m.z_axis, m.w_axis]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_1_SQRT_2;

    const LINEAR_45: DVec4 = DVec4::new(1.0, 0.0, 1.0, 0.0);

    #[test]
    fn a_frame_along_light_at_45_degrees_sees_it_along_its_first_axis() {
        let turned = Rotation::to_axis(FRAC_1_SQRT_2, FRAC_1_SQRT_2).of(LINEAR_45);
        assert!((turned - DVec4::new(1.0, 1.0, 0.0, 0.0)).length() < 1e-15);
    }

    /// Light at 45° with y delayed by a quarter of a period turns from x to y. It is left-handed
    /// for an observer who faces the source: V < 0.
    #[test]
    fn a_retarded_second_axis_makes_light_left_handed() {
        let quarter = PlaneMueller::of_amplitudes(Complex64::ONE, Complex64::I);
        let turned = quarter.of(LINEAR_45);
        assert!((turned - DVec4::new(1.0, 0.0, 0.0, -1.0)).length() < 1e-15);
    }

    #[test]
    fn products_of_matrices_are_those_of_their_effects() {
        let (x, y) = (Complex64::new(0.3, -0.2), Complex64::new(-0.7, 0.4));
        let event = PlaneMueller::of_amplitudes(x, y);
        let rotation = Rotation::to_axis(0.6, -1.7);
        let first = event.then(rotation.then(event.then(DMat4::IDENTITY)));
        let stokes = DVec4::new(1.0, 0.2, -0.5, 0.7);
        let effects = event.of(rotation.of(event.of(stokes)));
        assert!((first * stokes - effects).length() < 1e-15);
    }
}
