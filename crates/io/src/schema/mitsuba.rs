//! What of the table Mitsuba 3.9.1 does not have.

use crate::scene::PluginKind;

/// Plugins that Mitsuba does not have.
const PLUGINS: &[(PluginKind, &[&str])] = &[
    (
        PluginKind::Bsdf,
        &[
            "coating",
            "mixturebsdf",
            "phong",
            "roughcoating",
            "roughdiffuse",
            "ward",
        ],
    ),
    (
        PluginKind::Emitter,
        &["collimated", "fiber", "ies", "volumelight"],
    ),
    (
        PluginKind::Integrator,
        &["auto", "bdpt", "particle", "photon", "sppm", "vcm"],
    ),
    (PluginKind::Medium, &["transparent"]),
    (PluginKind::Phase, &["mie", "mixturephase", "vmf"]),
    (PluginKind::Sampler, &["halton", "hammersley", "sobol"]),
    (PluginKind::Sensor, &["fluencemeter", "telecentric"]),
    (PluginKind::Shape, &["gltf", "hair", "labels", "mesh"]),
    (PluginKind::Texture, &["scale"]),
    (
        PluginKind::Volume,
        &[
            "acoustic",
            "bspline",
            "cauchy",
            "constant",
            "expression",
            "fisheye",
            "gaussian",
            "gladstone_dale",
            "linear",
            "linear_square",
            "luneburg",
            "mode",
            "pressure",
            "profile",
            "selfoc",
            "sellmeier",
            "standard_atmosphere",
            "sum",
            "transducer",
        ],
    ),
];

/// Parameters and roles that plugins of a kind have here alone.
const PARAMETERS: &[(PluginKind, &[&str])] = &[
    (PluginKind::Bsdf, &["ext_eta", "lossless"]),
    (
        PluginKind::Film,
        &[
            "bin_width",
            "decomposition",
            "max_bounces",
            "max_bound",
            "min_bound",
            "reweight",
            "speed_of_light",
            "wavelengths",
        ],
    ),
    (
        PluginKind::Integrator,
        &["reference_index", "reflections", "tolerance", "wavelength"],
    ),
    (
        PluginKind::Medium,
        &[
            "blood",
            "emission",
            "ior",
            "material",
            "saturation",
            "sigma_a",
            "sigma_s",
            "tissue",
            "water",
        ],
    ),
    (
        PluginKind::Sampler,
        &["adaptive", "bending", "phases", "set"],
    ),
    (
        PluginKind::Sensor,
        &[
            "bin_width",
            "cosine_axis",
            "cosine_bins",
            "focus_point",
            "max_bound",
            "min_bound",
            "normalization",
            "nu",
            "nv",
            "parts",
        ],
    ),
    (PluginKind::Shape, &["capped"]),
    (
        PluginKind::Volume,
        &["axis_order", "dataset", "offset", "placement", "scale"],
    ),
];

/// Parameters that Mitsuba has for other plugins of a kind, but not for these.
const OF_OTHERS: &[(PluginKind, &str, &[&str])] = &[
    (PluginKind::Integrator, "aov", &["max_depth", "rr_depth"]),
    (PluginKind::Integrator, "direct", &["rr_depth"]),
    (PluginKind::Integrator, "ptracer", &["block_size"]),
    (PluginKind::Sampler, "multijitter", &["strength"]),
    (PluginKind::Sampler, "stratified", &["strength"]),
];

/// Whether Mitsuba has a plugin.
pub(crate) fn has_plugin(kind: PluginKind, name: &str) -> bool {
    !lists(PLUGINS, kind, name)
}

/// Whether a plugin of Mitsuba has a parameter or a role.
pub(crate) fn has_parameter(kind: PluginKind, plugin: &str, name: &str) -> bool {
    let mut others = OF_OTHERS.iter();
    let lacks =
        others.any(|(of, this, names)| *of == kind && *this == plugin && names.contains(&name));
    !lacks && !lists(PARAMETERS, kind, name)
}

fn lists(table: &[(PluginKind, &[&str])], kind: PluginKind, name: &str) -> bool {
    let mut rows = table.iter().filter(|(of, _)| *of == kind);
    rows.any(|(_, names)| names.contains(&name))
}
