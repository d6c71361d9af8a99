//! Surface scattering.

mod metal;
mod parameters;
mod principled;

use super::context::Context;
use super::ior::index;
use super::surface_texture::{Vertices, texture};
use super::wish::Indices;
use crate::query::{Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};
use metal::{Optics, optics};
use parameters::{
    Coated, Facets, Quantity, TINTS, coated, colour, eta, facets, nested, number, polarized_eta,
    polarizing, tints,
};
use std::sync::Arc;
use transport::Spectrum;
use transport::bsdf::{
    BlendBsdf, Bsdf, BsdfError, Conductor, Dielectric, Diffuse, Mask, Plastic, PolarizedPlastic,
    RoughConductor, RoughDielectric, RoughPlastic, Roughness, ThinDielectric, TwoSided,
};
use transport::texture::Texture;

const KNOWN: [&str; 18] = [
    "null",
    "diffuse",
    "dielectric",
    "roughdielectric",
    "thindielectric",
    "conductor",
    "roughconductor",
    "plastic",
    "roughplastic",
    "pplastic",
    "principled",
    "principledthin",
    "polarizer",
    "retarder",
    "circular",
    "blendbsdf",
    "mask",
    "twosided",
];

/// A surface's scattering, and what it says of the indices on its sides.
pub(super) struct Surface {
    pub bsdf: Bsdf,
    /// `int_ior` and `ext_ior`, for dielectrics.
    pub indices: Option<Indices>,
}

/// Index of the glass that Mitsuba's panes are made of by default.
const BK7: f64 = 1.5046;

