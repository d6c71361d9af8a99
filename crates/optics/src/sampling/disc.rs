//! Distributions over the plane: uniform disc and Gaussian, of the whole plane or of the unit disc.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Point of the unit disc for `u` by the concentric map (Shirley and Chiu 1997), which keeps areas
/// in proportion and neighbours together.
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

/// A point of the unit disc, moved outwards beyond a radius in [0, 1) so that areas stay in proportion.
pub fn disc_to_ring(inner: f64, p: DVec2) -> DVec2 {
    if inner == 0.0 {
        return p;
    }
    let square = inner * inner;
    let radius = (square + (1.0 - square) * p.length_squared()).sqrt();
    radius * p.try_normalize().unwrap_or(DVec2::X)
}

/// The `u` of a point in the unit disc.
pub fn uniform_disc_inverse(p: DVec2) -> [f64; 2] {
    let r = p.length();
    if r == 0.0 {
        return [0.5, 0.5];
    }
    // The wedge is chosen by the larger coordinate; within it the angle from its axis is linear.
    let (a, b) = if p.x.abs() > p.y.abs() {
        let a = r.copysign(p.x);
        (a, a * (p.y / p.x).atan() / FRAC_PI_4)
    } else {
        let b = r.copysign(p.y);
        (b * (p.x / p.y).atan() / FRAC_PI_4, b)
    };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)]
}

/// 1/π inside the unit disc, 0 outside, per unit area.
pub fn uniform_disc_pdf(p: DVec2) -> f64 {
    if p.length_squared() <= 1.0 {
        1.0 / PI
    } else {
        0.0
    }
}

/// Isotropic 2-D normal deviate of standard deviation `sigma` per axis (Box and Muller 1958).
///
/// A beam of 1/e² intensity radius w has `sigma` = w/2. Not truncated: radii up to 8.6 `sigma` occur.
pub fn gaussian_disc_sample(sigma: f64, u: [f64; 2]) -> DVec2 {
    sigma * (-2.0 * (-u[0]).ln_1p()).sqrt() * DVec2::from_angle(TAU * u[1])
}

/// The `u` of a normal deviate.
pub fn gaussian_disc_inverse(sigma: f64, p: DVec2) -> [f64; 2] {
    let x = p / sigma;
    let turn = p.y.atan2(p.x) / TAU;
    [
        -(-0.5 * x.length_squared()).exp_m1(),
        if turn < 0.0 { turn + 1.0 } else { turn },
    ]
}

/// exp(−|p|²/2σ²)/(2πσ²), per unit area.
pub fn gaussian_disc_pdf(sigma: f64, p: DVec2) -> f64 {
    (-0.5 * (p / sigma).length_squared()).exp() / (TAU * sigma * sigma)
}

/// Point of the unit disc with density in proportion to exp(−|p|²/2σ²), σ > 0.
pub fn truncated_gaussian_disc_sample(sigma: f64, u: [f64; 2]) -> DVec2 {
    let u = [u[0] * unit_disc_mass(sigma), u[1]];
    gaussian_disc_sample(sigma, u).clamp_length_max(1.0)
}

/// The `u` of a point in the unit disc.
pub fn truncated_gaussian_disc_inverse(sigma: f64, p: DVec2) -> [f64; 2] {
    let [mass, turn] = gaussian_disc_inverse(sigma, p);
    [mass / unit_disc_mass(sigma), turn]
}

/// Density per unit area in the unit disc, 0 outside.
pub fn truncated_gaussian_disc_pdf(sigma: f64, p: DVec2) -> f64 {
    if p.length_squared() <= 1.0 {
        gaussian_disc_pdf(sigma, p) / unit_disc_mass(sigma)
    } else {
        0.0
    }
}

/// Probability that a normal deviate lies in the unit disc.
fn unit_disc_mass(sigma: f64) -> f64 {
    -(-0.5 / (sigma * sigma)).exp_m1()
}
