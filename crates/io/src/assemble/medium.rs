//! Media of the scene.

use super::brightness::light;
use super::channels::Channels;
use super::context::Context;
use super::fluorescence::{Fluorophore, with_fluorophore};
use super::suspension::{self, Suspension};
use super::texture_role::Role;
use super::velocity::Written;
use super::{field, phase, texture, tissue};
use crate::query::{Input, Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};
use crate::schema::substance::{TURBID, Turbid};
use eikonal::Field;
use eikonal::field::Constant;
use transport::Spectrum;
use transport::medium::Medium;
use transport::phase::Phase;
use transport::scene::MediumId;
use transport::volume::VolumeTexture;

/// Returns the medium that an object describes. All references to the object give the same medium.
pub(super) fn medium(object: &ObjectDescription, context: &mut Context) -> MediumId {
    if let Some(id) = context.known_medium(object.number) {
        return id;
    }
    let before = context.grids.len();
    let (medium, open) = build(object, context);
    let id = context.media.len();
    let grids = context.grids.iter_mut().skip(before);
    grids.for_each(|grid| grid.medium = Some(id));
    let id = context.add_medium(medium, open, Some(object.location.clone()));
    context.remember_medium(object.number, id);
    id
}

/// Builds a medium. The boolean is true if its index is left open.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> (Medium, bool) {
    let name = object.id.clone().unwrap_or_else(|| object.plugin.clone());
    let index = field::named(object, "ior", context);
    let open = index.is_none();
    let index = index.unwrap_or_else(|| Constant::new(1.0).into());
    let medium = match object.plugin.as_str() {
        "homogeneous" | "heterogeneous" => scattering(object, name, index, context),
        "transparent" => {
            let mut query = Query::new(object, context.diagnostics);
            query.has("ior");
            query.finish(&[]);
            Medium::transparent(name, index)
        }
        _ => {
            unknown_plugin(object, context.diagnostics);
            Medium::transparent(name, index)
        }
    };
    (medium, open)
}

/// Builds a medium that scatters and absorbs light.
fn scattering(
    object: &ObjectDescription,
    name: String,
    index: Field,
    context: &mut Context,
) -> Medium {
    let mut query = Query::new(object, context.diagnostics);
    query.has("ior");
    // Accept parameters that only control Mitsuba's sampling.
    query.boolean("sample_emitters");
    query.boolean("has_spectral_extinction");
    // Read the coefficients: of a tissue, of a material, or σ_s and σ_a, or extinction and albedo.
    let scale = query.float("scale");
    let velocity = Written::of(&mut query);
    let fluorophore = Fluorophore::of(&mut query);
    let concentration = suspension::concentration(&mut query);
    let by_parts = concentration.is_some() || query.has("sigma_s") || query.has("sigma_a");
    let material = material(&mut query, context.channels);
    if let Some(named) = tissue::named(&mut query) {
        query.finish(&[]);
        let velocity = velocity.and_then(|written| written.build(context));
        let medium = Medium {
            velocity,
            ..named.medium(object, name, index, scale, context)
        };
        return with_fluorophore(fluorophore, medium, object, context);
    }
    let (sigma_t, albedo) = if let Some(turbid) = material {
        let [s, a] = [turbid.scattering, turbid.absorption].map(SpectrumValue::Rgb);
        (None, Some((s, a)))
    } else if by_parts {
        let s = query.spectrum("sigma_s");
        let a = query.spectrum("sigma_a");
        if query.has("sigma_t") || query.has("albedo") {
            query.error(
                "sigma_t",
                "give sigma_s and sigma_a, or sigma_t and albedo, not both",
            );
        }
        (None, Some((s, a)))
    } else {
        let inputs = (
            query.volume_or_spectrum("sigma_t"),
            query.volume_or_spectrum("albedo"),
        );
        (Some(inputs), None)
    };
    // Read phase function and emission.
    let phase = query.child(PluginKind::Phase).cloned();
    if let (Some(turbid), Some(phase)) = (material, &phase)
        && phase.plugin != "isotropic"
    {
        let message = format!(
            "the coefficients of '{}' are reduced ones, for light that is scattered evenly: leave the phase function \
             out, or give sigma_s and sigma_a",
            turbid.name
        );
        query.error("material", message);
    }
    let emits = query.has("emission");
    let emission = query.volume_or_spectrum("emission");
    query.finish(&["sigma_t", "albedo", "emission"]);
    let velocity = velocity.and_then(|written| written.build(context));
    let far = f64::MAX;
    let emission = emits.then(|| emission_of(emission, object, context));
    let plugin = phase.as_ref().map(|p| p.plugin.as_str());
    let built = phase.as_ref().map(|p| phase::build(p, context));
    let phase = built.unwrap_or_else(Phase::isotropic);
    if phase.flakes().is_some() && emits {
        let message = "a medium with the phase function sggx cannot emit: its absorption depends on the direction";
        context.error_at(&object.location, message);
    }
    let (sigma_t, albedo) = match (sigma_t, albedo) {
        (Some((sigma_t, albedo)), _) => (
            texture::texture(sigma_t, object, "sigma_t", [0.0, far], context),
            texture::texture(albedo, object, "albedo", [0.0, 1.0], context),
        ),
        (None, Some((s, a))) => {
            let [s, a] = coefficients(object, [s, a], context);
            let medium = Suspension {
                phase: &phase,
                plugin,
                absorption: a,
            };
            let held = concentration.map(|c| c.in_medium(&medium, object, context));
            from_parts(held.unwrap_or([s, a]))
        }
        (None, None) => return Medium::transparent(name, index),
    };
    let medium = Medium {
        name,
        index,
        sigma_t,
        scale,
        albedo,
        phase,
        emission,
        velocity,
        fluorescence: None,
        labels: None,
    };
    with_fluorophore(fluorophore, medium, object, context)
}

