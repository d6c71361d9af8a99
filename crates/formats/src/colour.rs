//! The sRGB transfer function, and colours written with it.

/// Returns the linear intensity of an sRGB-encoded value, both in [0, 1] (IEC 61966-2-1).
pub fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// Returns the sRGB-encoded value of a linear intensity, both in [0, 1] (IEC 61966-2-1).
pub fn srgb_from_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// Returns linear red, green and blue of six hexadecimal digits, sRGB-encoded.
pub fn rgb_from_hex(digits: &str) -> Option<[f64; 3]> {
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let packed = u32::from_str_radix(digits, 16).ok()?;
    let channel = |shift: u32| linear_from_srgb(f64::from(packed >> shift & 0xff) / 255.0);
    Some([channel(16), channel(8), channel(0)])
}
