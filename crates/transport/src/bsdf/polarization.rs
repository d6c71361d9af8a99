//! What smooth surfaces do to the polarisation of light: Fresnel's equations for either polarisation.
//!
//! Theory: docs/theory.md#polarising-interfaces.

use super::{Bsdf, Surface, fresnel};
use crate::mueller::PlaneMueller;
use glam::DVec3;
use num_complex::Complex64;

impl Bsdf {
    /// Whether the matrices of its smooth reflections differ among channels.
    pub(crate) fn polarizes_by_channel(&self) -> bool {
        match self {
            Bsdf::Conductor(_) => true,
            Bsdf::Mask(b) => b.nested().polarizes_by_channel(),
            Bsdf::NormalMap(b) => b.nested().polarizes_by_channel(),
            Bsdf::TwoSided(b) => b.sides().iter().any(Bsdf::polarizes_by_channel),
            _ => false,
        }
    }

    /// Whether it lets light pass as a thin pane, which polarises it by a matrix that connections do not know.
    pub(crate) fn is_pane(&self) -> bool {
        match self {
            Bsdf::ThinDielectric(_) => true,
            Bsdf::Mask(b) => b.nested().is_pane(),
            Bsdf::NormalMap(b) => b.nested().is_pane(),
            _ => false,
        }
    }

    /// What the smooth event does to polarisation by which a path that arrives in the unit direction `from` goes on in the unit direction
    /// `to`. Mixtures and coats depolarise.
    pub(crate) fn mueller(
        &self,
        s: &Surface,
        from: DVec3,
        to: DVec3,
        channel: usize,
    ) -> PlaneMueller {
        match self {
            Bsdf::Dielectric(_) => {
                let side = s.facing(-from);
                let cos = side.normal.dot(-from).min(1.0);
                let transmitted = side.normal.dot(to) < 0.0;
                dielectric(cos, [side.n_near, side.n_far], transmitted)
            }
            Bsdf::Conductor(metal) => {
                // Of the facet that reflects so, whichever normal that has.
                let cos = (0.5 * (1.0 - from.dot(to))).max(0.0).sqrt();
                conductor(cos, metal.relative_index(s, channel))
            }
            Bsdf::Mask(b) => b.nested().mueller(s, from, to, channel),
            Bsdf::NormalMap(b) => b.nested().mueller(s, from, to, channel),
            Bsdf::TwoSided(b) => {
                let (side, seen) = b.seen(s, -from);
                side.mueller(&seen, from, to, channel)
            }
            _ => PlaneMueller::DEPOLARIZER,
        }
    }
}

/// Reflection or refraction at the interface of two dielectrics, met at `cos` in [0, 1] by a path from the first side. Refraction is the
/// same from either side.
pub(crate) fn dielectric(cos: f64, [n_near, n_far]: [f64; 2], transmitted: bool) -> PlaneMueller {
    let cos_far = fresnel::dielectric(cos, n_near, n_far).cos_far;
    // Optical momenta along the normal, and the same for light in the plane of incidence.
    let (s_near, s_far) = (n_near * cos, n_far * cos_far);
    let (p_near, p_far) = (n_far * cos, n_near * cos_far);
    if transmitted {
        // Both amplitudes have the same numerator.
        return PlaneMueller::of_real_amplitudes(p_near + p_far, s_near + s_far);
    }
    if cos_far > 0.0 {
        return PlaneMueller::of_real_amplitudes(
            (s_near - s_far) / (s_near + s_far),
            (p_near - p_far) / (p_near + p_far),
        );
    }
    // Total reflection: the far cosine is iκ, of fields that decay with the distance.
    let kappa = ((n_near / n_far).powi(2) * (1.0 - cos * cos) - 1.0)
        .max(0.0)
        .sqrt();
    let s = Complex64::new(s_near, -n_far * kappa);
    let p = Complex64::new(p_near, -n_near * kappa);
    PlaneMueller::of_amplitudes(s / s.conj(), p / p.conj())
}

/// Reflection at a metal of complex relative index η + iκ.
pub(crate) fn conductor(cos: f64, index: Complex64) -> PlaneMueller {
    let square = index * index;
    // The root with a positive imaginary part: fields decay.
    let far = (square - (1.0 - cos * cos)).sqrt();
    let (s, p) = (Complex64::from(cos), square * cos);
    PlaneMueller::of_amplitudes((s - far) / (s + far), (p - far) / (p + far))
}
