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
    index("ext_ior", "index around it").or_text("air"),
];

const COAT: &[Parameter] = &[
    index("int_ior", "index of the coat").or(1.49),
    index("ext_ior", "index outside").or_text("air"),
    spectrum("diffuse_reflectance", "of the base, 0 to 1").or(0.5),
    boolean(
        "nonlinear",
        false,
        "whether colours deepen with each reflection below the coat",
    ),
];

const REFLECTANCE: &[Parameter] = &[spectrum(
    "specular_reflectance",
    "factor of what is reflected, 0 to 1",
)
.or(1.0)];

const TRANSMITTANCE: &[Parameter] = &[spectrum(
    "specular_transmittance",
    "factor of what is transmitted, 0 to 1",
)
.or(1.0)];

const FACETS: &[Parameter] = &[
    word(
        "distribution",
        &["beckmann", "ggx"],
        "of the normals of microfacets",
    ),
    boolean("sample_visible", true, "accepted and ignored"),
];

const LOSSLESS: &[Parameter] = &[boolean(
    "lossless",
    false,
    "whether the base gets what facets send to their neighbours",
)];

const METAL: &[Parameter] = &[
    spectrum(
        "eta",
        "real part of the index, ≥ 0; a mirror without eta, k and material",
    )
    .or(0.0),
    spectrum("k", "imaginary part of the index, ≥ 0").or(1.0),
    word("material", &METAL_NAMES, "a metal, in place of eta and k"),
    index("ext_eta", "what eta and k are divided by").or(1.0),
];

const PRINCIPLED: &[Parameter] = &[
    spectrum("base_color", "0 to 1").or(0.5),
    spectrum("roughness", "0 to 1").or(0.5),
    spectrum(
        "anisotropic",
        "how much rougher facets are along u than along v, 0 to 1",
    )
    .or(0.0),
    spectrum("spec_trans", "share that lets light through, 0 to 1").or(0.0),
    spectrum("spec_tint", "colour of highlights, 0 to 1").or(0.0),
    spectrum("sheen", "at grazing angles, 0 to 1").or(0.0),
    spectrum("sheen_tint", "colour of the sheen, 0 to 1").or(0.0),
    spectrum(
        "flatness",
        "share that looks like scattering below the surface, 0 to 1",
    )
    .or(0.0),
    float("diffuse_reflectance_sampling_rate", "accepted and ignored").or(1.0),
];

const PRINCIPLED_SOLID: &[Parameter] = &[
    spectrum("metallic", "share of metal, 0 to 1").or(0.0),
    spectrum("clearcoat", "a coat over all, 0 to 1").or(0.0),
    spectrum("clearcoat_gloss", "how smooth the coat is, 0 to 1").or(0.0),
    float("specular", "strength of highlights")
        .within(0.0, 1.0)
        .or(0.5),
    float(
        "eta",
        "index inside over that outside, in place of specular",
    )
    .positive(),
    float("main_specular_sampling_rate", "accepted and ignored").or(1.0),
    float("clearcoat_sampling_rate", "accepted and ignored").or(1.0),
];

const PRINCIPLED_THIN: &[Parameter] = &[
    spectrum(
        "diff_trans",
        "twice the share of diffuse light that passes, 0 to 2",
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
    spectrum("diffuse_reflectance", "of the diffuse part, 0 to 1").or(0.5),
    spectrum("specular_reflectance", "of the glossy part, 0 to 1").or(0.2),
];

const ALPHAS: &[Parameter] = &[
    float("alpha", "roughness").within(1e-4, 1.0).or(0.1),
    float(
        "alpha_u",
        "roughness along u, in place of alpha, with alpha_v",
    )
    .within(1e-4, 1.0),
    float("alpha_v", "roughness across that, along v").within(1e-4, 1.0),
];

const COAT_ALPHAS: &[Parameter] = &[
    float("alpha", "roughness").within(1e-4, 1.0).or(0.1),
    float("alpha_u", "in place of alpha, with an equal alpha_v").within(1e-4, 1.0),
    float("alpha_v", "in place of alpha, with an equal alpha_u").within(1e-4, 1.0),
];

const LAYER: &[Parameter] = &[
    index("int_ior", "index of the layer").or(1.5046),
    index("ext_ior", "index outside").or_text("air"),
    spectrum("sigma_a", "absorption coefficient of the layer, ≥ 0").or(0.0),
    float("thickness", "in inverse units of sigma_a")
        .at_least(0.0)
        .or(1.0),
];

const FILTER: &[Parameter] = &[spectrum("transmittance", "factor, 0 to 1").or(1.0)];
const ANGLE: &[Parameter] = &[spectrum("theta", "angle of its axis, degrees").or(0.0)];

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
        "whether normals that face away from the viewer are turned by half a turn",
    ),
    boolean(
        "use_shadowing_function",
        true,
        "whether bumps dim light from low directions",
    ),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin("null", "Nothing: the hull of a medium.", &[], &[]),
    plugin(
        "diffuse",
        "A Lambertian surface.",
        &[&[spectrum("reflectance", "0 to 1").or(0.5)]],
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
                index("int_ior", "index inside").or(1.49),
                index("ext_ior", "index outside").or_text("air"),
                float("eta", "index inside over that outside, in place of both").positive(),
                spectrum("diffuse_reflectance", "of the base, 0 to 1").or(0.5),
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
                true,
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
            &[boolean("left_handed", false, "which light passes")],
        ],
        &[],
    ),
    plugin(
        "retarder",
        "A filter that delays fields across an axis: all unpolarised light passes.",
        &[
            FILTER,
            ANGLE,
            &[spectrum("delta", "delay of phase, degrees").or(90.0)],
        ],
        &[texture("theta"), texture("delta")],
    ),
    own_plugin(
        "roughdiffuse",
        "Cavities with Lambertian walls.",
        &[&[
            spectrum("reflectance", "0 to 1").or(0.5),
            spectrum("alpha", "√2 times the standard deviation of slopes, ≥ 0").or(0.2),
            boolean(
                "use_fast_approx",
                false,
                "whether light between the walls is left out",
            ),
        ]],
        &[texture("reflectance"), ALPHA],
    ),
    own_plugin(
        "phong",
        "A diffuse part, and a lobe around the mirror's direction.",
        &[
            &[spectrum("exponent", "of the lobe's cosine, ≥ 0").or(30.0)],
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
            "their shares, ≥ 0; what is missing from 1 is black",
        )
        .required()]],
        &[many(Bsdf, "As many as there are shares, opaque.")],
    ),
    plugin(
        "blendbsdf",
        "A mixture of two bsdfs.",
        &[&[spectrum("weight", "of the second, 0 to 1").or(0.5)]],
        &[texture("weight"), many(Bsdf, "The two.")],
    ),
    plugin(
        "mask",
        "A bsdf on a share of the surface.",
        &[&[spectrum("opacity", "the share, 0 to 1").or(0.5)]],
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
            &[float("scale", "a factor of the heights").or(1.0)],
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
