//! Spectra and colours in attributes.

use super::element::Attribute;
use super::numbers::{self, report};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::draft::shorten;
use crate::scene::{SpectrumValue, linear_from_srgb, rgb_from_hex};
use eikonal::Shown;

/// Reads `<rgb>`: three numbers, a single number for all channels, or `#rrggbb` (sRGB, converted to
/// linear).
pub(super) fn rgb(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<SpectrumValue> {
    if let Some(digits) = attribute.value.trim().strip_prefix('#') {
        return rgb_from_hex(digits).map(SpectrumValue::Rgb).or_else(|| {
            let message = format!("'#{}' is not a colour like #ff8800", shorten(digits));
            report(attribute, &message, diagnostics);
            None
        });
    }
    match numbers::floats(attribute, diagnostics)?[..] {
        [v] => Some(SpectrumValue::Rgb([v; 3])),
        [r, g, b] => Some(SpectrumValue::Rgb([r, g, b])),
        ref other => {
            let message = format!("expected one or three numbers, found {}", other.len());
            report(attribute, &message, diagnostics);
            None
        }
    }
}

/// Reads `<srgb>`, which is like `<rgb>` with numbers that are sRGB-encoded too.
pub(super) fn srgb(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<SpectrumValue> {
    match rgb(attribute, diagnostics)? {
        SpectrumValue::Rgb(rgb) if !attribute.value.trim().starts_with('#') => {
            Some(SpectrumValue::Rgb(rgb.map(linear_from_srgb)))
        }
        value => Some(value),
    }
}

/// Reads a temperature in kelvin, greater than 0: a number, with or without a K.
pub(super) fn temperature(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<f64> {
    let text = attribute.value.trim();
    let number = text.strip_suffix(['K', 'k']).unwrap_or(text).trim().parse();
    let kelvin = number.ok().filter(|t: &f64| *t > 0.0 && t.is_finite());
    if kelvin.is_none() {
        let message = format!(
            "expected a temperature in kelvin such as 5000K, greater than 0, found '{}'",
            shorten(text)
        );
        report(attribute, &message, diagnostics);
    }
    kelvin
}

/// Reads `<spectrum>`: a number, pairs `wavelength:value` with increasing wavelengths (nm), or, as
/// in Mitsuba 0.6, red, green and blue.
pub(super) fn spectrum(
    attribute: &Attribute,
    diagnostics: &mut Diagnostics,
) -> Option<SpectrumValue> {
    if !attribute.value.contains(':') {
        return match numbers::floats(attribute, diagnostics)?[..] {
            [v] => Some(SpectrumValue::EqualEnergy(v)),
            [r, g, b] => Some(SpectrumValue::Rgb([r, g, b])),
            ref other => {
                let message = format!(
                    "expected one number, three, or pairs 'wavelength:value', found {} numbers",
                    other.len()
                );
                report(attribute, &message, diagnostics);
                None
            }
        };
    }
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for range in numbers::tokens(&attribute.value) {
        let text = &attribute.value[range.clone()];
        let Some(colon) = text.find(':').map(|i| i + range.start) else {
            let message = format!(
                "expected a pair 'wavelength:value', found '{}'",
                shorten(text)
            );
            diagnostics.push(Diagnostic::error(message).at(&attribute.part(range)));
            return None;
        };
        let wavelength = numbers::token(attribute, range.start..colon, diagnostics)?;
        let value = numbers::token(attribute, colon + 1..range.end, diagnostics)?;
        let previous = pairs.last().map_or(0.0, |(w, _)| *w);
        if wavelength <= previous {
            let message = format!(
                "wavelengths must increase: {} after {}",
                Shown(wavelength),
                Shown(previous)
            );
            diagnostics.push(Diagnostic::error(message).at(&attribute.part(range)));
            return None;
        }
        pairs.push((wavelength, value));
    }
    Some(SpectrumValue::Sampled(pairs))
}
