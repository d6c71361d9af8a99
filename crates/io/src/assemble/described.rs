//! Facts about a description that are known before assembly.

use crate::scene::{ObjectDescription, PluginKind, Value};

/// Types of sensors that are meters.
pub(super) const METERS: [&str; 2] = ["fluencemeter", "irradiancemeter"];
/// Types of volumes whose index depends on the wavelength.
pub(super) const DISPERSION_LAWS: [&str; 2] = ["cauchy", "sellmeier"];
/// Parameter that gives a medium a fluorophore.
pub(super) const FLUOROPHORE: &str = "fluorophore_sigma_a";

/// Returns true if a sensor is a meter.
pub(super) fn is_meter(object: &ObjectDescription) -> bool {
    METERS.contains(&object.plugin.as_str())
}

/// Returns true if an object is an index or a phase function that depends on the wavelength of the
/// channel.
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

/// Returns true if an object is a medium with a fluorophore, which light of one channel excites to
/// emit light in other channels.
pub(super) fn fluoresces(object: &ObjectDescription) -> bool {
    let mut names = object.properties.iter().map(|p| p.name.as_str());
    object.kind == PluginKind::Medium && names.any(|name| name == FLUOROPHORE)
}

/// Returns true if a sensor's image depends on the wavelength of the channel through diffraction.
pub(super) fn diffracts(sensor: &ObjectDescription) -> bool {
    let mut properties = sensor.properties.iter();
    properties.any(|p| p.name == "diffraction" && p.value == Value::Boolean(true))
}
