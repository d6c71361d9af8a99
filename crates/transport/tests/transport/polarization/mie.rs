//! Mie scattering, compared with electric fields traced from the sun.

use crate::polarization::slab::{Field, Scatterer, assert_fields_agree};
use glam::DVec3;
use morgana_transport::phase::{Phase, Spheres};
use num_complex::Complex64;

/// Spheres of one size parameter and relative index. Their partial waves up to the third are the
/// Mie coefficients aₙ and bₙ by miepython 3.3.0 (conjugated, because its fields vary as e^(iωt)).
/// The fourth is below 2e-5 of the first.
struct Sphere {
    waves: [[Complex64; 2]; 3],
    /// Maximum of |S|².
    most: f64,
}

const X: f64 = 0.9;
const M: [f64; 2] = [1.7, 0.3];

impl Sphere {
    fn new() -> Self {
        let c = Complex64::new;
        let waves = [
            [
                c(1.041_556_80e-1, 1.644_903_49e-1),
                c(1.730_810_20e-2, 2.254_294_57e-2),
            ],
            [
                c(2.684_551_10e-3, 8.326_824_73e-3),
                c(3.276_614_04e-4, 5.230_017_82e-4),
            ],
            [
                c(5.118_352_54e-5, 1.771_622_88e-4),
                c(4.009_760_98e-6, 6.703_257_17e-6),
            ],
        ];
        let mut sphere = Sphere { waves, most: 1.0 };
        let angles = (0..=1000).map(|i| sphere.amplitudes(f64::from(i) / 500.0 - 1.0));
        let squares = angles.map(|[a, b]| a.norm_sqr().max(b.norm_sqr()));
        sphere.most = squares.fold(0.0, f64::max);
        sphere
    }

    /// Returns S₁ and S₂, with the angular functions written out.
    fn amplitudes(&self, c: f64) -> [Complex64; 2] {
        let s2 = 1.0 - c * c;
        let pi = [1.0, 3.0 * c, 1.5 * (5.0 * c * c - 1.0)];
        let tau = [c, 3.0 * (c * c - s2), c * pi[2] - 15.0 * c * s2];
        let mut sums = [Complex64::ZERO; 2];
        for (k, [a, b]) in self.waves.iter().enumerate() {
            let n = (k + 1) as f64;
            let weight = (2.0 * n + 1.0) / (n * (n + 1.0));
            sums[0] += weight * (a * pi[k] + b * tau[k]);
            sums[1] += weight * (a * tau[k] + b * pi[k]);
        }
        sums
    }
}

impl Scatterer for Sphere {
    fn scattered(&self, field: Field, from: DVec3, to: DVec3) -> Field {
        let across = from.cross(to);
        let across = across
            .try_normalize()
            .unwrap_or_else(|| from.any_orthonormal_vector());
        let [s1, s2] = self.amplitudes(from.dot(to));
        let scale = self.most.sqrt().recip();
        let x = field.dot(across) * s1 * scale;
        let y = field.dot(from.cross(across)) * s2 * scale;
        let y_axis = to.cross(across);
        Field {
            re: across * x.re + y_axis * y.re,
            im: across * x.im + y_axis * y.im,
        }
    }

    fn mean(&self) -> f64 {
        // Mean of ½(|S₁|² + |S₂|²): x² Q/4.
        let sum = self
            .waves
            .iter()
            .zip(1..)
            .map(|([a, b], n)| f64::from(2 * n + 1) * (a.norm_sqr() + b.norm_sqr()));
        0.5 * sum.sum::<f64>() / self.most
    }
}

/// Tests all four Stokes parameters of a slab in which spheres scatter light a few times.
#[test]
fn slabs_of_spheres_agree_with_electric_fields() {
    let spheres = Spheres {
        radius: X,
        geometric_deviation: 1.0,
        n: M[0],
        k: M[1],
        exterior: 1.0,
        wavelength: std::f64::consts::TAU,
    };
    let phase = Phase::mie(&spheres).unwrap();
    assert_fields_agree(&phase, &Sphere::new(), 200_000, 0.006);
}
