//! Surface scattering (bsdfs).

mod metal;
mod parameters;
mod principled;

use super::context::Context;
use super::side_request::Indices;
use super::surface_texture::{Role, Vertices, texture};
use crate::diagnostic::lints;
use crate::query::{Input, Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};
use metal::{Optics, optics};
use parameters::{
    Alphas, Coated, Element, Facets, Layer, Quantity, TINTS, alphas, coated, colour, eta, facets,
    filter, index, layer, nested, number, polarized_eta, reflectances, tints, weights,
};
use std::sync::Arc;
use transport::Spectrum;
use transport::bsdf::{
    BlendBsdf, Bsdf, BsdfError, Coating, CoatingParameters, Conductor, Dielectric, Diffuse,
    Distribution, FilterElement, GlossyDiffuse, GlossyLobe, Mask, NormalMap, NormalSource, Plastic,
    PolarizedPlastic, PolarizingFilter, RoughConductor, RoughDielectric, RoughDiffuse,
    RoughPlastic, Roughness, ThinDielectric, TwoSided,
};
use transport::texture::Texture;

/// Bsdf of a surface, with the indices that it requests for the two sides.
pub(super) struct Surface {
    pub bsdf: Bsdf,
    /// Indices `int_ior` and `ext_ior`, for dielectrics.
    pub indices: Option<Indices>,
}

/// Index of BK7 glass, Mitsuba's default for panes.
const BK7: f64 = 1.5046;

/// Builds the bsdf that an object describes; diffuse after an error. `vertices` is the mesh whose
/// attributes textures may use.
pub(super) fn build(
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Surface {
    if MAPS.contains(&object.plugin.as_str()) {
        return mapped(object, vertices, context).unwrap_or_else(|| Surface {
            bsdf: default(false),
            indices: None,
        });
    }
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
            unknown_plugin(object, context.diagnostics);
            None
        }
    };
    Surface {
        bsdf: bsdf.unwrap_or_else(|| default(false)),
        indices,
    }
}

/// Plugins that perturb the normals of a nested bsdf.
const MAPS: [&str; 2] = ["bumpmap", "normalmap"];

/// Builds a bsdf with a map of its normals; `None` after an error. Smooth interfaces ignore the
/// map, as a note on differences from Mitsuba says.
fn mapped(
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Option<Surface> {
    let mut q = Query::new(object, context.diagnostics);
    let is_bump = object.plugin == "bumpmap";
    let scale = if is_bump { q.float("scale") } else { 1.0 };
    let input = if is_bump {
        let heights = q.child(PluginKind::Texture);
        if let Some(other) = heights.filter(|h| !is_image(h)) {
            let message = format!("heights of a {} have no slope: use a bitmap", other.plugin);
            q.warning(lints::FLAT_HEIGHTS, "scale", message);
        }
        heights.map_or(Input::Spectrum(SpectrumValue::Uniform(0.0)), |h| {
            Input::Object(h)
        })
    } else {
        // Mitsuba 0.6 needs no name for the nested texture.
        let unnamed = (!q.has("normalmap")).then(|| q.child(PluginKind::Texture));
        match unnamed.flatten() {
            Some(map) => Input::Object(map),
            None => q.texture_or_spectrum("normalmap"),
        }
    };
    let [flips, shadows] =
        ["flip_invalid_normals", "use_shadowing_function"].map(|name| q.boolean(name));
    let nested = nested(&mut q, 1..=1);
    q.finish(&[]);
    let surface = build(nested.first()?, vertices, context);
    let source = if is_bump {
        let heights = texture(input, Role::Height, object, "", vertices, context);
        NormalSource::Heights(heights, scale)
    } else {
        let normals = texture(input, Role::Vector, object, "normalmap", vertices, context);
        NormalSource::Normals(normals)
    };
    if matches!(
        surface.bsdf,
        Bsdf::Null | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_)
    ) {
        return Some(surface);
    }
    let map = NormalMap::new(source, flips, shadows, surface.bsdf);
    let bsdf = context.accept(&object.location, map)?;
    Some(Surface {
        bsdf: Bsdf::NormalMap(Box::new(bsdf)),
        ..surface
    })
}

/// Returns true if a texture is an image, scaled or not.
fn is_image(texture: &ObjectDescription) -> bool {
    let mut nested = texture.children.iter();
    texture.plugin == "bitmap"
        || texture.plugin == "scale" && nested.any(|child| is_image(&child.object))
}

