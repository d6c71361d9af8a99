//! Effect of smooth and rough interfaces on polarisation: Fresnel's equations for both
//! polarisations.
//!
//! Theory: docs/theory.md#polarising-interfaces.

use super::{Bsdf, FilterMueller, PolarizingFilter, Surface, fresnel};
use crate::mueller::PlaneMueller;
use glam::{DMat4, DVec3};
use num_complex::Complex64;

impl Bsdf {
    /// Returns true if the surface changes the polarisation of light that passes undeflected.
    pub fn changes_what_passes(&self) -> bool {
        matches!(self, Bsdf::ThinDielectric(_)) || self.filter().is_some()
    }

    fn filter(&self) -> Option<&PolarizingFilter> {
        match self {
            Bsdf::Filter(b) => Some(b),
            Bsdf::NormalMap(b) => b.nested().filter(),
            _ => None,
        }
    }

    /// Returns the matrix for polarised light that passes undeflected along the unit direction `k`,
    /// or `None` if the light is unchanged.
    pub fn passing_mueller(&self, s: &Surface, k: DVec3) -> Option<FilterMueller> {
        if let Bsdf::ThinDielectric(b) = self {
            let normal = s.facing(-k).normal;
            let across = normal.cross(k).try_normalize();
            return Some(FilterMueller {
                axis: across.unwrap_or_else(|| k.any_orthonormal_vector()),
                matrix: pane(normal.dot(k).abs().min(1.0), b.eta(), true).then(DMat4::IDENTITY),
            });
        }
        Some(self.filter()?.mueller(s, k))
    }

