//! Bsdfs.

use super::row::{float, index, plugin, spectrum, word};
use super::{Parameter, Plugin};

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
    word("distribution", &["ggx"], "of the normals of microfacets"),
];

const METAL: &[Parameter] = &[
    spectrum(
        "eta",
        "",
        "real part of the index, ≥ 0; a mirror without eta and k",
    ),
    spectrum("k", "", "imaginary part of the index, ≥ 0"),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin("null", "Nothing: the hull of a medium.", &[], &[]),
    plugin(
        "diffuse",
        "A Lambertian surface.",
        &[&[spectrum("reflectance", "0.5", "0 to 1")]],
        &[],
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
        &[],
    ),
    plugin("conductor", "A smooth metal.", &[METAL, REFLECTANCE], &[]),
    plugin(
        "roughconductor",
        "A rough metal.",
        &[METAL, REFLECTANCE, ROUGHNESS],
        &[],
    ),
];
