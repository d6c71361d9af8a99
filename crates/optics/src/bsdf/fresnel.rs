//! Fresnel's equations for unpolarised light.

/// Effect of an interface between two dielectrics on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FresnelInterface {
    /// Reflected fraction of the power, in [0, 1].
    pub reflectance: f64,
    /// Cosine of the angle of the transmitted ray; 0 at total internal reflection.
    pub cos_far: f64,
}

/// Computes reflection and refraction at cosine `cos` in [0, 1] from the side of index `n_near`.
///
/// Total internal reflection has reflectance 1; equal indices have exactly 0.
pub fn dielectric(cos: f64, n_near: f64, n_far: f64) -> FresnelInterface {
    if n_near == n_far {
        return FresnelInterface {
            reflectance: 0.0,
            cos_far: cos,
        };
    }
    // p = n cosθ and q = n' cosθ' are the normal components of the optical momentum
    // (docs/theory.md#interfaces). The difference of their squares is n'² − n², factored because
    // the indices can be very close.
    let p = n_near * cos;
    let q2 = (n_far - n_near) * (n_far + n_near) + p * p;
    if q2 <= 0.0 || p <= 0.0 {
        return FresnelInterface {
            reflectance: 1.0,
            cos_far: q2.max(0.0).sqrt() / n_far,
        };
    }
    let q = q2.sqrt();
    let (a, b) = (n_far * n_far * p, n_near * n_near * q);
    let (s, t) = ((p - q) / (p + q), (a - b) / (a + b));
    FresnelInterface {
        reflectance: (0.5 * (s * s + t * t)).min(1.0),
        cos_far: (q / n_far).min(1.0),
    }
}

/// Computes the mean reflectance 2∫F cosθ d(cosθ) for diffuse light from the side of index
/// `n_near`. Simpson's rule uses a variable in which F has no kink. It covers angles below the
/// critical angle, if there is one; beyond it, F = 1.
pub fn mean(n_near: f64, n_far: f64) -> f64 {
    const STEPS: usize = 512;
    let sin2_most = (n_far / n_near).powi(2).min(1.0);
    // Substitute sin²θ = s (1 − t²): F − 1 is proportional to t near the critical angle, and to 1 −
    // t near normal incidence.
    let integrand = |t: f64| {
        let cos = (1.0 - sin2_most * (1.0 - t * t)).sqrt();
        dielectric(cos, n_near, n_far).reflectance * 2.0 * t * sin2_most
    };
    let weight = |i: usize| match i {
        0 | STEPS => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let h = 1.0 / STEPS as f64;
    let sum: f64 = (0..=STEPS)
        .map(|i| weight(i) * integrand(i as f64 * h))
        .sum();
    sum * h / 3.0 + (1.0 - sin2_most)
}

/// Computes the reflectance of a metal at cosine `cos` in [0, 1]. `eta` + i`k` is its index divided
/// by the index of the medium in front of it (both ≥ 0). The result is in [0, 1].
///
/// With (a + ib)² = (η + ik)² − sin²θ (Born and Wolf §14.2), the reflectances are
///
/// ```text
/// Rs = (a² + b² − 2a cosθ + cos²θ) / (a² + b² + 2a cosθ + cos²θ)
/// Rp = Rs · ((a² + b²) cos²θ + sin⁴θ − 2a cosθ sin²θ) / ((a² + b²) cos²θ + sin⁴θ + 2a cosθ sin²θ)
/// ```
pub fn conductor(cos: f64, eta: f64, k: f64) -> f64 {
    let cos = cos.clamp(0.0, 1.0);
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    let real = eta * eta - k * k - sin2;
    let modulus = real.hypot(2.0 * eta * k);
    let a = (0.5 * (modulus + real)).max(0.0).sqrt();
    let cross = 2.0 * a * cos;
    let rs = fraction(modulus + cos2, cross);
    let rp = rs * fraction(modulus * cos2 + sin2 * sin2, cross * sin2);
    0.5 * (rs + rp)
}

/// Computes (sum − cross)/(sum + cross) for sum ≥ cross ≥ 0, up to rounding. It is 1 where both
/// vanish, for an index of zero or an index match at grazing incidence.
fn fraction(sum: f64, cross: f64) -> f64 {
    if sum + cross > 0.0 {
        ((sum - cross) / (sum + cross)).max(0.0)
    } else {
        1.0
    }
}