/// Returns the default bsdf of a shape, as in Mitsuba: diffuse, with reflectance ½, or 0 if it
/// emits light.
pub(super) fn default(emits: bool) -> Bsdf {
    let reflectance = if emits { 0.0 } else { 0.5 };
    Diffuse::new(Spectrum::splat(reflectance)).map_or(Bsdf::Null, Bsdf::Diffuse)
}

/// Returns the bsdf of a shape, if it names one.
pub(super) fn of_shape(shape: &mut Query) -> Option<Arc<ObjectDescription>> {
    shape.child(PluginKind::Bsdf).cloned()
}

/// Parameters as given in the scene, before conversion to channels.
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
    Filter(Element<'a>, SpectrumValue),
    RoughDiffuse([Quantity<'a>; 2], bool),
    Phong(Quantity<'a>, [Quantity<'a>; 2]),
    Ward(Alphas<'a>, [Quantity<'a>; 2]),
    Coating(Option<Facets<'a>>, Layer<'a>, Vec<&'a ObjectDescription>),
    Blend(Quantity<'a>, Vec<&'a ObjectDescription>),
    Mixture(Vec<f64>, Vec<&'a ObjectDescription>),
    Mask(Quantity<'a>, Vec<&'a ObjectDescription>),
    TwoSided(Vec<&'a ObjectDescription>),
}

/// Reads the parameters of a bsdf; `None` for an unknown plugin.
fn raw<'a>(object: &'a ObjectDescription, q: &mut Query<'a, '_>) -> Option<Raw<'a>> {
    Some(match object.plugin.as_str() {
        "null" => Raw::Null,
        "diffuse" => Raw::Diffuse(colour(q, "reflectance")),
        "dielectric" => Raw::Dielectric(TINTS.map(|name| q.spectrum(name))),
        "roughdielectric" => Raw::RoughDielectric(facets(q), tints(q)),
        "thindielectric" => Raw::ThinDielectric(eta(q, BK7), tints(q)),
        "conductor" => Raw::Conductor(optics(q), colour(q, TINTS[0])),
        "roughconductor" => Raw::RoughConductor(facets(q), optics(q), colour(q, TINTS[0])),
        "plastic" => Raw::Plastic(coated(q)),
        "roughplastic" => {
            let coat = (facets(q), q.boolean("lossless"));
            Raw::RoughPlastic(coat, coated(q))
        }
        "pplastic" => Raw::PolarizedPlastic(facets(q), polarized_eta(q), reflectances(q)),
        "principled" => Raw::Principled(principled::solid(q)),
        "principledthin" => Raw::PrincipledThin(principled::thin(q)),
        "polarizer" | "circular" | "retarder" => {
            let (element, transmittance) = filter(q);
            Raw::Filter(element, transmittance)
        }
        "roughdiffuse" => {
            let quantities = [colour(q, "reflectance"), number(q, "alpha")];
            Raw::RoughDiffuse(quantities, q.boolean("use_fast_approx"))
        }
        "phong" => Raw::Phong(number(q, "exponent"), reflectances(q)),
        "ward" => Raw::Ward(alphas(q), reflectances(q)),
        "coating" => Raw::Coating(None, layer(q, BK7), nested(q, 1..=1)),
        "roughcoating" => Raw::Coating(Some(facets(q)), layer(q, BK7), nested(q, 1..=1)),
        "mixturebsdf" => {
            let weights = weights(q);
            let nested = nested(q, weights.len()..=weights.len());
            Raw::Mixture(weights, nested)
        }
        "blendbsdf" => Raw::Blend(number(q, "weight"), nested(q, 2..=2)),
        "mask" => Raw::Mask(number(q, "opacity"), nested(q, 1..=1)),
        "twosided" => Raw::TwoSided(nested(q, 1..=2)),
        _ => return None,
    })
}

/// Builds a bsdf from its parameters; `None` after an error.
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
            let [r, t] = tints.map(|tint| maker.spectrum(&tint, Role::Reflectance));
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
        Raw::Filter(element, transmittance) => {
            let element = match element {
                Element::Polarizer(theta) => FilterElement::Polarizer {
                    theta: maker.texture(theta),
                },
                Element::Circular { left_handed } => {
                    FilterElement::CircularPolarizer { left_handed }
                }
                Element::Retarder([theta, delta]) => FilterElement::Retarder {
                    theta: maker.texture(theta),
                    delta: maker.texture(delta),
                },
                Element::Neutral => FilterElement::Neutral,
            };
            let transmittance = maker.spectrum(&transmittance, Role::Reflectance);
            let filter = PolarizingFilter::new(element, transmittance);
            filter.map(|filter| Bsdf::Filter(Box::new(filter)))
        }
        Raw::RoughDiffuse(quantities, fast) => {
            let [reflectance, alpha] = quantities.map(|q| maker.texture(q));
            RoughDiffuse::new(reflectance, alpha, fast).map(Bsdf::RoughDiffuse)
        }
        Raw::Phong(exponent, reflectances) => {
            let lobe = GlossyLobe::Phong(maker.texture(exponent));
            maker.reflectances(lobe, reflectances)
        }
        Raw::Ward(alphas, reflectances) => {
            let distribution = Distribution::Beckmann;
            let roughness = maker.facets(Facets {
                distribution,
                alphas,
            });
            roughness.and_then(|alpha| maker.reflectances(GlossyLobe::Ward(alpha), reflectances))
        }
        Raw::Coating(facets, layer, nested) => {
            let nested = maker.nested(nested.first()?);
            maker.coating(facets, layer, nested)
        }
        Raw::Mixture(weights, nested) => {
            let nested: Vec<Bsdf> = nested.into_iter().map(|n| maker.nested(n)).collect();
            mixture(&weights, nested)
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

/// Converts parameters of an object to the channels of the group.
struct Maker<'m, 'c> {
    object: &'m ObjectDescription,
    vertices: &'m Vertices,
    context: &'m mut Context<'c>,
}

impl Maker<'_, '_> {
    fn spectrum(&mut self, value: &SpectrumValue, role: Role) -> Spectrum {
        self.context.spectrum(value, role, &self.object.location)
    }

    fn texture(&mut self, Quantity(name, role, input): Quantity) -> Texture {
        texture(input, role, self.object, name, self.vertices, self.context)
    }

    /// Returns the roughness of microfacets, isotropic or along two axes.
    fn facets(&mut self, facets: Facets) -> Result<Roughness, BsdfError> {
        match facets.alphas {
            Alphas::Alike(alpha) => Roughness::new(facets.distribution, self.texture(alpha)),
            Alphas::Apart(alphas) => {
                let [u, v] = alphas.map(|alpha| self.texture(alpha));
                Roughness::anisotropic(facets.distribution, u, v)
            }
        }
    }

    /// Returns η and k of a metal relative to the index of its surroundings.
    fn optics(&mut self, metal: Optics) -> [Spectrum; 2] {
        let against = metal.surroundings;
        let parts = [metal.eta, metal.k];
        parts.map(|value| self.spectrum(&value, Role::Coefficient) * against.recip())
    }

    /// Builds a glossy lobe over a diffuse base.
    fn reflectances(
        &mut self,
        lobe: GlossyLobe,
        reflectances: [Quantity; 2],
    ) -> Result<Bsdf, BsdfError> {
        let [diffuse, specular] = reflectances.map(|r| self.texture(r));
        GlossyDiffuse::new(lobe, diffuse, specular).map(|b| Bsdf::GlossyDiffuse(Box::new(b)))
    }

    fn coating(
        &mut self,
        facets: Option<Facets>,
        layer: Layer,
        nested: Bsdf,
    ) -> Result<Bsdf, BsdfError> {
        let roughness = facets.map(|f| self.facets(f)).transpose()?;
        let parameters = CoatingParameters {
            eta: layer.eta,
            sigma_a: self.texture(layer.sigma_a),
            thickness: layer.thickness,
            specular_reflectance: self.texture(layer.specular_reflectance),
            roughness,
        };
        Coating::new(parameters, nested).map(|b| Bsdf::Coating(Box::new(b)))
    }

    fn nested(&mut self, object: &ObjectDescription) -> Bsdf {
        build(object, self.vertices, self.context).bsdf
    }
}

/// Builds a mixture of bsdfs by their weights. If the weights sum to less than 1, the rest is
/// black; if they sum to more, they are normalised.
fn mixture(weights: &[f64], nested: Vec<Bsdf>) -> Result<Bsdf, BsdfError> {
    let black = Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO)?);
    let mut parts = weights.iter().copied().zip(nested);
    let Some((mut sum, mut mixed)) = parts.next() else {
        return Ok(black);
    };
    let rest = 1.0 - weights.iter().sum::<f64>();
    let rest = (rest > ROUNDING).then_some((rest, black));
    for (weight, bsdf) in parts.chain(rest) {
        sum += weight;
        let share = if sum > 0.0 { weight / sum } else { 0.0 };
        mixed = Bsdf::Blend(BlendBsdf::new(share, mixed, bsdf)?);
    }
    Ok(mixed)
}

/// Amount by which the sum of the weights may fall short of 1 without a black rest.
const ROUNDING: f64 = 1e-6;
