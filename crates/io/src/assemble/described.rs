//! What a description says without being assembled.

use crate::scene::{ObjectDescription, PluginKind, Value};

/// Sensors that are meters.
pub(super) const METERS: [&str; 2] = ["fluencemeter", "irradiancemeter"];
/// Volumes whose index depends on the wavelength.
pub(super) const DISPERSION_LAWS: [&str; 2] = ["cauchy", "sellmeier"];

/// Whether a sensor is a meter.
pub(super) fn is_meter(object: &ObjectDescription) -> bool {
    METERS.contains(&object.plugin.as_str())
}

/// Whether an object is an index, or a phase function, that follows the wavelength of the channel.
pub(super) fn disperses(object: &ObjectDescription) -> bool {
    let gives = |name: &str| object.properties.iter().any(|p| p.name == name);
    let gases = ["gladstone_dale", "standard_atmosphere"];
    let of_air =
        gases.contains(&object.plugin.as_str()) && !gives("wavelength") && !gives("constant");
    match object.kind {
        PluginKind::Volume => of_air || DISPERSION_LAWS.contains(&object.plugin.as_str()),
        PluginKind::Phase => object.plugin == "mie" && !gives("wavelength"),
        _ => false,
    }
}

/// Whether a sensor's image depends on the wavelength of the channel.
pub(super) fn diffracts(sensor: &ObjectDescription) -> bool {
    let mut properties = sensor.properties.iter();
    properties.any(|p| p.name == "diffraction" && p.value == Value::Boolean(true))
}
