//! Bsdfs.

use super::metals::METAL_NAMES;
use super::row::{boolean, float, index, list, many, one, plugin, role, spectrum, texture, word};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Bsdf, Texture};

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

const FACETS: &[Parameter] = &[
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
    word("material", &METAL_NAMES, "a metal, in place of eta and k"),
    index("ext_eta", "1", "what eta and k are divided by"),
];

const PRINCIPLED: &[Parameter] = &[
    spectrum("base_color", "0.5", "0 to 1"),
    spectrum("roughness", "0.5", "0 to 1"),
    spectrum(
        "anisotropic",
        "0",
        "how much rougher facets are along u than along v, 0 to 1",
    ),
    spectrum("spec_trans", "0", "share that lets light through, 0 to 1"),
    spectrum("spec_tint", "0", "colour of highlights, 0 to 1"),
    spectrum("sheen", "0", "at grazing angles, 0 to 1"),
    spectrum("sheen_tint", "0", "colour of the sheen, 0 to 1"),
    spectrum(
        "flatness",
        "0",
        "share that looks like scattering below the surface, 0 to 1",
    ),
    float(
        "diffuse_reflectance_sampling_rate",
        "1",
        "accepted and ignored",
    ),
];

const PRINCIPLED_SOLID: &[Parameter] = &[
    spectrum("metallic", "0", "share of metal, 0 to 1"),
    spectrum("clearcoat", "0", "a coat over all, 0 to 1"),
    spectrum("clearcoat_gloss", "0", "how smooth the coat is, 0 to 1"),
    float("specular", "0.5", "0 to 1"),
    float(
        "eta",
        "",
        "index inside over that outside, in place of specular",
    ),
    float("main_specular_sampling_rate", "1", "accepted and ignored"),
    float("clearcoat_sampling_rate", "1", "accepted and ignored"),
];

const PRINCIPLED_THIN: &[Parameter] = &[
    spectrum(
        "diff_trans",
        "0",
        "twice the share of diffuse light that passes, 0 to 2",
    ),
    float("eta", "1.5", "index of the sheet"),
    float(
        "specular_reflectance_sampling_rate",
        "1",
        "accepted and ignored",
    ),
    float(
        "specular_transmittance_sampling_rate",
        "1",
        "accepted and ignored",
    ),
    float(
        "diffuse_transmittance_sampling_rate",
        "1",
        "accepted and ignored",
    ),
];

const GLOSSY: &[Parameter] = &[
    spectrum("diffuse_reflectance", "0.5", "of the diffuse part, 0 to 1"),
    spectrum("specular_reflectance", "0.2", "of the glossy part, 0 to 1"),
];

const ALPHAS: &[Parameter] = &[
    float("alpha", "0.1", "roughness, 1e-4 to 1"),
    float(
        "alpha_u",
        "",
        "roughness along u, in place of alpha, with alpha_v",
    ),
    float("alpha_v", "", "roughness across that, along v"),
];

const COAT_ALPHAS: &[Parameter] = &[
    float("alpha", "0.1", "roughness, 1e-4 to 1"),
    float("alpha_u", "", "in place of alpha, with an equal alpha_v"),
    float("alpha_v", "", "see alpha_u"),
];

const LAYER: &[Parameter] = &[
    index("int_ior", "1.5046", "index of the layer"),
    index("ext_ior", "\"air\"", "index outside"),
    spectrum("sigma_a", "0", "absorption coefficient of the layer, ≥ 0"),
    float("thickness", "1", "in inverse units of sigma_a, ≥ 0"),
];

const FILTER: &[Parameter] = &[spectrum("transmittance", "1", "factor, 0 to 1")];
const ANGLE: &[Parameter] = &[spectrum("theta", "0", "angle of its axis, degrees")];

const REFLECTED: Slot = texture("specular_reflectance");
const TRANSMITTED: Slot = texture("specular_transmittance");
const ALPHA: Slot = texture("alpha");
const ALPHA_U: Slot = texture("alpha_u");
const ALPHA_V: Slot = texture("alpha_v");
const BASE: Slot = texture("diffuse_reflectance");

