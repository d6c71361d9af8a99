//! Translations that renaming alone cannot express.

use super::{Draft, Implied, imply, number, textures};
use crate::diagnostic::{Diagnostic, Diagnostics, Location, lints};
use crate::scene::{PluginKind, Value};
use glam::{DMat4, DVec3};

/// Translates parameters that depend on others, under the plugin's name in its own dialect.
pub(super) fn before(draft: &mut Draft, old: bool, diagnostics: &mut Diagnostics) {
    match (draft.kind, draft.plugin.as_str()) {
        (PluginKind::Volume, "splinevolume") => boxed(draft, diagnostics),
        (PluginKind::Volume, "gridvolume") if old => boxed(draft, diagnostics),
        (PluginKind::Texture, "bitmap" | "checkerboard") if old => textures::place(draft),
        (PluginKind::Bsdf, "conductor" | "roughconductor") if old => metal(draft),
        (PluginKind::Integrator, "ao") if old => occlusion(draft, diagnostics),
        (PluginKind::Emitter, "sky" | "sun" | "sunsky") if old => daylight(draft, diagnostics),
        (PluginKind::Film, _) if old => {
            transient(draft);
            unmodulated(draft);
            bounces(draft, diagnostics);
        }
        (PluginKind::Medium, "heterogeneousrefractive") => coefficients(draft, diagnostics),
        (PluginKind::Medium, _) if old && draft.names.contains_key("material") => {
            coefficients(draft, diagnostics)
        }
        _ => {}
    }
}

/// Sets copper as the default metal. Numbers take precedence over a name.
fn metal(draft: &mut Draft) {
    match ["eta", "k"].map(|name| draft.names.contains_key(name)) {
        [false, false] => imply(draft, "material", Implied::String("Cu")),
        [true, true] => {
            super::drop(draft, &["material"]);
        }
        _ => {}
    }
}

/// Reports the integrator for ambient occlusion, which does not compute light.
fn occlusion(draft: &Draft, diagnostics: &mut Diagnostics) {
    let message = "ambient occlusion is not rendered by an integrator of its own";
    let help = "take the integrator 'direct', diffuse surfaces of reflectance 1 and the emitter 'constant': what it shows is the same";
    let diagnostic = Diagnostic::error(message).help(help.to_owned());
    diagnostics.push(diagnostic.at(&draft.plugin_location));
}

/// Translates `min` and `max`, which place the samples in a box that replaces the file's.
fn boxed(draft: &mut Draft, diagnostics: &mut Diagnostics) {
    let [Some((min, _)), Some((max, location))] = ["min", "max"].map(|name| point(draft, name))
    else {
        return;
    };
    super::drop(draft, &["min", "max"]);
    let size = max - min;
    if size.min_element() <= 0.0 {
        let message = "'max' must be greater than 'min' in every coordinate";
        diagnostics.push(Diagnostic::error(message).at(&location));
        return;
    }
    let to_world = draft.properties.iter().find(|p| p.name == "to_world");
    let before = match to_world.map(|p| &p.value) {
        Some(Value::Transform(matrix)) => *matrix,
        _ => DMat4::IDENTITY,
    };
    let into = DMat4::from_translation(min) * DMat4::from_scale(size);
    draft.set("to_world", Value::Transform(before * into));
    imply(draft, "use_grid_bbox", Implied::Boolean(false));
}

fn point(draft: &Draft, name: &str) -> Option<(DVec3, Location)> {
    let property = draft.properties.iter().find(|p| p.name == name)?;
    match property.value {
        Value::Point(v) | Value::Vector(v) => Some((v, property.location.clone())),
        _ => None,
    }
}

/// Translates the fork's earlier films: `transient` with other names for bounds and bin width.
fn transient(draft: &mut Draft) {
    let property = draft.properties.iter().find(|p| p.name == "transient");
    let Some(Value::Boolean(is_transient)) = property.map(|p| &p.value) else {
        return;
    };
    let bounds = [
        ("path_min", "min_bound"),
        ("path_max", "max_bound"),
        ("path_sample", "bin_width"),
    ];
    if *is_transient {
        for (from, to) in bounds {
            draft.rename(from, to);
        }
        draft.set("decomposition", Value::String("transient".to_owned()));
    } else {
        super::drop(draft, &bounds.map(|(from, _)| from));
    }
    super::drop(draft, &["transient"]);
}

/// Drops the modulation of the fork's films if it is `none`; morgana supports no other.
fn unmodulated(draft: &mut Draft) {
    let property = draft.properties.iter().find(|p| p.name == "modulation");
    let is_none =
        |value: &Value| matches!(value, Value::String(word) if word.eq_ignore_ascii_case("none"));
    if property.is_some_and(|p| is_none(&p.value)) {
        super::drop(draft, &["modulation", "lambda", "phase"]);
    }
}

