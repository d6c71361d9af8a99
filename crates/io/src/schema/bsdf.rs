//! Bsdfs.

use super::metals::METAL_NAMES;
use super::parameter::{boolean, float, index, list, spectrum, word};
use super::row::{many, one, own_plugin, plugin, role, texture};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Bsdf, Texture};

const INDICES: &[Parameter] = &[
    index("int_ior", "index inside: a number or a substance").or_computed("see the index rules"),
    index("ext_ior", "index outside: a number or a substance").or_computed("see the index rules"),
];

const PANE: &[Parameter] = &[
    index("int_ior", "index of the pane").or(1.5046),
    index("ext_ior", "index around the pane").or_text("air"),
];

const COAT: &[Parameter] = &[
    index("int_ior", "index of the coat").or(1.49),
    index("ext_ior", "index outside").or_text("air"),
    spectrum("diffuse_reflectance", "reflectance of the base, 0 to 1").or(0.5),
    boolean(
        "nonlinear",
        false,
        "true if each reflection below the coat deepens the colour",
    ),
];

const REFLECTANCE: &[Parameter] = &[spectrum(
    "specular_reflectance",
    "factor of the reflected light, 0 to 1",
)
.or(1.0)];

const TRANSMITTANCE: &[Parameter] = &[spectrum(
    "specular_transmittance",
    "factor of the transmitted light, 0 to 1",
)
.or(1.0)];

const FACETS: &[Parameter] = &[
    word(
        "distribution",
        &["beckmann", "ggx"],
        "distribution of the normals of microfacets",
    ),
    boolean("sample_visible", true, "accepted and ignored"),
];

const LOSSLESS: &[Parameter] = &[boolean(
    "lossless",
    false,
    "true to give the base the light that facets reflect to each other",
)];

const METAL: &[Parameter] = &[
    spectrum(
        "eta",
        "real part of the index, ≥ 0; a mirror without eta, k and material",
    )
    .or(0.0),
    spectrum("k", "imaginary part of the index, ≥ 0").or(1.0),
    word(
        "material",
        &METAL_NAMES,
        "name of a metal, instead of eta and k",
    ),
    index("ext_eta", "index outside, by which eta and k are divided").or(1.0),
];

const PRINCIPLED: &[Parameter] = &[
    spectrum("base_color", "colour of the base, 0 to 1").or(0.5),
    spectrum("roughness", "roughness of the facets, 0 to 1").or(0.5),
    spectrum(
        "anisotropic",
        "anisotropy of the roughness: 0 for none, 1 for far rougher facets along u than along v, 0 to 1",
    )
    .or(0.0),
    spectrum("spec_trans", "fraction that transmits light, 0 to 1").or(0.0),
    spectrum("spec_tint", "tint of highlights towards the base colour, 0 to 1").or(0.0),
    spectrum("sheen", "strength of the sheen at grazing angles, 0 to 1").or(0.0),
    spectrum("sheen_tint", "tint of the sheen towards the base colour, 0 to 1").or(0.0),
    spectrum(
        "flatness",
        "fraction that looks like subsurface scattering, 0 to 1",
    )
    .or(0.0),
    float("diffuse_reflectance_sampling_rate", "accepted and ignored").or(1.0),
];

const PRINCIPLED_SOLID: &[Parameter] = &[
    spectrum("metallic", "fraction of metal, 0 to 1").or(0.0),
    spectrum(
        "clearcoat",
        "strength of a coat over the whole surface, 0 to 1",
    )
    .or(0.0),
    spectrum("clearcoat_gloss", "smoothness of the coat, 0 to 1").or(0.0),
    float("specular", "strength of highlights")
        .within(0.0, 1.0)
        .or(0.5),
    float(
        "eta",
        "ratio of the indices inside and outside, instead of specular",
    )
    .positive(),
    float("main_specular_sampling_rate", "accepted and ignored").or(1.0),
    float("clearcoat_sampling_rate", "accepted and ignored").or(1.0),
];

const PRINCIPLED_THIN: &[Parameter] = &[
    spectrum(
        "diff_trans",
        "twice the fraction of diffuse light that is transmitted, 0 to 2",
    )
    .or(0.0),
    float("eta", "index of the sheet").positive().or(1.5),
    float("specular_reflectance_sampling_rate", "accepted and ignored").or(1.0),
    float(
        "specular_transmittance_sampling_rate",
        "accepted and ignored",
    )
    .or(1.0),
    float(
        "diffuse_transmittance_sampling_rate",
        "accepted and ignored",
    )
    .or(1.0),
];

const GLOSSY: &[Parameter] = &[
    spectrum(
        "diffuse_reflectance",
        "reflectance of the diffuse part, 0 to 1",
    )
    .or(0.5),
    spectrum(
        "specular_reflectance",
        "reflectance of the glossy part, 0 to 1",
    )
    .or(0.2),
];

const ALPHAS: &[Parameter] = &[
    float("alpha", "roughness").within(1e-4, 1.0).or(0.1),
    float(
        "alpha_u",
        "roughness along u, together with alpha_v, instead of alpha",
    )
    .within(1e-4, 1.0),
    float(
        "alpha_v",
        "roughness along v, together with alpha_u, instead of alpha",
    )
    .within(1e-4, 1.0),
];

const COAT_ALPHAS: &[Parameter] = &[
    float("alpha", "roughness").within(1e-4, 1.0).or(0.1),
    float("alpha_u", "roughness instead of alpha; must equal alpha_v").within(1e-4, 1.0),
    float("alpha_v", "roughness instead of alpha; must equal alpha_u").within(1e-4, 1.0),
];

