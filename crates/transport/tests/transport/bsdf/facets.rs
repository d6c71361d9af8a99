//! Distributions of microfacets, compared with closed forms, with their own integrals, and with the
//! inverse of their samplers. Nothing here is random.

use glam::DVec3;
use morgana_transport::bsdf::Distribution::{Beckmann, Ggx};
use morgana_transport::bsdf::{Distribution, Microfacets};
use testkit::quadrature::{Effort, integrate_cell};

const EFFORT: Effort = Effort {
    tolerance: 1e-8,
    min_depth: 3,
    max_depth: 12,
};

fn facets(distribution: Distribution, alpha: f64) -> Microfacets {
    Microfacets::new(distribution, alpha).unwrap()
}

fn brushed(distribution: Distribution, alphas: [f64; 2]) -> Microfacets {
    Microfacets::anisotropic(distribution, alphas).unwrap()
}

fn at(cos: f64) -> DVec3 {
    DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

/// Roughness, cosine, D and Smith's G₁ of Beckmann's distribution: closed forms in 30 digits, by
/// mpmath 1.3.
#[test]
fn beckmann_values() {
    let table = [
        (0.05, 0.9, 3.4619598412977303e-39, 1.0),
        (0.05, 0.5, 0.0, 1.0),
        (0.05, 0.1, 0.0, 0.9997682398966635),
        (0.05, 0.01, 0.0, 0.508530078837601),
        (0.3, 0.9, 0.3978611403040669, 1.0),
        (0.3, 0.5, 1.8890561647947794e-13, 0.9996373289372132),
        (0.3, 0.1, 0.0, 0.6969521383743302),
        (0.3, 0.01, 0.0, 0.11146007416077139),
        (1.0, 0.9, 0.383714794712239, 0.9998268953477976),
        (1.0, 0.5, 0.25356345704959005, 0.8748975972197335),
        (1.0, 0.1, 3.218817982194348e-40, 0.2998400324792342),
        (1.0, 0.01, 0.0, 0.034829989947944756),
    ];
    for (alpha, cos, d, g1) in table {
        let facets = facets(Beckmann, alpha);
        let ours = [facets.d(at(cos)), facets.g1(at(cos)), facets.g1(-at(cos))];
        for (ours, expected) in ours.into_iter().zip([d, g1, g1]) {
            // The exponent of D reaches several hundred.
            let error = (ours - expected).abs();
            assert!(
                error <= 1e-12 * expected + 1e-200,
                "{alpha} {cos}: {ours} against {expected}"
            );
        }
    }
}

/// D and G₁ fulfil their definitions: facets cover the macroscopic area once, seen from above and,
/// as far as they are visible, from any side. The integrand has a kink where facets turn away.
#[test]
fn facets_cover_the_surface_once() {
    for distribution in [Beckmann, Ggx] {
        for alpha in [0.1, 0.4, 1.0] {
            let facets = facets(distribution, alpha);
            for cos in [1.0, 0.6, 0.1, 0.01] {
                let o = at(cos);
                // Integrate over tanθ = α t/(1 − t), t in [0, 1), and half of the azimuths.
                let projected = |[t, phi]: [f64; 2]| {
                    let tan = alpha * t / (1.0 - t);
                    let h = DVec3::new(tan * phi.cos(), tan * phi.sin(), 1.0).normalize();
                    let solid = alpha / (1.0 - t).powi(2) * tan * h.z.powi(3);
                    2.0 * facets.d(h) * o.dot(h).max(0.0) * solid
                };
                let area = integrate_cell(
                    &projected,
                    [0.0, 0.0],
                    [1.0 - 1e-9, std::f64::consts::PI],
                    EFFORT,
                );
                let seen = facets.g1(o) * area;
                assert!(
                    (seen / cos - 1.0).abs() < 1e-4,
                    "{distribution:?} {alpha} {cos}: {seen}"
                );
            }
        }
    }
}

/// Compares D and Smith's G₁ of both distributions with the published formulas, in angles. These
/// are the isotropic formulas with the roughness in the direction of the azimuth (Heitz,
/// "Understanding the masking-shadowing function in microfacet-based BRDFs", JCGT 2014, §5.3 and
/// §5.4).
#[test]
fn anisotropic_facets_as_published() {
    let [u, v]: [f64; 2] = [0.2, 0.7];
    for (theta, phi) in [(0.0, 0.0), (0.3, 0.4), (0.9, 2.1), (1.3, 4.0), (1.55, 5.9)] {
        let (theta, phi): (f64, f64) = (theta, phi);
        let h = DVec3::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        );
        let slope2 = theta.tan().powi(2) * ((phi.cos() / u).powi(2) + (phi.sin() / v).powi(2));
        let scale = 1.0 / (std::f64::consts::PI * u * v * theta.cos().powi(4));
        let alpha = (phi.cos() * u).hypot(phi.sin() * v);
        let a = 1.0 / (alpha * theta.tan());
        let gaussian = (-a * a).exp() / (a * std::f64::consts::PI.sqrt());
        let lambdas = [
            0.5 * (libm::erf(a) - 1.0 + gaussian),
            0.5 * ((1.0 + 1.0 / (a * a)).sqrt() - 1.0),
        ];
        let expected = [scale * (-slope2).exp(), scale / (1.0 + slope2).powi(2)];
        for (k, distribution) in [Beckmann, Ggx].into_iter().enumerate() {
            let facets = brushed(distribution, [u, v]);
            for (ours, expected) in [
                (facets.d(h), expected[k]),
                (facets.g1(h), 1.0 / (1.0 + lambdas[k])),
            ] {
                let error = (ours - expected).abs();
                assert!(
                    error <= 1e-11 * expected + 1e-200,
                    "{distribution:?} {theta} {phi}: {ours} against {expected}"
                );
            }
        }
    }
}

