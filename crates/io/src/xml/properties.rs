//! Elements that set a parameter.

use glam::DVec3;

use super::element::{Attribute, Element};
use super::numbers::{self, report};
use super::spectra;
use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::{Property, SpectrumValue, Value};

/// Reads the parameter that an element sets; reports errors in it.
pub(super) fn property(element: &Element, diagnostics: &mut Diagnostics) -> Option<Property> {
    let (value, location) = match element.tag.as_str() {
        "point" | "vector" => vector(element, diagnostics)?,
        _ => single(element, diagnostics)?,
    };
    named(element, value, location, diagnostics)
}

/// Gives a value the name in the element's attribute `name`.
pub(super) fn named(
    element: &Element,
    value: Value,
    location: Location,
    diagnostics: &mut Diagnostics,
) -> Option<Property> {
    let name = element.require("name", diagnostics)?;
    let name_location = name.location.clone();
    Some(Property {
        name: name.value.clone(),
        value,
        name_location,
        location,
    })
}

fn single(element: &Element, diagnostics: &mut Diagnostics) -> Option<(Value, Location)> {
    if let ("spectrum", Some(file)) = (element.tag.as_str(), element.get("filename")) {
        element.allow(&["name", "filename"], diagnostics);
        let value = Value::Spectrum(SpectrumValue::File(file.value.clone()));
        return Some((value, file.location.clone()));
    }
    element.allow(&["name", "value"], diagnostics);
    let attribute = element.require("value", diagnostics)?;
    let value = match element.tag.as_str() {
        "float" => Value::Float(numbers::float(attribute, diagnostics)?),
        "integer" => Value::Integer(numbers::integer(attribute, diagnostics)?),
        "boolean" => Value::Boolean(numbers::boolean(attribute, diagnostics)?),
        "rgb" => Value::Spectrum(spectra::rgb(attribute, diagnostics)?),
        "srgb" => Value::Spectrum(spectra::srgb(attribute, diagnostics)?),
        "spectrum" => Value::Spectrum(spectra::spectrum(attribute, diagnostics)?),
        _ => Value::String(attribute.value.clone()),
    };
    Some((value, attribute.location.clone()))
}

/// Reads `<blackbody>`: a `temperature` in kelvin, with or without a K, and a `scale`.
pub(super) fn blackbody(element: &Element, diagnostics: &mut Diagnostics) -> Vec<Property> {
    element.allow(&["name", "temperature", "scale"], diagnostics);
    let temperature = element.require("temperature", diagnostics);
    let temperature = temperature.and_then(|attribute| {
        let kelvin = spectra::temperature(attribute, diagnostics)?;
        Some((attribute, kelvin))
    });
    let scale = element.get("scale").and_then(|attribute| {
        let scale = numbers::float(attribute, diagnostics)?;
        Some((attribute, scale))
    });
    let property = |(attribute, value): (&Attribute, f64)| Property {
        name: attribute.name.clone(),
        value: Value::Float(value),
        name_location: attribute.name_location.clone(),
        location: attribute.location.clone(),
    };
    let found = [temperature, scale].into_iter().flatten();
    found.map(property).collect()
}

fn vector(element: &Element, diagnostics: &mut Diagnostics) -> Option<(Value, Location)> {
    element.allow(&["name", "value", "x", "y", "z"], diagnostics);
    let value = xyz(element, 0.0, diagnostics)?;
    let location = element
        .get("value")
        .map_or(&element.location, |a| &a.location)
        .clone();
    let value = if element.tag == "point" {
        Value::Point(value)
    } else {
        Value::Vector(value)
    };
    Some((value, location))
}

/// Reads three components: `value` with one or three numbers, or any of `x`, `y` and `z`.
/// Components that are not given are `missing`.
pub(super) fn xyz(element: &Element, missing: f64, diagnostics: &mut Diagnostics) -> Option<DVec3> {
    let axes = ["x", "y", "z"].map(|axis| element.get(axis));
    let Some(value) = element.get("value") else {
        if axes.iter().all(Option::is_none) {
            let message = format!("<{}> needs the attribute 'value' or x, y, z", element.tag);
            diagnostics.push(Diagnostic::error(message).at(&element.location));
            return None;
        }
        let component = |axis: Option<&Attribute>, diagnostics: &mut Diagnostics| match axis {
            Some(attribute) => numbers::float(attribute, diagnostics),
            None => Some(missing),
        };
        let [x, y, z] = axes.map(|axis| component(axis, diagnostics));
        return Some(DVec3::new(x?, y?, z?));
    };
    if let Some(axis) = axes.into_iter().flatten().next() {
        let message = format!("'{}' and 'value' exclude each other", axis.name);
        diagnostics.push(Diagnostic::error(message).at(&axis.name_location));
        return None;
    }
    triple(value, diagnostics)
}

/// Reads three numbers, or a single number for all three components.
pub(super) fn triple(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<DVec3> {
    match numbers::floats(attribute, diagnostics)?[..] {
        [v] => Some(DVec3::splat(v)),
        [x, y, z] => Some(DVec3::new(x, y, z)),
        ref other => {
            let message = format!("expected three numbers, found {}", other.len());
            report(attribute, &message, diagnostics);
            None
        }
    }
}