const LAYER: &[Parameter] = &[
    index("int_ior", "index of the layer").or(1.5046),
    index("ext_ior", "index outside").or_text("air"),
    spectrum("sigma_a", "absorption coefficient of the layer, ≥ 0").or(0.0),
    float(
        "thickness",
        "thickness of the layer, in inverse units of sigma_a",
    )
    .at_least(0.0)
    .or(1.0),
];

const FILTER: &[Parameter] = &[spectrum("transmittance", "factor, 0 to 1").or(1.0)];
const ANGLE: &[Parameter] = &[spectrum("theta", "angle of the axis, degrees").or(0.0)];

const REFLECTED: Slot = texture("specular_reflectance");
const TRANSMITTED: Slot = texture("specular_transmittance");
const ALPHA: Slot = texture("alpha");
const ALPHA_U: Slot = texture("alpha_u");
const ALPHA_V: Slot = texture("alpha_v");
const BASE: Slot = texture("diffuse_reflectance");

const TURNED_NORMALS: &[Parameter] = &[
    boolean(
        "flip_invalid_normals",
        true,
        "true to reverse normals that face away from the viewer",
    ),
    boolean(
        "use_shadowing_function",
        true,
        "true to dim light at grazing angles by the shadows of bumps",
    ),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin("null", "Nothing: the hull of a medium.", &[], &[]),
    plugin(
        "diffuse",
        "A Lambertian surface.",
        &[&[spectrum("reflectance", "reflectance, 0 to 1").or(0.5)]],
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
        "A diffuse base under a smooth surface, with a reflection by microfacets.",
        &[
            &[
                index("int_ior", "index inside").or(1.49),
                index("ext_ior", "index outside").or_text("air"),
                float(
                    "eta",
                    "ratio of the indices inside and outside, instead of both",
                )
                .positive(),
                spectrum("diffuse_reflectance", "reflectance of the base, 0 to 1").or(0.5),
            ],
            REFLECTANCE,
            ALPHAS,
            FACETS,
        ],
        &[BASE, REFLECTED, ALPHA, ALPHA_U, ALPHA_V],
    ),
    plugin(
        "polarizer",
        "A linear polariser: half of unpolarised light passes.",
        &[
            FILTER,
            ANGLE,
            &[boolean(
                "polarizing",
                true,
                "false: half of the light passes, whatever its polarisation",
            )],
        ],
        &[texture("theta")],
    ),
    plugin(
        "circular",
        "A filter that lets circular light pass: half of unpolarised light.",
        &[
            FILTER,
            &[boolean(
                "left_handed",
                false,
                "handedness of the light that passes",
            )],
        ],
        &[],
    ),
    plugin(
        "retarder",
        "A retarder, which delays the field across its axis: all light passes.",
        &[
            FILTER,
            ANGLE,
            &[spectrum("delta", "phase delay, degrees").or(90.0)],
        ],
        &[texture("theta"), texture("delta")],
    ),
    own_plugin(
        "roughdiffuse",
        "Cavities with Lambertian walls.",
        &[&[
            spectrum("reflectance", "reflectance, 0 to 1").or(0.5),
            spectrum("alpha", "√2 times the standard deviation of slopes, ≥ 0").or(0.2),
            boolean(
                "use_fast_approx",
                false,
                "true to leave out interreflection between the walls",
            ),
        ]],
        &[texture("reflectance"), ALPHA],
    ),
    own_plugin(
        "phong",
        "A diffuse part and a lobe around the mirror direction.",
        &[
            &[spectrum("exponent", "exponent of the lobe's cosine, ≥ 0").or(30.0)],
            GLOSSY,
        ],
        &[texture("exponent"), BASE, REFLECTED],
    ),
    own_plugin(
        "ward",
        "A diffuse part, and Ward's lobe.",
        &[GLOSSY, ALPHAS],
        &[BASE, REFLECTED, ALPHA, ALPHA_U, ALPHA_V],
    ),
    own_plugin(
        "coating",
        "A smooth layer over another bsdf.",
        &[LAYER, REFLECTANCE],
        &[
            texture("sigma_a"),
            REFLECTED,
            one(Bsdf, "What lies below, opaque."),
        ],
    ),
    own_plugin(
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
    own_plugin(
        "mixturebsdf",
        "A mixture of any number of bsdfs.",
        &[&[list(
            "weights",
            "weights of the bsdfs, ≥ 0; the rest to 1 is black",
        )
        .required()]],
        &[many(Bsdf, "As many as there are shares, opaque.")],
    ),
    plugin(
        "blendbsdf",
        "A mixture of two bsdfs.",
        &[&[spectrum("weight", "weight of the second bsdf, 0 to 1").or(0.5)]],
        &[texture("weight"), many(Bsdf, "The two.")],
    ),
    plugin(
        "mask",
        "A bsdf on a fraction of the surface.",
        &[&[spectrum(
            "opacity",
            "fraction of the surface that the bsdf covers, 0 to 1",
        )
        .or(0.5)]],
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
        "A bsdf with shading normals from a height map; smooth interfaces keep their normals.",
        &[
            &[float("scale", "factor of the heights").or(1.0)],
            TURNED_NORMALS,
        ],
        &[
            one(Bsdf, "What the surface is."),
            one(Texture, "The heights, scene units: a bilinear bitmap."),
        ],
    ),
    plugin(
        "normalmap",
        "A bsdf with shading normals from a normal map; smooth interfaces keep their normals.",
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