const TURNED_NORMALS: &[Parameter] = &[
    boolean(
        "flip_invalid_normals",
        "true",
        "whether normals that face away from the viewer are turned by half a turn",
    ),
    boolean(
        "use_shadowing_function",
        "true",
        "whether bumps dim light from low directions",
    ),
];

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
        &[INDICES, REFLECTANCE, TRANSMITTANCE, ALPHAS, FACETS],
        &[REFLECTED, TRANSMITTED, ALPHA, ALPHA_U, ALPHA_V],
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
        &[METAL, REFLECTANCE, ALPHAS, FACETS],
        &[REFLECTED, ALPHA, ALPHA_U, ALPHA_V],
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
        &[COAT, REFLECTANCE, COAT_ALPHAS, FACETS, LOSSLESS],
        &[BASE, REFLECTED, ALPHA],
    ),
    plugin(
        "principled",
        "Disney's model of a solid.",
        &[PRINCIPLED, PRINCIPLED_SOLID],
        &[
            texture("base_color"),
            texture("roughness"),
            texture("anisotropic"),
            texture("spec_trans"),
            texture("spec_tint"),
            texture("sheen"),
            texture("sheen_tint"),
            texture("flatness"),
            texture("metallic"),
            texture("clearcoat"),
            texture("clearcoat_gloss"),
        ],
    ),
    plugin(
        "principledthin",
        "Disney's model of a sheet without thickness.",
        &[PRINCIPLED, PRINCIPLED_THIN],
        &[
            texture("base_color"),
            texture("roughness"),
            texture("anisotropic"),
            texture("spec_trans"),
            texture("spec_tint"),
            texture("sheen"),
            texture("sheen_tint"),
            texture("flatness"),
            texture("diff_trans"),
        ],
    ),
    plugin(
        "pplastic",
        "A diffuse base that light reaches through a smooth surface, under facets.",
        &[
            &[
                index("int_ior", "1.49", "index inside"),
                index("ext_ior", "\"air\"", "index outside"),
                float(
                    "eta",
                    "",
                    "index inside over that outside, in place of both",
                ),
                spectrum("diffuse_reflectance", "0.5", "of the base, 0 to 1"),
            ],
            REFLECTANCE,
            ALPHAS,
            FACETS,
        ],
        &[BASE, REFLECTED, ALPHA, ALPHA_U, ALPHA_V],
    ),
    plugin(
        "polarizer",
        "A filter that lets light pass whose field is along an axis: half of unpolarised light.",
        &[
            FILTER,
            ANGLE,
            &[boolean(
                "polarizing",
                "true",
                "false for a filter that lets half of any light pass",
            )],
        ],
        &[texture("theta")],
    ),
    plugin(
        "circular",
        "A filter that lets circular light pass: half of unpolarised light.",
        &[
            FILTER,
            &[boolean("left_handed", "false", "which light passes")],
        ],
        &[],
    ),
    plugin(
        "retarder",
        "A filter that delays fields across an axis: all unpolarised light passes.",
        &[
            FILTER,
            ANGLE,
            &[spectrum("delta", "90", "delay of phase, degrees")],
        ],
        &[texture("theta"), texture("delta")],
    ),
    plugin(
        "roughdiffuse",
        "Cavities with Lambertian walls.",
        &[&[
            spectrum("reflectance", "0.5", "0 to 1"),
            spectrum(
                "alpha",
                "0.2",
                "√2 times the standard deviation of slopes, ≥ 0",
            ),
            boolean(
                "use_fast_approx",
                "false",
                "whether light between the walls is left out",
            ),
        ]],
        &[texture("reflectance"), ALPHA],
    ),
    plugin(
        "phong",
        "A diffuse part, and a lobe around the mirror's direction.",
        &[
            &[spectrum("exponent", "30", "of the lobe's cosine, ≥ 0")],
            GLOSSY,
        ],
        &[texture("exponent"), BASE, REFLECTED],
    ),
    plugin(
        "ward",
        "A diffuse part, and Ward's lobe.",
        &[GLOSSY, ALPHAS],
        &[BASE, REFLECTED, ALPHA, ALPHA_U, ALPHA_V],
    ),
    plugin(
        "coating",
        "A smooth layer over another bsdf.",
        &[LAYER, REFLECTANCE],
        &[
            texture("sigma_a"),
            REFLECTED,
            one(Bsdf, "What lies below, opaque."),
        ],
    ),
    plugin(
        "roughcoating",
        "A rough layer over another bsdf.",
        &[LAYER, REFLECTANCE, COAT_ALPHAS, FACETS],
        &[
            texture("sigma_a"),
            REFLECTED,
            ALPHA,
            one(Bsdf, "What lies below, opaque."),
        ],
    ),
    plugin(
        "mixturebsdf",
        "A mixture of any number of bsdfs.",
        &[&[list(
            "weights",
            "required",
            "their shares, ≥ 0; what is missing from 1 is black",
        )]],
        &[many(Bsdf, "As many as there are shares, opaque.")],
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
    plugin(
        "bumpmap",
        "A bsdf whose shading normals a height map turns; smooth interfaces keep theirs.",
        &[
            &[float("scale", "1", "a factor of the heights")],
            TURNED_NORMALS,
        ],
        &[
            one(Bsdf, "What the surface is."),
            one(Texture, "The heights, scene units: a bilinear bitmap."),
        ],
    ),
    plugin(
        "normalmap",
        "A bsdf whose shading normals a map turns; smooth interfaces keep theirs.",
        &[TURNED_NORMALS],
        &[
            one(Bsdf, "What the surface is."),
            role(
                Texture,
                "normalmap",
                "The normals n, as (n + 1)/2: a raw bitmap.",
            ),
            one(Texture, "The same, without a name."),
        ],
    ),
];
