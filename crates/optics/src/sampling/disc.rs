//! Distributions over the plane: uniform disc, and Gaussians over the whole plane or the unit disc.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Samples a point of the unit disc by the concentric map (Shirley and Chiu 1997), which preserves
/// relative areas and keeps neighbours together.
pub fn uniform_disc_sample(u: [f64; 2]) -> DVec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let (r, phi) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    r * DVec2::from_angle(phi)
}

/// Maps a point of the unit disc to the ring outside the radius `inner`, in [0, 1), preserving
/// relative areas.
pub fn disc_to_ring(inner: f64, p: DVec2) -> DVec2 {
    if inner == 0.0 {
        return p;
    }
    let square = inner * inner;
    let radius = (square + (1.0 - square) * p.length_squared()).sqrt();
    radius * p.try_normalize().unwrap_or(DVec2::X)
}

/// Inverts [`uniform_disc_sample`]: returns the `u` that it maps to `p`, a point of the unit disc.
pub fn uniform_disc_inverse(p: DVec2) -> [f64; 2] {
    let r = p.length();
    if r == 0.0 {
        return [0.5, 0.5];
    }
    // Choose the wedge by the larger coordinate. Within it, `u` is linear in the angle from its
    // axis.
    let (a, b) = if p.x.abs() > p.y.abs() {
        let a = r.copysign(p.x);
        (a, a * (p.y / p.x).atan() / FRAC_PI_4)
    } else {
        let b = r.copysign(p.y);
        (b * (p.x / p.y).atan() / FRAC_PI_4, b)
    };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)]
}

/// Returns the density per unit area: 1/π inside the unit disc, 0 outside.
pub fn uniform_disc_pdf(p: DVec2) -> f64 {
    if p.length_squared() <= 1.0 {
        1.0 / PI
    } else {
        0.0
    }
}

/// Samples an isotropic 2-D normal deviate of standard deviation `sigma` per axis (Box and Muller
/// 1958).
///
/// A beam of 1/e² intensity radius w has `sigma` = w/2. The deviate is not truncated: radii up to
/// 8.6 `sigma` occur.
pub fn gaussian_disc_sample(sigma: f64, u: [f64; 2]) -> DVec2 {
    sigma * (-2.0 * (-u[0]).ln_1p()).sqrt() * DVec2::from_angle(TAU * u[1])
}

/// Inverts [`gaussian_disc_sample`]: returns the `u` that it maps to `p`.
pub fn gaussian_disc_inverse(sigma: f64, p: DVec2) -> [f64; 2] {
    let x = p / sigma;
    let turn = p.y.atan2(p.x) / TAU;
    [
        -(-0.5 * x.length_squared()).exp_m1(),
        if turn < 0.0 { turn + 1.0 } else { turn },
    ]
}

/// Returns the density exp(−|p|²/2σ²)/(2πσ²) per unit area.
pub fn gaussian_disc_pdf(sigma: f64, p: DVec2) -> f64 {
    (-0.5 * (p / sigma).length_squared()).exp() / (TAU * sigma * sigma)
}

/// Samples a point of the unit disc with density proportional to exp(−|p|²/2σ²), σ > 0.
pub fn truncated_gaussian_disc_sample(sigma: f64, u: [f64; 2]) -> DVec2 {
    let u = [u[0] * unit_disc_mass(sigma), u[1]];
    gaussian_disc_sample(sigma, u).clamp_length_max(1.0)
}

/// Inverts [`truncated_gaussian_disc_sample`]: returns the `u` that it maps to `p`, a point of the
/// unit disc.
pub fn truncated_gaussian_disc_inverse(sigma: f64, p: DVec2) -> [f64; 2] {
    let [mass, turn] = gaussian_disc_inverse(sigma, p);
    [mass / unit_disc_mass(sigma), turn]
}

/// Returns the density per unit area in the unit disc, 0 outside.
pub fn truncated_gaussian_disc_pdf(sigma: f64, p: DVec2) -> f64 {
    if p.length_squared() <= 1.0 {
        gaussian_disc_pdf(sigma, p) / unit_disc_mass(sigma)
    } else {
        0.0
    }
}

/// Returns the probability that a normal deviate lies in the unit disc.
fn unit_disc_mass(sigma: f64) -> f64 {
    -(-0.5 / (sigma * sigma)).exp_m1()
}
