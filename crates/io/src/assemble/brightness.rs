//! Spectra of emitted light.

use super::context::Context;
use super::texture_role::Role;
use crate::diagnostic::lints;
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};
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
    // Other objects, such as media, have no light by default.
    let is_emitter = object.kind == PluginKind::Emitter && property.is_some();
    let values = value.values();
    if is_emitter && !values.is_empty() && values.into_iter().all(|v| v == 0.0) {
        let message = format!("{} emits no light: '{name}' is 0", object.label());
        let help = format!("give '{name}' a value above 0, or remove the emitter");
        let warning = lints::warning(lints::BLACK_EMITTER, message).help(help);
        context.diagnostics.push(warning.at(location));
    }
    context.spectrum(&value, Role::Emission, location)
}
