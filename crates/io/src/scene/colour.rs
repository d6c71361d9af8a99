//! The sRGB transfer function.

/// Linear intensity of an sRGB-encoded value, both in [0, 1] (IEC 61966-2-1).
pub fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB-encoded value of a linear intensity, both in [0, 1] (IEC 61966-2-1).
pub fn srgb_from_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}
