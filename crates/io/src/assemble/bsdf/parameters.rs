//! Parameters that several bsdfs share.

use super::super::surface_texture::Role;
use crate::query::{Input, Query};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue, Value};
use crate::schema::substance::INDICES;
use std::ops::RangeInclusive;
use transport::bsdf::Distribution;

/// Parameter that may be a texture: its name, role and value.
pub(super) struct Quantity<'a>(pub &'static str, pub Role, pub Input<'a>);

/// Index of air.
const AIR: f64 = 1.000277;
/// Index of polypropylene, Mitsuba's default for plastic.
const POLYPROPYLENE: f64 = 1.49;

/// Reads an index, given as a number or by Mitsuba's name of a substance; `None` if it is not
/// given.
pub(super) fn index(query: &mut Query, name: &str) -> Option<f64> {
    if !query.has(name) {
        return None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name)?;
    if !matches!(property.value, Value::String(_)) {
        return Some(query.float(name));
    }
    let substance = query.word(name);
    let known = INDICES.iter().find(|(name, _)| *name == substance);
    known.map(|(_, n)| *n)
}

/// Reads a reflectance, given as a spectrum or a texture.
pub(super) fn colour<'a>(q: &mut Query<'a, '_>, name: &'static str) -> Quantity<'a> {
    let input = q.texture_or_spectrum(name);
    Quantity(name, Role::Reflectance, input)
}

/// Reads a number, given directly or as a texture.
pub(super) fn number<'a>(q: &mut Query<'a, '_>, name: &'static str) -> Quantity<'a> {
    let input = q.texture_or_spectrum(name);
    Quantity(name, Role::Number, input)
}

/// Names of the factors of reflected and transmitted light.
pub(super) const TINTS: [&str; 2] = ["specular_reflectance", "specular_transmittance"];

/// Reads the factors of reflected and transmitted light.
pub(super) fn tints<'a>(q: &mut Query<'a, '_>) -> [Quantity<'a>; 2] {
    TINTS.map(|name| colour(q, name))
}

/// Microfacet distribution with its roughness.
pub(super) struct Facets<'a> {
    pub distribution: Distribution,
    pub alphas: Alphas<'a>,
}

/// Roughness in all directions, or along ∂x/∂u and across it.
pub(super) enum Alphas<'a> {
    Alike(Quantity<'a>),
    Apart([Quantity<'a>; 2]),
}

/// Reads a microfacet distribution and its roughness.
pub(super) fn facets<'a>(q: &mut Query<'a, '_>) -> Facets<'a> {
    let distribution = match q.word("distribution") {
        "ggx" => Distribution::Ggx,
        _ => Distribution::Beckmann,
    };
    // Accept Mitsuba's choice of a sampling method, which does not affect the result.
    q.boolean("sample_visible");
    Facets {
        distribution,
        alphas: alphas(q),
    }
}

/// Reads the roughness, given as `alpha`, or as `alpha_u` and `alpha_v`.
pub(super) fn alphas<'a>(q: &mut Query<'a, '_>) -> Alphas<'a> {
    let names = ["alpha_u", "alpha_v"];
    let alpha =
        |q: &mut Query<'a, '_>, name| Quantity(name, Role::Number, q.texture_or_float(name));
    let given = names.map(|name| q.has(name));
    if given == [false; 2] {
        return Alphas::Alike(alpha(q, "alpha"));
    }
    if q.has("alpha") {
        q.error(
            "alpha",
            "give 'alpha', or 'alpha_u' and 'alpha_v', not both",
        );
    } else if given != [true; 2] {
        q.error(names[0], "give both 'alpha_u' and 'alpha_v'");
        return Alphas::Alike(alpha(q, "alpha"));
    }
    Alphas::Apart(names.map(|name| alpha(q, name)))
}

/// Reads the reflectances of the diffuse and the glossy part.
pub(super) fn reflectances<'a>(q: &mut Query<'a, '_>) -> [Quantity<'a>; 2] {
    ["diffuse_reflectance", TINTS[0]].map(|name| colour(q, name))
}

/// Layer over another surface.
pub(super) struct Layer<'a> {
    /// Index of the layer relative to the outside.
    pub eta: f64,
    pub sigma_a: Quantity<'a>,
    pub thickness: f64,
    pub specular_reflectance: Quantity<'a>,
}

