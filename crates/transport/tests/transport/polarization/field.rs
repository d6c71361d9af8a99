//! Partially polarised light as correlations of its electric field in world coordinates.

use glam::{DMat3, DVec3};
use morgana_transport::emitter::Emitter;
use num_complex::Complex64;

/// E[Eᵢ Eⱼ*], as real and imaginary part, of fields that vary as e^(−iωt).
#[derive(Clone, Copy)]
pub struct Coherency {
    re: DMat3,
    im: DMat3,
}

impl Coherency {
    /// Unpolarised light of unit intensity in a direction.
    pub fn unpolarized(k: DVec3) -> Self {
        Coherency {
            re: (DMat3::IDENTITY - outer(k, k)) * 0.5,
            im: DMat3::ZERO,
        }
    }

    /// Linearly polarised light of unit intensity along an axis.
    pub fn linear(axis: DVec3) -> Self {
        Coherency {
            re: outer(axis, axis),
            im: DMat3::ZERO,
        }
    }

    /// Returns the light behind an element that multiplies the field along the second of two axes
    /// across the light by an amplitude.
    pub fn retarded(self, [fast, slow]: [DVec3; 2], amplitude: Complex64) -> Self {
        let along = outer(slow, slow);
        self.mapped(
            outer(fast, fast) + along * amplitude.re,
            along * amplitude.im,
        )
    }

    /// Returns the light after a linear map of fields.
    fn mapped(self, re: DMat3, im: DMat3) -> Self {
        // (A + iB)(R + iJ)(Aᵀ − iBᵀ).
        let left = [re * self.re - im * self.im, re * self.im + im * self.re];
        let (at, bt) = (re.transpose(), im.transpose());
        Coherency {
            re: left[0] * at + left[1] * bt,
            im: left[1] * at - left[0] * bt,
        }
    }

    /// Returns the light after an event at an interface of the given normal, with amplitudes
    /// perpendicular to the plane of incidence and in it.
    pub fn met(self, [k, out]: [DVec3; 2], normal: DVec3, [s, p]: [Complex64; 2]) -> Self {
        let across = k.cross(normal).normalize();
        let [before, after] = [
            outer(across, across),
            outer(out.cross(across), k.cross(across)),
        ];
        self.mapped(before * s.re + after * p.re, before * s.im + after * p.im)
    }

    /// Returns the light that a dipole scatters into a direction.
    pub fn scattered(self, out: DVec3) -> Self {
        self.mapped(DMat3::IDENTITY - outer(out, out), DMat3::ZERO)
    }

    /// Returns the Stokes vector of light in the direction `k`, in the frame of an axis.
    pub fn stokes(&self, k: DVec3, x: DVec3) -> [f64; 4] {
        let y = k.cross(x);
        let re = |a: DVec3, b: DVec3| a.dot(self.re * b);
        let (xx, yy) = (re(x, x), re(y, y));
        [xx + yy, xx - yy, 2.0 * re(x, y), 2.0 * x.dot(self.im * y)]
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Returns the amplitudes of reflection for an index relative to the medium in front.
pub fn reflection(cos: f64, index: Complex64) -> [Complex64; 2] {
    let square = index * index;
    let far = (square - (1.0 - cos * cos)).sqrt();
    let c = Complex64::from(cos);
    [
        (c - far) / (c + far),
        (square * c - far) / (square * c + far),
    ]
}

/// Returns the amplitudes of refraction, in an arbitrary unit.
pub fn refraction(cos: f64, index: f64) -> [Complex64; 2] {
    let far = (1.0 - (1.0 - cos * cos) / index.powi(2)).sqrt();
    let across = 2.0 * cos / (cos + index * far);
    let within = 2.0 * cos / (index * cos + far);
    [across.into(), within.into()]
}

/// Creates an emitter of light from infinity that travels in a direction.
pub fn sun(direction: DVec3) -> Emitter {
    Emitter::Directional {
        direction: direction.normalize(),
        irradiance: std::f64::consts::PI.into(),
    }
}
