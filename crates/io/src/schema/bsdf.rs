//! Bsdfs.

use super::row::{boolean, float, index, many, one, plugin, spectrum, texture, word};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::Bsdf;

const INDICES: &[Parameter] = &[
    index(
        "int_ior",
        "(see the index rules)",
        "index inside: a number > 0 or a substance",
    ),
    index(
        "ext_ior",
        "(see the index rules)",
        "index outside: a number > 0 or a substance",
    ),
];

const PANE: &[Parameter] = &[
    index("int_ior", "1.5046", "index of the pane"),
    index("ext_ior", "\"air\"", "index around it"),
];

const COAT: &[Parameter] = &[
    index("int_ior", "1.49", "index of the coat"),
    index("ext_ior", "\"air\"", "index outside"),
    spectrum("diffuse_reflectance", "0.5", "of the base, 0 to 1"),
    boolean(
        "nonlinear",
        "false",
        "whether colours deepen with each reflection below the coat",
    ),
];

const REFLECTANCE: &[Parameter] = &[spectrum(
    "specular_reflectance",
    "1",
    "factor of what is reflected, 0 to 1",
)];

const TRANSMITTANCE: &[Parameter] = &[spectrum(
    "specular_transmittance",
    "1",
    "factor of what is transmitted, 0 to 1",
)];

const ROUGHNESS: &[Parameter] = &[
    float("alpha", "0.1", "roughness, 1e-4 to 1"),
    word(
        "distribution",
        &["beckmann", "ggx"],
        "of the normals of microfacets",
    ),
    boolean("sample_visible", "true", "accepted and ignored"),
];

const LOSSLESS: &[Parameter] = &[boolean(
    "lossless",
    "false",
    "whether the base gets what facets send to their neighbours",
)];

const METAL: &[Parameter] = &[
    spectrum(
        "eta",
        "0",
        "real part of the index, ≥ 0; a mirror without eta, k and material",
    ),
    spectrum("k", "1", "imaginary part of the index, ≥ 0"),
    word(
        "material",
        &["none", "Ag", "Al", "Au", "Cr", "Cu", "Hg", "W"],
        "a metal, in place of eta and k",
    ),
];

const PRINCIPLED: &[Parameter] = &[
    spectrum("base_color", "0.5", "0 to 1"),
    spectrum("roughness", "0.5", "0 to 1"),
    spectrum("metallic", "0", "share of metal, 0 to 1"),
    float("specular", "0.5", "0 to 1"),
    float("anisotropic", "0", "must be 0"),
    float("spec_tint", "0", "must be 0"),
    float("spec_trans", "0", "must be 0"),
    float("sheen", "0", "must be 0"),
    float("clearcoat", "0", "must be 0"),
    float("flatness", "0", "must be 0"),
    float("diff_trans", "0", "must be 0"),
];

const REFLECTED: Slot = texture("specular_reflectance");
const TRANSMITTED: Slot = texture("specular_transmittance");
const ALPHA: Slot = texture("alpha");
const BASE: Slot = texture("diffuse_reflectance");

pub(super) const PLUGINS: &[Plugin] = &[
    plugin("null", "Nothing: the hull of a medium.", &[], &[]),
    plugin(
        "diffuse",
        "A Lambertian surface.",
        &[&[spectrum("reflectance", "0.5", "0 to 1")]],
        &[texture("reflectance")],
    ),
    plugin(
        "dielectric",
        "A smooth interface.",
        &[INDICES, REFLECTANCE, TRANSMITTANCE],
        &[],
    ),
    plugin(
        "roughdielectric",
        "A rough interface.",
        &[INDICES, REFLECTANCE, TRANSMITTANCE, ROUGHNESS],
        &[REFLECTED, TRANSMITTED, ALPHA],
    ),
    plugin(
        "thindielectric",
        "A pane without thickness.",
        &[PANE, REFLECTANCE, TRANSMITTANCE],
        &[REFLECTED, TRANSMITTED],
    ),
    plugin(
        "conductor",
        "A smooth metal.",
        &[METAL, REFLECTANCE],
        &[REFLECTED],
    ),
    plugin(
        "roughconductor",
        "A rough metal.",
        &[METAL, REFLECTANCE, ROUGHNESS],
        &[REFLECTED, ALPHA],
    ),
    plugin(
        "plastic",
        "A diffuse base under a smooth coat.",
        &[COAT, REFLECTANCE],
        &[BASE, REFLECTED],
    ),
    plugin(
        "roughplastic",
        "A diffuse base under a rough coat.",
        &[COAT, REFLECTANCE, ROUGHNESS, LOSSLESS],
        &[BASE, REFLECTED, ALPHA],
    ),
    plugin(
        "principled",
        "The opaque part of Disney's model.",
        &[PRINCIPLED],
        &[
            texture("base_color"),
            texture("roughness"),
            texture("metallic"),
        ],
    ),
    plugin(
        "blendbsdf",
        "A mixture of two bsdfs.",
        &[&[spectrum("weight", "0.5", "of the second, 0 to 1")]],
        &[texture("weight"), many(Bsdf, "The two.")],
    ),
    plugin(
        "mask",
        "A bsdf on a share of the surface.",
        &[&[spectrum("opacity", "0.5", "the share, 0 to 1")]],
        &[texture("opacity"), one(Bsdf, "What covers the share.")],
    ),
    plugin(
        "twosided",
        "One bsdf on both sides, or one on each.",
        &[],
        &[many(Bsdf, "That on the side of the normal, the other.")],
    ),
];