/// Translates the decomposition of the fork's films: `none` means no decomposition, bins have a
/// width of 1 by default, and bounces have bounds like lengths.
fn bounces(draft: &mut Draft, diagnostics: &mut Diagnostics) {
    let property = draft.properties.iter().find(|p| p.name == "decomposition");
    let Some(Value::String(word)) = property.map(|p| &p.value) else {
        return;
    };
    match word.to_ascii_lowercase().as_str() {
        "none" => {
            super::drop(
                draft,
                &["decomposition", "min_bound", "max_bound", "bin_width"],
            );
        }
        "transient" => imply(draft, "bin_width", Implied::Float(1.0)),
        "bounce" => {
            let bounds = ["min_bound", "max_bound"].map(|name| number(draft, name, 0.0));
            let width = number(draft, "bin_width", 1.0);
            if bounds[0] != 0.0 || width != 1.0 {
                let message = "bounces are separated one by one, from none: 'minBound' must be 0, 'binWidth' 1";
                diagnostics.push(Diagnostic::error(message).at(&draft.plugin_location));
            }
            super::drop(draft, &["min_bound", "max_bound", "bin_width"]);
            let most = (bounds[1].ceil() - 1.0).max(0.0);
            imply(draft, "max_bounces", Implied::Integer(most as i64));
        }
        _ => {}
    }
}

/// Reports a medium of the fork without coefficients, which takes them from a material, named or
/// not. The fork's materials use other units, and one material differs from its published numbers.
fn coefficients(draft: &mut Draft, diagnostics: &mut Diagnostics) {
    let own = [
        "sigma_t", "sigma_s", "sigma_a", "sigmaT", "sigmaS", "sigmaA",
    ];
    if own.iter().any(|name| draft.names.contains_key(*name)) {
        return;
    }
    let message = format!(
        "'{}' takes its coefficients from a material, which scenes of older versions cannot name here",
        draft.plugin
    );
    let help = "give sigma_s and sigma_a, or sigma_t and albedo, per scene unit";
    let diagnostic = Diagnostic::error(message).help(help.to_owned());
    diagnostics.push(diagnostic.at(&draft.plugin_location));
}

/// Changes the format of a film of X, Y and Z to red, green and blue. Returns the old format.
pub(super) fn tristimulus(draft: &mut Draft) -> Option<String> {
    let film = draft.kind == PluginKind::Film;
    let named = |p: &&mut crate::scene::Property| film && p.name == "pixel_format";
    let Value::String(format) = &mut draft.properties.iter_mut().find(named)?.value else {
        return None;
    };
    let plain = match format.to_ascii_lowercase().as_str() {
        "xyz" => "rgb",
        "xyza" => "rgba",
        _ => return None,
    };
    Some(std::mem::replace(format, plain.to_owned()))
}

/// Removes the opacity from a film's format. Returns true if there was one.
pub(super) fn drops_alpha(draft: &mut Draft) -> bool {
    let film = draft.kind == PluginKind::Film;
    let format = draft
        .properties
        .iter_mut()
        .find(|p| film && p.name == "pixel_format");
    let Some(Value::String(format)) = format.map(|p| &mut p.value) else {
        return false;
    };
    let plain = match format.to_ascii_lowercase().as_str() {
        "rgba" => "rgb",
        "luminance_alpha" | "luminancealpha" => "luminance",
        _ => return false,
    };
    *format = plain.to_owned();
    true
}

/// Replaces facets of Ashikhmin and Shirley by Beckmann facets with an equal roughness. Older
/// versions compute the exponent from this roughness. The two agree for smooth surfaces. Returns
/// the old name if it was replaced.
pub(super) fn other_facets(draft: &mut Draft) -> Option<String> {
    let bsdf = draft.kind == PluginKind::Bsdf;
    let named = |p: &&mut crate::scene::Property| bsdf && p.name == "distribution";
    let property = draft.properties.iter_mut().find(named)?;
    let Value::String(word) = &mut property.value else {
        return None;
    };
    let known = ["phong", "as"].contains(&word.to_ascii_lowercase().as_str());
    known.then(|| std::mem::replace(word, "beckmann".to_owned()))
}

/// Map from the axes of Mitsuba 3's sky (z up, −x to the north) to the axes of Mitsuba 0.6's sky (y
/// up, −z to the north).
const OLDER_SKY: DMat4 = DMat4::from_cols_array(&[
    0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
]);
/// Angular diameter of the sun in degrees.
const SUN_APERTURE: f64 = 0.5358;
/// Angular diameter in degrees that replaces a point sun.
const MIN_APERTURE: f64 = 0.01;

/// Translates the sky and sun of Mitsuba 0.6: one or two plugins with a common scale and other
/// axes.
fn daylight(draft: &mut Draft, diagnostics: &mut Diagnostics) {
    let scale = number(draft, "scale", 1.0);
    let radius = number(draft, "sun_radius_scale", 1.0);
    let plugin = std::mem::replace(&mut draft.plugin, "sunsky".to_owned());
    super::drop(draft, &["scale", "sun_radius_scale"]);
    let scales = [("sky_scale", "sun"), ("sun_scale", "sky")];
    for (name, other) in scales {
        if plugin == other {
            draft.set(name, Value::Float(0.0));
        } else {
            imply(draft, name, Implied::Float(scale));
        }
    }
    imply(draft, "albedo", Implied::Float(0.2));
    let aperture = (SUN_APERTURE * radius).max(MIN_APERTURE);
    draft.set("sun_aperture", Value::Float(aperture));
    let to_world = draft.properties.iter().find(|p| p.name == "to_world");
    let before = match to_world.map(|p| &p.value) {
        Some(Value::Transform(matrix)) => *matrix,
        _ => DMat4::IDENTITY,
    };
    draft.set("to_world", Value::Transform(before * OLDER_SKY));
    let message =
        format!("'{plugin}' is read as the 'sunsky' of Mitsuba 3, whose sun is another model");
    diagnostics.push(lints::note(lints::OTHER_DIALECT, message).at(&draft.plugin_location));
}
