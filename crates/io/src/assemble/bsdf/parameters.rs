//! Parameters that several bsdfs have.

use super::super::ior::index;
use super::super::surface_texture::Role;
use crate::query::{Input, POSITIVE, Query};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};
use std::ops::RangeInclusive;
use transport::bsdf::Distribution;

/// A parameter that may be a texture, with its name.
pub(super) struct Quantity<'a>(pub &'static str, pub Role, pub Input<'a>);

/// Smallest roughness that is not better called smooth.
const LEAST_ALPHA: f64 = 1e-4;
/// Index of air, and of the substance that Mitsuba's plastic is made of by default.
const AIR: f64 = 1.000277;
const POLYPROPYLENE: f64 = 1.49;

/// A spectrum or a texture.
pub(super) fn colour<'a>(q: &mut Query<'a, '_>, name: &'static str, default: f64) -> Quantity<'a> {
    let input = q.texture_or_spectrum(name, SpectrumValue::Uniform(default));
    Quantity(name, Role::Colour, input)
}

/// A number or a texture.
pub(super) fn number<'a>(q: &mut Query<'a, '_>, name: &'static str, default: f64) -> Quantity<'a> {
    let input = q.texture_or_spectrum(name, SpectrumValue::Uniform(default));
    Quantity(name, Role::Number, input)
}

/// The factors of what is reflected and of what is transmitted.
pub(super) const TINTS: [&str; 2] = ["specular_reflectance", "specular_transmittance"];

pub(super) fn tints<'a>(q: &mut Query<'a, '_>) -> [Quantity<'a>; 2] {
    TINTS.map(|name| colour(q, name, 1.0))
}

/// Microfacets, with their `alpha`.
pub(super) struct Facets<'a>(pub Distribution, pub Quantity<'a>);

pub(super) fn facets<'a>(q: &mut Query<'a, '_>) -> Facets<'a> {
    let distribution = q.one_of("distribution", &["beckmann", "ggx"]);
    // How directions are drawn is no part of the scene.
    q.boolean_or("sample_visible", true);
    let alike = q.texture_or_float_in("alpha", LEAST_ALPHA..=1.0, 0.1);
    let mean = across_and_along(q).map(|mean| Input::Spectrum(SpectrumValue::Uniform(mean)));
    let input = mean.unwrap_or(alike);
    Facets(
        [Distribution::Beckmann, Distribution::Ggx][distribution],
        Quantity("alpha", Role::Number, input),
    )
}

/// The geometric mean of the roughness in two directions, if it is given so.
fn across_and_along(q: &mut Query) -> Option<f64> {
    let names = ["alpha_u", "alpha_v"];
    if !names.iter().any(|name| q.has(name)) {
        return None;
    }
    if q.has("alpha") {
        q.error(
            "alpha",
            "give 'alpha', or 'alpha_u' and 'alpha_v', not both",
        );
    }
    let [u, v] = names.map(|name| q.float_in(name, LEAST_ALPHA..=1.0, None));
    Some((u * v).sqrt())
}

/// The index inside over that outside, which is air by default, of a surface on which it is the same everywhere.
pub(super) fn eta(q: &mut Query, inside: f64) -> f64 {
    index(q, "int_ior").unwrap_or(inside) / index(q, "ext_ior").unwrap_or(AIR)
}

/// That of `pplastic`, which may give it as `eta`.
pub(super) fn polarized_eta(q: &mut Query) -> f64 {
    let quotient = eta(q, POLYPROPYLENE);
    if !q.has("eta") {
        return quotient;
    }
    if q.has("int_ior") || q.has("ext_ior") {
        q.error("eta", "give 'eta', or 'int_ior' and 'ext_ior', not both");
    }
    q.float_in("eta", POSITIVE, None)
}

/// What a filter of polarized light lets pass of light that is not polarized: a share, times its transmittance.
pub(super) fn polarizing(q: &mut Query) -> (f64, SpectrumValue) {
    let transmittance = q.spectrum_or("transmittance", SpectrumValue::Uniform(1.0));
    match q.object().plugin.as_str() {
        "circular" => {
            q.boolean_or("left_handed", false);
            (0.5, transmittance)
        }
        "retarder" => {
            q.texture_or_spectrum("theta", SpectrumValue::Uniform(0.0));
            q.texture_or_spectrum("delta", SpectrumValue::Uniform(90.0));
            (1.0, transmittance)
        }
        _ => {
            q.texture_or_spectrum("theta", SpectrumValue::Uniform(0.0));
            q.boolean_or("polarizing", true);
            (0.5, transmittance)
        }
    }
}

/// Index, reflectances of base and coat, and whether colours deepen, of plastic.
pub(super) struct Coated<'a>(pub f64, pub [Quantity<'a>; 2], pub bool);

pub(super) fn coated<'a>(q: &mut Query<'a, '_>) -> Coated<'a> {
    let reflectances = [("diffuse_reflectance", 0.5), (TINTS[0], 1.0)];
    let reflectances = reflectances.map(|(name, default)| colour(q, name, default));
    let nonlinear = q.boolean_or("nonlinear", false);
    Coated(eta(q, POLYPROPYLENE), reflectances, nonlinear)
}

/// Nested bsdfs; none unless there are as many as there should be (reported then).
pub(super) fn nested<'a>(
    q: &mut Query<'a, '_>,
    count: RangeInclusive<usize>,
) -> Vec<&'a ObjectDescription> {
    let found: Vec<&ObjectDescription> = q
        .children(PluginKind::Bsdf)
        .into_iter()
        .map(|o| &**o)
        .collect();
    if count.contains(&found.len()) {
        return found;
    }
    let wanted = match (count.start(), count.end()) {
        (1, 1) => "one nested bsdf".to_owned(),
        (least, most) if least == most => format!("{least} nested bsdfs"),
        (least, most) => format!("{least} or {most} nested bsdfs"),
    };
    let message = format!("{} takes {wanted}, not {}", q.object().label(), found.len());
    q.error("type", message);
    Vec::new()
}