/// The bsdf that an object describes, for a mesh whose vertices may be coloured; diffuse after an error.
pub(super) fn build(
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Surface {
    let dielectric = matches!(object.plugin.as_str(), "dielectric" | "roughdielectric");
    let mut query = Query::new(object, context.diagnostics);
    let indices = dielectric.then(|| Indices {
        inner: index(&mut query, "int_ior"),
        outer: index(&mut query, "ext_ior"),
        location: object.location.clone(),
    });
    let raw = raw(object, &mut query);
    let indices = match &raw {
        Some(Raw::Principled(solid)) => solid.indices(&query),
        _ => indices,
    };
    let bsdf = match raw {
        Some(raw) => {
            query.finish(&[]);
            make(raw, object, vertices, context)
        }
        None => {
            unknown(object, context);
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
pub(super) fn of_shape(shape: &mut Query) -> Option<Arc<ObjectDescription>> {
    shape.child(PluginKind::Bsdf).cloned()
}

fn unknown(object: &ObjectDescription, context: &mut Context) {
    match object.plugin.as_str() {
        "bumpmap" | "normalmap" => {
            let message = "normals are those of the geometry here: use the bsdf nested in it";
            context.error_at(&object.plugin_location, message);
        }
        _ => unknown_plugin(object, &KNOWN, context.diagnostics),
    }
}

/// Parameters as written, before they are turned into channels.
enum Raw<'a> {
    Null,
    Diffuse(Quantity<'a>),
    Dielectric([SpectrumValue; 2]),
    RoughDielectric(Facets<'a>, [Quantity<'a>; 2]),
    ThinDielectric(f64, [Quantity<'a>; 2]),
    Conductor(Optics, Quantity<'a>),
    RoughConductor(Facets<'a>, Optics, Quantity<'a>),
    Plastic(Coated<'a>),
    RoughPlastic((Facets<'a>, bool), Coated<'a>),
    PolarizedPlastic(Facets<'a>, f64, [Quantity<'a>; 2]),
    Principled(principled::Solid<'a>),
    PrincipledThin(principled::Thin<'a>),
    /// A filter straight through which a share of the light passes.
    Filter(f64, SpectrumValue),
    Blend(Quantity<'a>, Vec<&'a ObjectDescription>),
    Mask(Quantity<'a>, Vec<&'a ObjectDescription>),
    TwoSided(Vec<&'a ObjectDescription>),
}

/// `None` for an unknown plugin.
fn raw<'a>(object: &'a ObjectDescription, q: &mut Query<'a, '_>) -> Option<Raw<'a>> {
    Some(match object.plugin.as_str() {
        "null" => Raw::Null,
        "diffuse" => Raw::Diffuse(colour(q, "reflectance", 0.5)),
        "dielectric" => {
            Raw::Dielectric(TINTS.map(|name| q.spectrum_or(name, SpectrumValue::Uniform(1.0))))
        }
        "roughdielectric" => Raw::RoughDielectric(facets(q), tints(q)),
        "thindielectric" => Raw::ThinDielectric(eta(q, BK7), tints(q)),
        "conductor" => Raw::Conductor(optics(q), colour(q, TINTS[0], 1.0)),
        "roughconductor" => Raw::RoughConductor(facets(q), optics(q), colour(q, TINTS[0], 1.0)),
        "plastic" => Raw::Plastic(coated(q)),
        "roughplastic" => {
            let coat = (facets(q), q.boolean_or("lossless", false));
            Raw::RoughPlastic(coat, coated(q))
        }
        "pplastic" => {
            let reflectances = [("diffuse_reflectance", 0.5), (TINTS[0], 1.0)];
            let reflectances = reflectances.map(|(name, default)| colour(q, name, default));
            Raw::PolarizedPlastic(facets(q), polarized_eta(q), reflectances)
        }
        "principled" => Raw::Principled(principled::solid(q)),
        "principledthin" => Raw::PrincipledThin(principled::thin(q)),
        "polarizer" | "circular" | "retarder" => {
            let (share, transmittance) = polarizing(q);
            Raw::Filter(share, transmittance)
        }
        "blendbsdf" => Raw::Blend(number(q, "weight", 0.5), nested(q, 2..=2)),
        "mask" => Raw::Mask(number(q, "opacity", 0.5), nested(q, 1..=1)),
        "twosided" => Raw::TwoSided(nested(q, 1..=2)),
        _ => return None,
    })
}

/// `None` after an error.
fn make(
    raw: Raw,
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Option<Bsdf> {
    let mut maker = Maker {
        object,
        vertices,
        context,
    };
    let bsdf: Result<Bsdf, BsdfError> = match raw {
        Raw::Null => Ok(Bsdf::Null),
        Raw::Diffuse(r) => Diffuse::new(maker.texture(r)).map(Bsdf::Diffuse),
        Raw::Dielectric(tints) => {
            let [r, t] = tints.map(|tint| maker.spectrum(&tint));
            Dielectric::new(r, t).map(Bsdf::Dielectric)
        }
        Raw::RoughDielectric(facets, tints) => {
            let [r, t] = tints.map(|tint| maker.texture(tint));
            let facets = maker.facets(facets);
            facets.and_then(|f| RoughDielectric::new(f, r, t).map(Bsdf::RoughDielectric))
        }
        Raw::ThinDielectric(eta, tints) => {
            let [r, t] = tints.map(|tint| maker.texture(tint));
            ThinDielectric::new(eta, r, t).map(Bsdf::ThinDielectric)
        }
        Raw::Conductor(metal, tint) => {
            let [eta, k] = maker.optics(metal);
            Conductor::new(eta, k, maker.texture(tint)).map(Bsdf::Conductor)
        }
        Raw::RoughConductor(facets, metal, tint) => {
            let ([eta, k], tint) = (maker.optics(metal), maker.texture(tint));
            let facets = maker.facets(facets);
            facets.and_then(|f| RoughConductor::new(f, eta, k, tint).map(Bsdf::RoughConductor))
        }
        Raw::Plastic(Coated(eta, reflectances, nonlinear)) => {
            let [diffuse, coat] = reflectances.map(|r| maker.texture(r));
            Plastic::new(eta, diffuse, coat, nonlinear).map(Bsdf::Plastic)
        }
        Raw::RoughPlastic((facets, lossless), Coated(eta, reflectances, nonlinear)) => {
            let [diffuse, coat] = reflectances.map(|r| maker.texture(r));
            let facets = maker.facets(facets);
            let plastic =
                facets.and_then(|f| RoughPlastic::new(f, lossless, eta, diffuse, coat, nonlinear));
            plastic.map(Bsdf::RoughPlastic)
        }
        Raw::PolarizedPlastic(facets, eta, reflectances) => {
            let [diffuse, specular] = reflectances.map(|r| maker.texture(r));
            let facets = maker.facets(facets);
            let plastic = facets.and_then(|f| PolarizedPlastic::new(f, eta, diffuse, specular));
            plastic.map(Bsdf::PolarizedPlastic)
        }
        Raw::Principled(solid) => solid.make(&mut maker),
        Raw::PrincipledThin(thin) => thin.make(&mut maker),
        Raw::Filter(share, transmittance) => {
            let factor = maker.spectrum(&transmittance) * share;
            // A pane of the index around it reflects nothing.
            ThinDielectric::new(1.0, Spectrum::ZERO, factor).map(Bsdf::ThinDielectric)
        }
        Raw::Blend(weight, pair) => {
            let [first, second] = pair[..] else {
                return None;
            };
            let pair = [first, second].map(|nested| maker.nested(nested));
            let [first, second] = pair;
            BlendBsdf::new(maker.texture(weight), first, second).map(Bsdf::Blend)
        }
        Raw::Mask(opacity, nested) => {
            let nested = maker.nested(nested.first()?);
            Mask::new(maker.texture(opacity), nested).map(Bsdf::Mask)
        }
        Raw::TwoSided(sides) => {
            let [front, back] = [sides.first()?, sides.last()?].map(|side| maker.nested(side));
            TwoSided::new(front, back).map(Bsdf::TwoSided)
        }
    };
    context.accept(&object.location, bsdf)
}

/// Turns parameters of an object into what the channels see.
struct Maker<'m, 'c> {
    object: &'m ObjectDescription,
    vertices: &'m Vertices,
    context: &'m mut Context<'c>,
}

impl Maker<'_, '_> {
    fn spectrum(&mut self, value: &SpectrumValue) -> Spectrum {
        self.context.spectrum(value, &self.object.location)
    }

    fn texture(&mut self, Quantity(name, role, input): Quantity) -> Texture {
        texture(input, role, self.object, name, self.vertices, self.context)
    }

    fn facets(&mut self, Facets(distribution, alpha): Facets) -> Result<Roughness, BsdfError> {
        Roughness::new(distribution, self.texture(alpha))
    }

    fn optics(&mut self, Optics { eta, k }: Optics) -> [Spectrum; 2] {
        [eta, k].map(|value| self.spectrum(&value))
    }

    fn nested(&mut self, object: &ObjectDescription) -> Bsdf {
        build(object, self.vertices, self.context).bsdf
    }
}