/// Repeats [`facets_cover_the_surface_once`] for anisotropic facets, seen from all azimuths.
#[test]
fn anisotropic_facets_cover_the_surface_once() {
    let [u, v] = [0.15, 0.6];
    for distribution in [Beckmann, Ggx] {
        let facets = brushed(distribution, [u, v]);
        for (cos, azimuth) in [(1.0, 0.0), (0.5, 0.3), (0.1, 1.2), (0.1, 2.8), (0.01, 4.0)] {
            let (cos, azimuth): (f64, f64) = (cos, azimuth);
            let sin = (1.0 - cos * cos).sqrt();
            let o = DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos);
            // Integrate over slopes (α_u s cosφ, α_v s sinφ) with s = t/(1 − t).
            let projected = |[t, phi]: [f64; 2]| {
                let s = t / (1.0 - t);
                let h = DVec3::new(u * s * phi.cos(), v * s * phi.sin(), 1.0).normalize();
                let solid = u * v * s / (1.0 - t).powi(2) * h.z.powi(3);
                facets.d(h) * o.dot(h).max(0.0) * solid
            };
            let around = std::f64::consts::TAU;
            let area = integrate_cell(&projected, [0.0, 0.0], [1.0 - 1e-9, around], EFFORT);
            let seen = facets.g1(o) * area;
            assert!(
                (seen / cos - 1.0).abs() < 1e-4,
                "{distribution:?} {cos} {azimuth}: {seen}"
            );
        }
    }
}

/// The two random numbers of a sampled Beckmann normal are cumulative fractions of the visible
/// facets: those whose slopes, towards the viewer and across, are below the slopes of the normal.
#[test]
fn beckmann_normals_give_their_numbers_back() {
    for alpha in [1e-3, 0.3, 1.0] {
        for cos in [1.0, 0.7, 0.05, 1e-3] {
            let (o, facets) = (at(cos), facets(Beckmann, alpha));
            for u in [
                [0.01, 0.3],
                [0.2, 0.9],
                [0.5, 0.5],
                [0.77, 0.05],
                [0.999, 0.999],
                [1e-7, 1e-7],
            ] {
                let h = facets.sample_visible(o, u);
                let slopes = [-h.x / h.z / alpha, -h.y / h.z / alpha];
                let stretched = DVec3::new(alpha * o.x, 0.0, o.z).normalize();
                // ∫ e^(−s²) (cosθ − s sinθ) ds, up to a factor.
                let below = |s: f64| {
                    let (cos, sin) = (stretched.z, stretched.x);
                    let root = std::f64::consts::PI.sqrt();
                    0.5 * (root * cos * libm::erfc(-s) + sin * (-s * s).exp())
                };
                let first = below(slopes[0]) / below(stretched.z / stretched.x);
                let back = [first, 0.5 * libm::erfc(-slopes[1])];
                for k in 0..2 {
                    let error = (back[k] - u[k]).abs();
                    assert!(
                        error < 1e-9 * u[k] + 1e-14,
                        "{alpha} {cos}: {u:?} became {back:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_ends_of_the_unit_interval_make_normals() {
    let last = 1.0 - f64::EPSILON / 2.0;
    for distribution in [Beckmann, Ggx] {
        for (alpha, cos) in [(1e-4, 1.0), (1e-4, 1e-6), (1.0, 1.0), (1.0, 1e-6)] {
            for u in [[0.0, 0.0], [last, last], [0.0, last], [last, 0.0]] {
                let h = facets(distribution, alpha).sample_visible(at(cos), u);
                assert!(
                    h.is_normalized() && h.z > 0.0,
                    "{distribution:?} {alpha} {cos} {u:?}: {h}"
                );
            }
        }
    }
}