/// Reads the radiance of a black body at the temperature of the medium.
fn emission_of(input: Input, object: &ObjectDescription, context: &mut Context) -> VolumeTexture {
    match input {
        Input::Spectrum(value) => {
            VolumeTexture::Uniform(light(&value, "emission", object, context))
        }
        Input::Object(_) => texture::texture(input, object, "emission", [0.0, f64::MAX], context),
    }
}

/// Returns the material that a medium names. A medium with a material may not give coefficients.
fn material(query: &mut Query, channels: &Channels) -> Option<&'static Turbid> {
    let name = query.word("material");
    let material = TURBID.iter().find(|turbid| turbid.name == name)?;
    if matches!(channels, Channels::Wavelengths { .. }) {
        let message =
            "materials are known in red, green and blue; a spectral film needs sigma_s and sigma_a";
        query.error("material", message);
        return None;
    }
    let own = ["sigma_t", "albedo", "sigma_s", "sigma_a"];
    if let Some(name) = own.into_iter().find(|name| query.has(name)) {
        query.error(name, "give coefficients or a material, not both");
    }
    Some(material)
}

/// Returns σ_s and σ_a in the channels of the film.
fn coefficients(
    object: &ObjectDescription,
    parts: [SpectrumValue; 2],
    context: &mut Context,
) -> [Spectrum; 2] {
    let [sigma_s, sigma_a] = parts.map(|v| context.loaded(&v, &object.location).into_owned());
    let negative = |v: &SpectrumValue| v.values().iter().any(|v| *v < 0.0);
    if negative(&sigma_s) || negative(&sigma_a) {
        context.error_at(&object.location, "sigma_s and sigma_a must not be negative");
    }
    [sigma_s, sigma_a].map(|v| context.spectrum(&v, Role::Coefficient, &object.location))
}

/// Returns the extinction coefficient and the albedo for σ_s and σ_a.
fn from_parts([s, a]: [Spectrum; 2]) -> (VolumeTexture, VolumeTexture) {
    let total = s + a;
    let albedo = Spectrum(std::array::from_fn(|c| {
        if total[c] > 0.0 { s[c] / total[c] } else { 0.0 }
    }));
    (
        VolumeTexture::Uniform(total),
        VolumeTexture::Uniform(albedo),
    )
}
