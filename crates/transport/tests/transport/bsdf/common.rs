//! Surfaces, directions and BSDFs shared by the BSDF tests.

use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{
    BlendBsdf, Bsdf, Coating, CoatingParameters, Conductor, Dielectric, Diffuse, Distribution,
    GlossyDiffuse, GlossyLobe, Mask, Plastic, PolarizedPlastic, Principled, PrincipledParameters,
    PrincipledThin, PrincipledThinParameters, RoughConductor, RoughDielectric, RoughDiffuse,
    RoughPlastic, Roughness, Surface, ThinDielectric, TwoSided,
};

/// A tilted unit normal, which prevents special cases for the axes of the world.
pub const NORMAL: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// A surface between two indices, whose tangents lean, are not unit vectors, and are not at right
/// angles.
pub fn surface(n_outer: f64, n_inner: f64) -> Surface {
    Surface {
        tangents: [DVec3::new(0.5, 0.9, 0.2), DVec3::new(-1.0, 0.4, 1.1)],
        ..Surface::plain(NORMAL, n_outer, n_inner)
    }
}

/// Returns the unit vector at `cos` to the normal, in a fixed plane through the normal.
pub fn at_cosine(cos: f64) -> DVec3 {
    let tangent = NORMAL.any_orthonormal_vector();
    cos * NORMAL + (1.0 - cos * cos).sqrt() * tangent
}

/// Gold-like, silver-like and perfectly reflecting channels.
pub fn metal() -> [Spectrum; 3] {
    [
        Spectrum([0.2, 0.05, 1.4, 0.0]),
        Spectrum([3.9, 2.2, 1.6, 9.0]),
        Spectrum([1.0, 0.9, 1.0, 1.0]),
    ]
}

/// Isotropic GGX facets.
pub fn ggx(alpha: f64) -> Roughness {
    Roughness::new(Distribution::Ggx, alpha).unwrap()
}

/// Isotropic Beckmann facets.
pub fn beckmann(alpha: f64) -> Roughness {
    Roughness::new(Distribution::Beckmann, alpha).unwrap()
}

/// Anisotropic facets.
pub fn anisotropic(distribution: Distribution, alphas: [f64; 2]) -> Roughness {
    Roughness::anisotropic(distribution, alphas[0], alphas[1]).unwrap()
}

/// A rough dielectric without tints.
pub fn rough_dielectric(facets: Roughness) -> Bsdf {
    Bsdf::RoughDielectric(RoughDielectric::new(facets, Spectrum::ONE, Spectrum::ONE).unwrap())
}

/// A rough metal of [`metal`].
pub fn rough_conductor(facets: Roughness) -> Bsdf {
    let [eta, k, tint] = metal();
    Bsdf::RoughConductor(RoughConductor::new(facets, eta, k, tint).unwrap())
}

/// A Lambertian reflector.
pub fn diffuse() -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(Spectrum([0.9, 0.5, 0.0, 1.0])).unwrap())
}

/// A white coat over a coloured base.
pub fn plastic(nonlinear: bool) -> Bsdf {
    let base = Spectrum([0.9, 0.5, 0.1, 1.0]);
    Bsdf::Plastic(Plastic::new(1.5, base, Spectrum::ONE, nonlinear).unwrap())
}

/// A rough white coat, lossless or not, over the base of [`plastic`].
pub fn rough_plastic(roughness: Roughness, lossless: bool, nonlinear: bool) -> Bsdf {
    let base = Spectrum([0.9, 0.5, 0.1, 1.0]);
    let coated = RoughPlastic::new(roughness, lossless, 1.5, base, Spectrum::ONE, nonlinear);
    Bsdf::RoughPlastic(coated.unwrap())
}

/// A rough diffuse surface.
pub fn rough_diffuse(alpha: f64, fast: bool) -> Bsdf {
    let colour = Spectrum([0.9, 0.5, 0.1, 1.0]);
    Bsdf::RoughDiffuse(RoughDiffuse::new(colour, alpha, fast).unwrap())
}

/// A glossy lobe over a base; one channel reflects everything.
pub fn glossy(lobe: GlossyLobe) -> Bsdf {
    let (diffuse, specular) = (
        Spectrum([0.6, 0.5, 0.1, 0.0]),
        Spectrum([0.4, 0.2, 0.3, 0.5]),
    );
    Bsdf::GlossyDiffuse(Box::new(
        GlossyDiffuse::new(lobe, diffuse, specular).unwrap(),
    ))
}

