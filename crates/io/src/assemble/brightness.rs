//! Spectra of emitted light.

use super::context::Context;
use super::texture_role::Role;
use crate::scene::{ObjectDescription, SpectrumValue};
use eikonal::Shown;
use transport::Spectrum;

/// Reads the emission spectrum `value` of the property `name`. Reports a negative value as an
/// error.
pub(super) fn light(
    value: &SpectrumValue,
    name: &str,
    object: &ObjectDescription,
    context: &mut Context,
) -> Spectrum {
    let property = object.properties.iter().find(|p| p.name == name);
    let location = property.map_or(&object.location, |p| &p.location);
    let value = context.loaded(value, location);
    if let Some(bad) = value.values().into_iter().find(|v| *v < 0.0) {
        context.error_at(
            location,
            format!("'{name}' is {}; light must not be negative", Shown(bad)),
        );
    }
    context.spectrum(&value, Role::Emission, location)
}
