//! Surface scattering.

use super::context::Context;
use super::ior::index;
use crate::diagnostic::Location;
use crate::query::{Query, unknown_plugin};
use crate::scene::{Object, PluginKind, SpectrumValue};
use transport::Spectrum;
use transport::bsdf::{
    Bsdf, BsdfError, Conductor, Dielectric, Diffuse, RoughConductor, RoughDielectric,
};

const KNOWN: [&str; 6] = [
    "null",
    "diffuse",
    "dielectric",
    "roughdielectric",
    "conductor",
    "roughconductor",
];

/// A surface's scattering, and what it says of the indices on its sides.
pub(super) struct Surface {
    pub bsdf: Bsdf,
    /// `int_ior` and `ext_ior`, for dielectrics.
    pub indices: Option<Indices>,
}

/// What a dielectric says of the indices on its sides.
#[derive(Clone, Debug)]
pub(super) struct Indices {
    pub inner: Option<f64>,
    pub outer: Option<f64>,
    pub location: Location,
}

/// Smallest roughness that is not better called smooth.
const LEAST_ALPHA: f64 = 1e-4;

/// The bsdf that an object describes; diffuse after an error.
pub(super) fn build(object: &Object, context: &mut Context) -> Surface {
    let dielectric = matches!(object.plugin.as_str(), "dielectric" | "roughdielectric");
    let mut query = Query::new(object, context.diagnostics);
    let indices = dielectric.then(|| Indices {
        inner: index(&mut query, "int_ior"),
        outer: index(&mut query, "ext_ior"),
        location: object.location.clone(),
    });
    let raw = raw(object, &mut query);
    query.finish(&[]);
    let bsdf = match raw {
        Some(raw) => make(raw, object, context),
        None => {
            unknown_plugin(object, &KNOWN, context.diagnostics);
            None
        }
    };
    Surface {
        bsdf: bsdf.unwrap_or_else(default),
        indices,
    }
}

/// What a shape without a bsdf has: diffuse, reflectance ½, as in Mitsuba.
pub(super) fn default() -> Bsdf {
    Diffuse::new(Spectrum::splat(0.5)).map_or(Bsdf::Null, Bsdf::Diffuse)
}

/// The bsdf of a shape, if it names one.
pub(super) fn of_shape(shape: &mut Query) -> Option<std::sync::Arc<Object>> {
    shape.child(PluginKind::Bsdf).cloned()
}

/// Parameters as written, before they are turned into channels.
enum Raw {
    Null,
    Diffuse(SpectrumValue),
    Dielectric(SpectrumValue, SpectrumValue),
    RoughDielectric(f64, SpectrumValue, SpectrumValue),
    Conductor([SpectrumValue; 3]),
    RoughConductor(f64, [SpectrumValue; 3]),
}

fn raw(object: &Object, q: &mut Query) -> Option<Raw> {
    let one = || SpectrumValue::Uniform(1.0);
    Some(match object.plugin.as_str() {
        "null" => Raw::Null,
        "diffuse" => Raw::Diffuse(q.spectrum_or("reflectance", SpectrumValue::Uniform(0.5))),
        "dielectric" => Raw::Dielectric(
            q.spectrum_or("specular_reflectance", one()),
            q.spectrum_or("specular_transmittance", one()),
        ),
        "roughdielectric" => Raw::RoughDielectric(
            roughness(q),
            q.spectrum_or("specular_reflectance", one()),
            q.spectrum_or("specular_transmittance", one()),
        ),
        "conductor" => Raw::Conductor(metal(q)),
        "roughconductor" => Raw::RoughConductor(roughness(q), metal(q)),
        _ => return None,
    })
}

fn roughness(q: &mut Query) -> f64 {
    q.one_of("distribution", &["ggx"]);
    q.float_in("alpha", LEAST_ALPHA..=1.0, 0.1)
}

/// η, k and tint. Without η and k the metal is a perfect mirror.
fn metal(q: &mut Query) -> [SpectrumValue; 3] {
    let optical = q.has("eta") || q.has("k");
    let (eta, k) = if optical {
        (q.spectrum("eta"), q.spectrum("k"))
    } else {
        (SpectrumValue::Uniform(0.0), SpectrumValue::Uniform(1.0))
    };
    [
        eta,
        k,
        q.spectrum_or("specular_reflectance", SpectrumValue::Uniform(1.0)),
    ]
}

fn make(raw: Raw, object: &Object, context: &mut Context) -> Option<Bsdf> {
    let at = &object.location;
    let mut s = |value: &SpectrumValue| context.spectrum(value, at);
    let bsdf: Result<Bsdf, BsdfError> = match raw {
        Raw::Null => Ok(Bsdf::Null),
        Raw::Diffuse(r) => Diffuse::new(s(&r)).map(Bsdf::Diffuse),
        Raw::Dielectric(r, t) => Dielectric::new(s(&r), s(&t)).map(Bsdf::Dielectric),
        Raw::RoughDielectric(alpha, r, t) => {
            RoughDielectric::new(alpha, s(&r), s(&t)).map(Bsdf::RoughDielectric)
        }
        Raw::Conductor([eta, k, r]) => Conductor::new(s(&eta), s(&k), s(&r)).map(Bsdf::Conductor),
        Raw::RoughConductor(alpha, [eta, k, r]) => {
            RoughConductor::new(alpha, s(&eta), s(&k), s(&r)).map(Bsdf::RoughConductor)
        }
    };
    context.accept(at, bsdf)
}
