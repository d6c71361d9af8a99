//! Parameters that several bsdfs have.

use super::super::surface_texture::Role;
use crate::query::{INDEX, Input, POSITIVE, Query};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue, Value};
use crate::schema::substance::{INDICES, NAMES};
use std::ops::RangeInclusive;
use transport::bsdf::Distribution;

/// A parameter that may be a texture, with its name.
pub(super) struct Quantity<'a>(pub &'static str, pub Role, pub Input<'a>);

/// Smallest roughness that is not better called smooth.
const LEAST_ALPHA: f64 = 1e-4;
/// Index of air, and of the substance that Mitsuba's plastic is made of by default.
const AIR: f64 = 1.000277;
const POLYPROPYLENE: f64 = 1.49;

/// An index given as a number or by the name that Mitsuba gives a substance; `None` if it is not given.
pub(super) fn index(query: &mut Query, name: &str) -> Option<f64> {
    if !query.has(name) {
        return None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name)?;
    if !matches!(property.value, Value::String(_)) {
        return Some(query.float_in(name, INDEX, 1.0));
    }
    Some(INDICES[query.one_of(name, &NAMES)].1)
}

/// A spectrum or a texture.
pub(super) fn colour<'a>(q: &mut Query<'a, '_>, name: &'static str, default: f64) -> Quantity<'a> {
    let input = q.texture_or_spectrum(name, SpectrumValue::Uniform(default));
    Quantity(name, Role::Reflectance, input)
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

/// Microfacets, with their roughness.
pub(super) struct Facets<'a> {
    pub distribution: Distribution,
    pub alphas: Alphas<'a>,
}

/// A roughness, or one along ∂x/∂u and one across.
pub(super) enum Alphas<'a> {
    Alike(Quantity<'a>),
    Apart([Quantity<'a>; 2]),
}

pub(super) fn facets<'a>(q: &mut Query<'a, '_>) -> Facets<'a> {
    let distribution = q.one_of("distribution", &["beckmann", "ggx"]);
    // How directions are drawn is no part of the scene.
    q.boolean_or("sample_visible", true);
    Facets {
        distribution: [Distribution::Beckmann, Distribution::Ggx][distribution],
        alphas: alphas(q),
    }
}

/// Roughness where none is given.
const ALPHA: f64 = 0.1;

pub(super) fn alphas<'a>(q: &mut Query<'a, '_>) -> Alphas<'a> {
    let names = ["alpha_u", "alpha_v"];
    let mut alpha = |name| {
        let input = q.texture_or_float_in(name, LEAST_ALPHA..=1.0, ALPHA);
        Quantity(name, Role::Number, input)
    };
    let (alike, apart) = (alpha("alpha"), names.map(alpha));
    let given = names.map(|name| q.has(name));
    if given == [false; 2] {
        return Alphas::Alike(alike);
    }
    if q.has("alpha") {
        q.error(
            "alpha",
            "give 'alpha', or 'alpha_u' and 'alpha_v', not both",
        );
    } else if given != [true; 2] {
        q.error(names[0], "give both 'alpha_u' and 'alpha_v'");
    }
    Alphas::Apart(apart)
}

/// Reflectances of Phong's and Ward's surfaces, diffuse and glossy.
pub(super) fn glossy<'a>(q: &mut Query<'a, '_>) -> [Quantity<'a>; 2] {
    [("diffuse_reflectance", 0.5), (TINTS[0], 0.2)].map(|(name, default)| colour(q, name, default))
}

/// A layer over another surface.
pub(super) struct Layer<'a> {
    /// Its index over that outside.
    pub eta: f64,
    pub sigma_a: Quantity<'a>,
    pub thickness: f64,
    pub specular_reflectance: Quantity<'a>,
}

pub(super) fn layer<'a>(q: &mut Query<'a, '_>, inside: f64) -> Layer<'a> {
    Layer {
        eta: eta(q, inside),
        sigma_a: Quantity(
            "sigma_a",
            Role::Coefficient,
            q.texture_or_spectrum("sigma_a", SpectrumValue::Uniform(0.0)),
        ),
        thickness: q.float_in("thickness", 0.0.., 1.0),
        specular_reflectance: colour(q, TINTS[0], 1.0),
    }
}

/// The shares of the parts of a mixture.
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

/// What a filter of polarised light does to it.
pub(super) enum Element<'a> {
    Polarizer(Quantity<'a>),
    Circular { left_handed: bool },
    Retarder([Quantity<'a>; 2]),
    Neutral,
}

/// A filter of polarised light, and the transmittance of its matter.
pub(super) fn filter<'a>(q: &mut Query<'a, '_>) -> (Element<'a>, SpectrumValue) {
    let transmittance = q.spectrum_or("transmittance", SpectrumValue::Uniform(1.0));
    let element = match q.object().plugin.as_str() {
        "circular" => Element::Circular {
            left_handed: q.boolean_or("left_handed", false),
        },
        "retarder" => Element::Retarder([number(q, "theta", 0.0), number(q, "delta", 90.0)]),
        _ => {
            let theta = number(q, "theta", 0.0);
            if q.boolean_or("polarizing", true) {
                Element::Polarizer(theta)
            } else {
                Element::Neutral
            }
        }
    };
    (element, transmittance)
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
