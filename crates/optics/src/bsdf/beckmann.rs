//! Beckmann distribution of microfacets (Walter et al. 2007): the slopes of a Gaussian random
//! surface.
//!
//! Masking is Smith's, in closed form. Mitsuba uses a rational fit of it, with an error of up to
//! 0.35 %.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// 1/√π.
const FRAC_1_SQRT_PI: f64 = 0.5 * FRAC_2_SQRT_PI;
/// Largest slope at roughness 1. Beyond it, e^(−s²) is below the rounding of 1.
const MAX_SLOPE: f64 = 6.0;
/// Largest exponent x. Beyond it, e^(−x) counts as zero.
const MAX_EXPONENT: f64 = 700.0;

/// Computes D(h) for the roughness `u` along and `v` across. `cos` is the cosine h_z, and `sin2` is
/// (v/u) h_u² + (u/v) h_v².
pub(super) fn d([u, v]: [f64; 2], cos: f64, sin2: f64) -> f64 {
    let cos2 = cos * cos;
    let exponent = sin2 / (cos2 * u * v);
    if exponent < MAX_EXPONENT {
        libm::exp(-exponent) / (PI * u * v * cos2 * cos2)
    } else {
        0.0
    }
}

/// Computes G₁/|cosθ| at |cosθ| and α sinθ: 2/(1 + erf a + e^(−a²)/(a√π)) with a = cosθ/(α sinθ),
/// over cosθ.
pub(super) fn g1_over_cos(cos: f64, stretched: f64) -> f64 {
    2.0 / visible_below(cos, stretched, cos / stretched)
}

/// Computes cosθ (1 + erf s) + sinθ e^(−s²)/√π. At roughness 1, it is proportional to the visible
/// area of facets whose slope towards the viewer is below s.
fn visible_below(cos: f64, sin: f64, s: f64) -> f64 {
    // Planted error "facets of Gaussian slopes seen as often from the side as from above", found by morgana-transport/transport::bsdf::facets::facets_cover_the_surface_once:
    // cos * libm::erfc(-s) + sin * 0.5 * libm::exp(-s * s)
    cos * libm::erfc(-s) + sin * FRAC_1_SQRT_PI * libm::exp(-s * s)
}

/// Samples a facet normal visible from `o` at roughness 1. The normal does not have unit length.
/// Slopes along `o` and across it are independent, and each is sampled by inversion.
pub(super) fn visible(o: DVec3, u: [f64; 2]) -> DVec3 {
    normal(o, slope_along(o, u[0]), slope(1.0, 0.0, u[1]))
}

/// Returns the normals of all pairs of numbers.
pub(super) fn visible_grid(o: DVec3, numbers: &[f64]) -> Vec<DVec3> {
    let across: Vec<f64> = numbers.iter().map(|&u| slope(1.0, 0.0, u)).collect();
    let row = |u: f64| {
        let along = slope_along(o, u);
        across.iter().map(move |&across| normal(o, along, across))
    };
    numbers.iter().flat_map(|&u| row(u)).collect()
}

/// Returns the normal with given slopes along `o` and across it.
fn normal(o: DVec3, along: f64, across: f64) -> DVec3 {
    let axis = o.truncate().try_normalize().unwrap_or(DVec2::X);
    (-(along * axis + across * axis.perp())).extend(1.0)
}

fn slope_along(o: DVec3, u: f64) -> f64 {
    slope(o.z, o.truncate().length(), u)
}

/// Finds the slope below which a fraction `u` of the visible facets lies, for a viewer at an angle
/// with `cos` and `sin`. Newton's method solves for the logarithm of the fraction, which is nearly
/// a parabola where the fraction is small. Bounds safeguard the steps, because the density vanishes
/// at the steepest visible slope.
fn slope(cos: f64, sin: f64, u: f64) -> f64 {
    let steepest = (cos / sin).min(MAX_SLOPE);
    let (mut low, mut high) = (-MAX_SLOPE, steepest);
    let wanted = u * visible_below(cos, sin, steepest);
    let mut s = guess(u * 0.5 * libm::erfc(-steepest)).clamp(low, high);
    for _ in 0..64 {
        let below = visible_below(cos, sin, s);
        if below < wanted {
            low = s;
        } else {
            high = s;
        }
        let density = 2.0 * FRAC_1_SQRT_PI * libm::exp(-s * s) * (cos - s * sin);
        let step = libm::log(wanted / below) * below / density;
        let next = s + step;
        let next = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
        if (next - s).abs() < 1e-13 {
            break;
        }
        s = next;
    }
    s
}

/// Estimates the slope below which a fraction `p` of all facets lies (Shore 1982).
fn guess(p: f64) -> f64 {
    let half = |p: f64| 3.93 * (libm::pow((1.0 - p) / p, 0.1186) - 1.0);
    if p < 0.5 { -half(p) } else { half(1.0 - p) }
}
