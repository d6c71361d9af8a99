//! Conversion of spectra to red, green and blue, or to luminance.

use super::texture_role::Role;
use crate::cie;
use crate::scene::SpectrumValue;
use eikonal::Shown;

/// Spectrum converted to a number or a colour.
pub(super) struct Seen {
    pub value: SpectrumValue,
    /// Colour before clipping, if it was clipped.
    pub clipped: Option<[f64; 3]>,
}

/// Converts a spectrum to a colour or a number, as Mitsuba 3.9.1 does: emission is converted
/// directly, all other roles under daylight (D65).
///
/// # Errors
///
/// A list of less than two wavelengths, which covers no interval.
pub(super) fn seen(value: &SpectrumValue, role: Role) -> Result<Seen, String> {
    let plain = |value| {
        Ok(Seen {
            value,
            clipped: None,
        })
    };
    let rgb = match value {
        SpectrumValue::EqualEnergy(v) if role == Role::Emission => {
            cie::of_xyz([1.0; 3]).map(|part| part * v)
        }
        SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) | SpectrumValue::D65(v) => {
            return plain(SpectrumValue::Uniform(*v));
        }
        SpectrumValue::Rgb(rgb) => return plain(in_role(*rgb, role)),
        SpectrumValue::Sampled(pairs) if pairs.len() < 2 => {
            return Err("a list of one wavelength has no colour: list at least two".to_owned());
        }
        SpectrumValue::Sampled(_) | SpectrumValue::Blackbody { .. } | SpectrumValue::File(_) => {
            let light = |nm| {
                if role == Role::Emission {
                    1.0
                } else {
                    cie::d65(nm)
                }
            };
            cie::srgb(|nm| covered(value, nm).unwrap_or(0.0) * light(nm))
        }
    };
    let most = match role {
        Role::Emission | Role::Coefficient | Role::Vector => f64::INFINITY,
        Role::Reflectance | Role::Number | Role::Height => 1.0,
    };
    let within = rgb.map(|v| v.clamp(0.0, most));
    Ok(Seen {
        value: in_role(within, role),
        clipped: (within != rgb).then_some(rgb),
    })
}

/// Returns the text of a warning about a clipped colour.
pub(super) fn clipping(rgb: [f64; 3], role: Role) -> String {
    let [r, g, b] = rgb.map(Shown::rounded);
    let limits = match role {
        Role::Emission | Role::Coefficient | Role::Vector => "at least 0",
        Role::Reflectance | Role::Number | Role::Height => "0 to 1",
    };
    format!("red, green and blue of the spectrum are {r}, {g}, {b}: clipped to {limits}")
}

/// Converts a colour to the value of a role: roles that are one number get the luminance.
fn in_role(rgb: [f64; 3], role: Role) -> SpectrumValue {
    match role {
        Role::Number | Role::Height => SpectrumValue::Uniform(luminance(rgb)),
        _ => SpectrumValue::Rgb(rgb),
    }
}

/// Weights of linear sRGB in luminance (ITU-R BT.709).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Returns the luminance of linear sRGB.
pub(super) fn luminance(rgb: [f64; 3]) -> f64 {
    rgb.iter().zip(LUMINANCE).map(|(v, w)| v * w).sum()
}

/// Returns a spectrum at a wavelength in nm, or `None` outside the wavelengths that it covers.
fn covered(value: &SpectrumValue, nm: f64) -> Option<f64> {
    match value {
        SpectrumValue::Sampled(pairs) => {
            let ends = [pairs.first()?.0, pairs.last()?.0];
            (ends[0] <= nm && nm <= ends[1]).then(|| interpolate(pairs, nm))
        }
        _ => at(value, nm),
    }
}

/// Returns a spectrum at a wavelength in nm; lists are constant beyond their ends. `None` for a
/// colour and for a file that has not been read.
pub(super) fn at(value: &SpectrumValue, nm: f64) -> Option<f64> {
    Some(match value {
        SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) => *v,
        SpectrumValue::Rgb(_) | SpectrumValue::File(_) => return None,
        SpectrumValue::Sampled(pairs) => interpolate(pairs, nm),
        SpectrumValue::D65(scale) => scale * cie::d65(nm),
        SpectrumValue::Blackbody {
            temperature,
            scale,
            range: [min, max],
        } if *min <= nm && nm <= *max => scale * cie::planck(nm, *temperature),
        SpectrumValue::Blackbody { .. } => 0.0,
    })
}

/// Interpolates linearly between samples, which are in order of wavelength. Values are constant
/// beyond the ends.
fn interpolate(samples: &[(f64, f64)], nm: f64) -> f64 {
    let i = samples.partition_point(|(w, _)| *w <= nm);
    match (i.checked_sub(1).map(|k| samples[k]), samples.get(i)) {
        (Some((w0, v0)), Some((w1, v1))) => v0 + (v1 - v0) * (nm - w0) / (w1 - w0),
        (Some((_, v)), None) | (None, Some(&(_, v))) => v,
        (None, None) => 0.0,
    }
}