/// A layer that absorbs in some channels.
pub fn coating(roughness: Option<Roughness>, nested: Bsdf) -> Bsdf {
    let layer = CoatingParameters {
        eta: 1.5,
        sigma_a: Spectrum([0.0, 0.2, 1.0, 0.0]).into(),
        thickness: 0.5,
        specular_reflectance: Spectrum([1.0, 1.0, 1.0, 0.5]).into(),
        roughness,
    };
    Bsdf::Coating(Box::new(Coating::new(layer, nested).unwrap()))
}

/// A principled surface with the colour of [`plastic`].
pub fn principled(roughness: f64, metallic: f64, specular: f64) -> Bsdf {
    principled_of(PrincipledParameters {
        roughness: roughness.into(),
        metallic: metallic.into(),
        eta: PrincipledParameters::eta_of(specular),
        ..colours()
    })
}

fn colours() -> PrincipledParameters {
    PrincipledParameters {
        base_color: Spectrum([0.9, 0.5, 0.1, 1.0]).into(),
        luminance: 0.6.into(),
        ..PrincipledParameters::default()
    }
}

fn principled_of(parameters: PrincipledParameters) -> Bsdf {
    Bsdf::Principled(Box::new(Principled::new(parameters).unwrap()))
}

/// A principled surface that transmits light.
fn principled_glass() -> Bsdf {
    principled_of(PrincipledParameters {
        roughness: 0.6.into(),
        metallic: 0.2.into(),
        spec_trans: 0.7.into(),
        spec_tint: 0.4.into(),
        ..colours()
    })
}

/// A principled surface with all reflecting lobes.
fn principled_layers() -> Bsdf {
    principled_of(PrincipledParameters {
        metallic: 0.3.into(),
        spec_tint: 0.5.into(),
        sheen: 0.5.into(),
        sheen_tint: 0.5.into(),
        flatness: 0.5.into(),
        clearcoat: 1.0.into(),
        ..colours()
    })
}

/// A principled surface with anisotropic facets.
fn principled_brushed() -> Bsdf {
    principled_of(PrincipledParameters {
        metallic: 0.7.into(),
        anisotropic: 0.8.into(),
        ..colours()
    })
}

fn principled_sheet(anisotropic: f64) -> Bsdf {
    let colours = colours();
    let sheet = PrincipledThin::new(PrincipledThinParameters {
        base_color: colours.base_color,
        luminance: colours.luminance,
        roughness: 0.6.into(),
        anisotropic: anisotropic.into(),
        spec_trans: 0.6.into(),
        diff_trans: 0.8.into(),
        spec_tint: 0.3.into(),
        sheen: 0.2.into(),
        sheen_tint: 0.5.into(),
        flatness: 0.4.into(),
        eta: 1.5,
    });
    Bsdf::PrincipledThin(Box::new(sheet.unwrap()))
}

/// Plastic with facets over the base of [`plastic`]; light reaches the base without the facets.
pub fn polarized_plastic(facets: Roughness) -> Bsdf {
    let base = Spectrum([0.9, 0.5, 0.1, 1.0]);
    Bsdf::PolarizedPlastic(PolarizedPlastic::new(facets, 1.5, base, Spectrum::ONE).unwrap())
}

/// A blend with the fraction `share` of the second surface.
pub fn blend(share: f64, first: Bsdf, second: Bsdf) -> Bsdf {
    Bsdf::Blend(BlendBsdf::new(Spectrum::splat(share), first, second).unwrap())
}

/// A surface with different front and back.
pub fn two_sided(front: Bsdf, back: Bsdf) -> Bsdf {
    Bsdf::TwoSided(TwoSided::new(front, back).unwrap())
}

/// A mask that covers the fraction `opacity` of its area.
pub fn mask(opacity: f64, nested: Bsdf) -> Bsdf {
    Bsdf::Mask(Mask::new(Spectrum::splat(opacity), nested).unwrap())
}

/// A pane of glass.
pub fn pane() -> Bsdf {
    Bsdf::ThinDielectric(ThinDielectric::new(1.5, Spectrum::ONE, Spectrum::ONE).unwrap())
}

/// True if a surface is black on the side away from its normal.
pub fn is_one_sided(bsdf: &Bsdf) -> bool {
    bsdf.is_opaque() && !matches!(bsdf, Bsdf::TwoSided(_))
}

/// All delta BSDFs.
pub fn smooth() -> Vec<(&'static str, Bsdf)> {
    let [eta, k, tint] = metal();
    vec![
        ("null", Bsdf::Null),
        ("dielectric", Bsdf::Dielectric(Dielectric::default())),
        (
            "conductor",
            Bsdf::Conductor(Conductor::new(eta, k, tint).unwrap()),
        ),
        ("thin dielectric", pane()),
    ]
}