    /// Returns the matrix of the event that continues a path from the unit direction `from` in the
    /// unit direction `to`. For rough surfaces, it is the matrix of the facet that reflects or
    /// refracts the path. All surfaces except dielectrics, panes and metals depolarise.
    pub fn mueller(&self, s: &Surface, from: DVec3, to: DVec3, channel: usize) -> PlaneMueller {
        match self {
            Bsdf::Dielectric(_) => {
                let side = s.facing(-from);
                let cos = side.normal.dot(-from).min(1.0);
                let transmitted = side.normal.dot(to) < 0.0;
                dielectric(cos, [side.n_near, side.n_far], transmitted)
            }
            Bsdf::RoughDielectric(_) => facet(s, from, to),
            Bsdf::ThinDielectric(b) => pane(reflecting_cos(from, to), b.eta(), false),
            Bsdf::Conductor(b) => {
                // Use the facet that reflects the path, whatever its normal.
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

/// Returns the cosine of incidence at the facet that reflects the path.
fn reflecting_cos(from: DVec3, to: DVec3) -> f64 {
    (0.5 * (1.0 - from.dot(to))).max(0.0).sqrt()
}

/// Returns the matrix of the dielectric facet that reflects or refracts the path.
fn facet(s: &Surface, from: DVec3, to: DVec3) -> PlaneMueller {
    let side = s.facing(-from);
    let n = [side.n_near, side.n_far];
    if side.normal.dot(to) >= 0.0 {
        return dielectric(reflecting_cos(from, to), n, false);
    }
    // Refraction changes n·direction along the normal only.
    // Planted error "facets that refract about the half vector of reflection", found by morgana-transport/transport::polarization::chains::facets_polarise_as_smooth_interfaces_do:
    // let normal = (from - to).try_normalize();
    let normal = (from * side.n_near - to * side.n_far).try_normalize();
    let cos = normal.map_or(1.0, |normal| normal.dot(from).abs().min(1.0));
    dielectric(cos, n, true)
}

/// Returns the matrix of reflection or refraction at the interface of two dielectrics. A path
/// arrives from the first side at cosine `cos` in [0, 1]. Refraction has the same matrix from
/// either side.
pub fn dielectric(cos: f64, [n_near, n_far]: [f64; 2], transmitted: bool) -> PlaneMueller {
    let cos_far = fresnel::dielectric(cos, n_near, n_far).cos_far;
    // Compute the normal components of the optical momentum, and their counterparts for light
    // polarised in the plane of incidence.
    let (s_near, s_far) = (n_near * cos, n_far * cos_far);
    let (p_near, p_far) = (n_far * cos, n_near * cos_far);
    if transmitted {
        // Both amplitudes have the same numerator, which cancels.
        return PlaneMueller::of_real_amplitudes(p_near + p_far, s_near + s_far);
    }
    if cos_far > 0.0 {
        return PlaneMueller::of_real_amplitudes(
            (s_near - s_far) / (s_near + s_far),
            (p_near - p_far) / (p_near + p_far),
        );
    }
    // Total reflection: the far cosine is iκ, for evanescent fields.
    let kappa = ((n_near / n_far).powi(2) * (1.0 - cos * cos) - 1.0)
        .max(0.0)
        .sqrt();
    let s = Complex64::new(s_near, -n_far * kappa);
    let p = Complex64::new(p_near, -n_near * kappa);
    // Planted error "total reflection that delays the wrong component", found by morgana-transport/transport::polarization::chains::total_reflection_makes_linear_light_elliptical:
    // PlaneMueller::of_amplitudes(p / p.conj(), s / s.conj())
    PlaneMueller::of_amplitudes(s / s.conj(), p / p.conj())
}

/// Returns the matrix of reflection or transmission by a pane of relative index `eta`, at cosine
/// `cos` in [0, 1]. It includes all internal reflections. Different reflections are incoherent, but
/// the two polarisations of each reflection are coherent.
pub(crate) fn pane(cos: f64, eta: f64, transmitted: bool) -> PlaneMueller {
    let face = fresnel::dielectric(cos, 1.0, eta);
    if face.cos_far <= 0.0 {
        // No light enters the pane.
        return dielectric(cos, [1.0, eta], false);
    }
    let (s_far, p_near) = (eta * face.cos_far, eta * cos);
    let s = (cos - s_far) / (cos + s_far);
    let p = (p_near - face.cos_far) / (p_near + face.cos_far);
    let (product, f) = (s * p, face.reflectance);
    // Sum the products of both amplitudes over the internal reflections. Each reflection multiplies
    // the product by s p.
    let out = (1.0 - s * s) * (1.0 - p * p) / (1.0 - product * product);
    let (of_face, both, scalar): (fn(f64) -> f64, f64, f64) = if transmitted {
        (|f| (1.0 - f) / (1.0 + f), out, (1.0 - f) / (1.0 + f))
    } else {
        (
            |f| 2.0 * f / (1.0 + f),
            product * (1.0 + out),
            2.0 * f / (1.0 + f),
        )
    };
    let (s, p) = (of_face(s * s), of_face(p * p));
    let mean = 0.5 * (s + p) / scalar;
    PlaneMueller {
        a1: mean,
        b1: 0.5 * (s - p) / scalar,
        a2: mean,
        a3: both / scalar,
        a4: both / scalar,
        b2: 0.0,
    }
}

/// Returns the matrix of reflection at a metal of complex relative index η + iκ.
pub(crate) fn conductor(cos: f64, index: Complex64) -> PlaneMueller {
    let square = index * index;
    // Take the root with a positive imaginary part: fields decay.
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

    /// Compares with tan(δ/2) = cosθ √(sin²θ − n²)/sin²θ with n = n′/n (Born and Wolf). δ is the
    /// phase lead of the component in the plane of incidence over the component across it. It is
    /// known up to half a turn, because y is mirrored with the ray.
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

    /// Tests that energy is conserved in each polarisation. The scalar equations give the sum of
    /// both, b₁ their difference.
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

    /// Compares metals without absorption with dielectrics. For other metals, R (1 + b₁) is the
    /// reflectance of the component across the plane of incidence, where R is the scalar
    /// reflectance.
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

    /// Tests that a pane sums all reflections between its faces: powers for each polarisation, and
    /// products of both amplitudes for light at 45°.
    #[test]
    fn panes_add_up_all_reflections_inside() {
        for degrees in [0.0f64, 30.0, 56.3, 85.0] {
            let cos = degrees.to_radians().cos();
            let face = fresnel::dielectric(cos, 1.0, GLASS);
            let amplitude = |near: f64, far: f64| (near - far) / (near + far);
            let s = amplitude(cos, GLASS * face.cos_far);
            let p = amplitude(GLASS * cos, face.cos_far);
            // Sum the powers along both axes, and the products of both amplitudes, over the
            // reflections.
            let sum = |first: f64, step: f64| (0..60).map(|i| first * step.powi(i)).sum::<f64>();
            let passed = |of: f64, square: f64| sum((1.0 - of).powi(2), square);
            let [fs, fp] = [s * s, p * p];
            let f = face.reflectance;
            for transmitted in [true, false] {
                let found = pane(cos, GLASS, transmitted);
                let (xs, xp, both, scalar) = if transmitted {
                    let both = sum((1.0 - fs) * (1.0 - fp), (s * p).powi(2));
                    (
                        passed(fs, fs * fs),
                        passed(fp, fp * fp),
                        both,
                        (1.0 - f) / (1.0 + f),
                    )
                } else {
                    let back = |f: f64| f + sum((1.0 - f).powi(2) * f, f * f);
                    let inner = sum((1.0 - fs) * (1.0 - fp) * s * p, (s * p).powi(2));
                    (back(fs), back(fp), s * p + inner, 2.0 * f / (1.0 + f))
                };
                assert!(
                    (scalar * found.a1 - 0.5 * (xs + xp)).abs() < 1e-9,
                    "{degrees}"
                );
                assert!(
                    (scalar * found.b1 - 0.5 * (xs - xp)).abs() < 1e-9,
                    "{degrees}"
                );
                assert!(
                    (scalar * found.a3 - both).abs() < 1e-9,
                    "{degrees}: {found:?}"
                );
                assert!(found.a2 == found.a1 && found.a4 == found.a3 && found.b2 == 0.0);
                // The degree of polarisation is at most 1.
                assert!(found.b1.hypot(found.a3) <= found.a1 + 1e-12);
            }
        }
    }
}