/// Reads a layer. `inside` is its default index.
pub(super) fn layer<'a>(q: &mut Query<'a, '_>, inside: f64) -> Layer<'a> {
    Layer {
        eta: eta(q, inside),
        sigma_a: Quantity(
            "sigma_a",
            Role::Coefficient,
            q.texture_or_spectrum("sigma_a"),
        ),
        thickness: q.float("thickness"),
        specular_reflectance: colour(q, TINTS[0]),
    }
}

/// Reads the weights of the parts of a mixture.
pub(super) fn weights(q: &mut Query) -> Vec<f64> {
    let text = q.string("weights");
    let words = text.split([' ', ',', ';']).filter(|word| !word.is_empty());
    let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
    let valid = |weights: &Vec<f64>| {
        !weights.is_empty() && weights.iter().all(|w| w.is_finite() && *w >= 0.0)
    };
    numbers.filter(valid).unwrap_or_else(|| {
        let message = format!(
            "'weights' are numbers ≥ 0, one for each bsdf, as in \"0.7, 0.3\", not '{text}'"
        );
        q.error("weights", message);
        Vec::new()
    })
}

/// Reads the ratio of the index inside to the index outside, by default `inside` and air, for a
/// surface with constant indices.
pub(super) fn eta(q: &mut Query, inside: f64) -> f64 {
    index(q, "int_ior").unwrap_or(inside) / index(q, "ext_ior").unwrap_or(AIR)
}

/// Reads the index ratio of `pplastic`, which may give the ratio as `eta`.
pub(super) fn polarized_eta(q: &mut Query) -> f64 {
    let quotient = eta(q, POLYPROPYLENE);
    if !q.has("eta") {
        return quotient;
    }
    if q.has("int_ior") || q.has("ext_ior") {
        q.error("eta", "give 'eta', or 'int_ior' and 'ext_ior', not both");
    }
    q.float("eta")
}

/// Effect of a filter on polarised light.
pub(super) enum Element<'a> {
    Polarizer(Quantity<'a>),
    Circular { left_handed: bool },
    Retarder([Quantity<'a>; 2]),
    Neutral,
}

/// Reads a filter of polarised light and the transmittance of its material.
pub(super) fn filter<'a>(q: &mut Query<'a, '_>) -> (Element<'a>, SpectrumValue) {
    let transmittance = q.spectrum("transmittance");
    let element = match q.object().plugin.as_str() {
        "circular" => Element::Circular {
            left_handed: q.boolean("left_handed"),
        },
        "retarder" => Element::Retarder([number(q, "theta"), number(q, "delta")]),
        _ => {
            let theta = number(q, "theta");
            if q.boolean("polarizing") {
                Element::Polarizer(theta)
            } else {
                Element::Neutral
            }
        }
    };
    (element, transmittance)
}

/// Plastic: index ratio, reflectances of base and coat, and true if internal reflections deepen its
/// colours (`nonlinear`).
pub(super) struct Coated<'a>(pub f64, pub [Quantity<'a>; 2], pub bool);

/// Reads the parameters of plastic.
pub(super) fn coated<'a>(q: &mut Query<'a, '_>) -> Coated<'a> {
    let reflectances = reflectances(q);
    let nonlinear = q.boolean("nonlinear");
    Coated(eta(q, POLYPROPYLENE), reflectances, nonlinear)
}

/// Returns the nested bsdfs. Reports a wrong number of them, and returns none then.
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