/// All other BSDFs, some with additional mirror lobes, each with pairs of indices (outer, inner)
/// for the tests.
pub fn spread() -> Vec<(String, Bsdf, Vec<[f64; 2]>)> {
    let mut cases = vec![(
        "diffuse".to_string(),
        diffuse(),
        vec![[1.0, 1.0], [1.33, 1.5]],
    )];
    let facets = [0.08, 0.3, 1.0].map(|alpha| {
        [
            (alpha, "", ggx(alpha)),
            (alpha, ", Beckmann", beckmann(alpha)),
        ]
    });
    for (alpha, which, facets) in facets.into_iter().flatten() {
        let pairs = vec![[1.0, 1.5], [1.7, 1.33], [1.33, 1.36]];
        cases.push((
            format!("rough dielectric {alpha}{which}"),
            rough_dielectric(facets.clone()),
            pairs,
        ));
        let conductor = rough_conductor(facets);
        cases.push((
            format!("rough conductor {alpha}{which}"),
            conductor,
            vec![[1.0, 1.0], [1.5, 1.0]],
        ));
    }
    let mirror = smooth().remove(2).1;
    let more = [
        ("plastic", plastic(true)),
        ("rough plastic", rough_plastic(ggx(0.2), true, true)),
        (
            "rough plastic, Beckmann",
            rough_plastic(beckmann(0.3), false, true),
        ),
        ("rough diffuse", rough_diffuse(0.6, false)),
        ("rough diffuse, direct", rough_diffuse(0.6, true)),
        ("phong", glossy(GlossyLobe::Phong(8.0.into()))),
        ("ward", glossy(GlossyLobe::Ward(beckmann(0.4)))),
        ("coating", coating(None, diffuse())),
        (
            "coating of a rough metal",
            coating(None, rough_conductor(ggx(0.3))),
        ),
        (
            "coating of a mirror",
            coating(Some(ggx(0.4)), mirror.clone()),
        ),
        (
            "rough coating",
            coating(Some(beckmann(0.3)), glossy(GlossyLobe::Phong(3.0.into()))),
        ),
        ("principled", principled(0.5, 0.3, 0.5)),
        ("principled, layers", principled_layers()),
        ("polarized plastic", polarized_plastic(ggx(0.3))),
        ("blend", blend(0.3, diffuse(), rough_conductor(ggx(0.3)))),
        ("blend with a mirror", blend(0.6, mirror, diffuse())),
        ("two sides", two_sided(rough_conductor(ggx(0.4)), diffuse())),
        ("mask", mask(0.3, diffuse())),
    ];
    let pairs = vec![[1.0, 1.0], [1.5, 1.33]];
    cases.push((
        "principled, glass".to_string(),
        principled_glass(),
        vec![[1.0, 1.5], [1.7, 1.33]],
    ));
    cases.push((
        "principled, sheet".to_string(),
        principled_sheet(0.0),
        vec![[1.0, 1.0]],
    ));
    cases.extend(more.map(|(name, bsdf)| (name.to_string(), bsdf, pairs.clone())));
    cases.extend(brushed());
    cases
}

/// The BSDFs of [`spread`] with anisotropic facets.
pub fn brushed() -> Vec<(String, Bsdf, Vec<[f64; 2]>)> {
    let mut cases = Vec::new();
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        let facets = anisotropic(distribution, [0.12, 0.5]);
        let turned = anisotropic(distribution, [0.6, 0.2]);
        let all = [
            (
                "rough dielectric",
                rough_dielectric(facets),
                vec![[1.0, 1.5], [1.7, 1.33]],
            ),
            ("rough conductor", rough_conductor(turned), vec![[1.0, 1.0]]),
        ];
        let named = |name| format!("{name}, brushed, {distribution:?}");
        cases.extend(all.map(|(name, bsdf, pairs)| (named(name), bsdf, pairs)));
    }
    let conductor = rough_conductor(anisotropic(Distribution::Ggx, [0.2, 0.5]));
    let ward = GlossyLobe::Ward(anisotropic(Distribution::Beckmann, [0.2, 0.6]));
    let more = [
        ("ward", glossy(ward)),
        (
            "polarized plastic",
            polarized_plastic(anisotropic(Distribution::Ggx, [0.5, 0.15])),
        ),
        ("principled", principled_brushed()),
        ("principled sheet", principled_sheet(0.7)),
        ("coating", coating(None, conductor.clone())),
        ("blend", blend(0.3, diffuse(), conductor.clone())),
        ("two sides", two_sided(diffuse(), conductor)),
    ];
    let named = |name| format!("{name}, brushed");
    cases.extend(more.map(|(name, bsdf)| (named(name), bsdf, vec![[1.0, 1.0]])));
    cases
}
