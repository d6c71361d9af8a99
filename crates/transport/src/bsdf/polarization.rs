//! What interfaces, smooth or of facets, do to the polarisation of light: Fresnel's equations for either polarisation.
//!
//! Theory: docs/theory.md#polarising-interfaces.

use super::{Bsdf, PolarizingFilter, Surface, fresnel};
use crate::mueller::PlaneMueller;
use glam::DVec3;
use num_complex::Complex64;

impl Bsdf {
    /// Whether the matrices of its reflections differ among channels.
    pub(crate) fn polarizes_by_channel(&self) -> bool {
        match self {
            Bsdf::Conductor(_) | Bsdf::RoughConductor(_) => true,
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

    /// What it does to polarised light that passes straight on, if it is a filter.
    pub(crate) fn filter(&self) -> Option<&PolarizingFilter> {
        match self {
            Bsdf::Filter(b) => Some(b),
            Bsdf::NormalMap(b) => b.nested().filter(),
            _ => None,
        }
    }

    /// What the event does to polarisation by which a path that arrives in the unit direction `from` goes on in the unit direction `to`.
    /// Facets are those that reflect or refract so. All but dielectrics and metals depolarises.
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
            Bsdf::RoughDielectric(_) => facet(s, from, to),
            Bsdf::Conductor(b) => {
                // Of the facet that reflects so, whichever normal that has.
                conductor(
                    reflecting_cos(from, to),
                    b.metal().relative_index(s, channel),
                )
            }
            Bsdf::RoughConductor(b) => conductor(
                reflecting_cos(from, to),
                b.metal().relative_index(s, channel),
            ),
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

/// Cosine at which a path meets the facet that reflects it so.
fn reflecting_cos(from: DVec3, to: DVec3) -> f64 {
    (0.5 * (1.0 - from.dot(to))).max(0.0).sqrt()
}

/// The facet of a dielectric that reflects or refracts a path so.
fn facet(s: &Surface, from: DVec3, to: DVec3) -> PlaneMueller {
    let side = s.facing(-from);
    let n = [side.n_near, side.n_far];
    if side.normal.dot(to) >= 0.0 {
        return dielectric(reflecting_cos(from, to), n, false);
    }
    // What refraction adds to n·direction is along the normal.
    let normal = (from * side.n_near - to * side.n_far).try_normalize();
    let cos = normal.map_or(1.0, |normal| normal.dot(from).abs().min(1.0));
    dielectric(cos, n, true)
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

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: f64 = 1.5;

    #[test]
    fn nothing_in_the_plane_is_reflected_at_brewsters_angle() {
        let cos = GLASS.atan().cos();
        let reflected = dielectric(cos, [1.0, GLASS], false);
        assert!((reflected.b1 - 1.0).abs() < 1e-12, "{reflected:?}");
        assert!(reflected.a3.abs() < 1e-8 && reflected.b2 == 0.0);
    }

    /// tan(δ/2) = cosθ √(sin²θ − n²)/sin²θ with n = n′/n (Born and Wolf), by which the component in the plane of incidence is ahead of
    /// that across, up to half a turn, since y is mirrored with the ray.
    #[test]
    fn total_reflection_retards() {
        for degrees in [42.0f64, 48.6, 53.3, 70.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let half = cos * (sin * sin - GLASS.powi(-2)).sqrt() / (sin * sin);
            let delta = 2.0 * half.atan();
            let total = dielectric(cos, [GLASS, 1.0], false);
            assert!(total.b1.abs() < 1e-12);
            assert!(
                (total.a3 - delta.cos()).abs() < 1e-12,
                "{degrees}: {total:?}"
            );
            assert!(
                (total.b2.abs() - delta.sin()).abs() < 1e-12,
                "{degrees}: {total:?}"
            );
        }
    }

    /// Of the parts of unpolarised light, which the scalar equations add up, b₁ tells them apart; energy is conserved in each.
    #[test]
    fn energy_of_each_polarisation_is_conserved() {
        for cos in [0.05, 0.3, 0.9, 1.0] {
            let f = fresnel::dielectric(cos, 1.0, GLASS).reflectance;
            let reflected = dielectric(cos, [1.0, GLASS], false);
            let refracted = dielectric(cos, [1.0, GLASS], true);
            assert!((f * reflected.b1 + (1.0 - f) * refracted.b1).abs() < 1e-12);
            let back = dielectric(
                fresnel::dielectric(cos, 1.0, GLASS).cos_far,
                [GLASS, 1.0],
                true,
            );
            assert!((back.b1 - refracted.b1).abs() < 1e-12);
            assert!((back.a3 - refracted.a3).abs() < 1e-12);
        }
    }

    #[test]
    fn reflection_at_normal_incidence_changes_handedness() {
        let metal = conductor(1.0, Complex64::new(0.2, 3.4));
        for mirror in [metal, dielectric(1.0, [1.0, GLASS], false)] {
            assert!(mirror.b1.abs() < 1e-12 && mirror.b2.abs() < 1e-12);
            assert!((mirror.a4 + 1.0).abs() < 1e-12, "{mirror:?}");
        }
    }

    /// And of others, R (1 + b₁) is the reflectance of the component across the plane of incidence, with the scalar equation's R.
    #[test]
    fn metals_without_absorption_are_dielectrics() {
        for cos in [0.1, 0.5, 0.8] {
            let metal = conductor(cos, GLASS.into());
            let glass = dielectric(cos, [1.0, GLASS], false);
            assert!((metal.b1 - glass.b1).abs() < 1e-12);
            assert!((metal.a3 - glass.a3).abs() < 1e-12);
            let index = Complex64::new(0.9, 1.7);
            let far = (index * index - (1.0 - cos * cos)).sqrt();
            let s = ((cos - far) / (cos + far)).norm_sqr();
            let mean = fresnel::conductor(cos, index.re, index.im);
            assert!((mean * (1.0 + conductor(cos, index).b1) - s).abs() < 1e-12);
        }
    }
}
