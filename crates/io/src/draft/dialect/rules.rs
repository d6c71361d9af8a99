//! Rules that translate the plugins of other dialects.

use super::Implied::{Boolean, Float, Integer, String, Vector};
use super::PluginTranslation;
use crate::scene::PluginKind::{
    self, Bsdf, Emitter, Film, Integrator, Medium, Sampler, Sensor, Shape, Texture, Volume,
};

/// Makes a rule that only changes the name.
const fn same(kind: PluginKind, from: &'static str, to: &'static str) -> PluginTranslation {
    PluginTranslation {
        kind,
        from,
        to,
        old: false,
        renamed: &[],
        dropped: &[],
        kept: None,
        implied: &[],
    }
}

/// Makes a rule that replaces an integrator of Mitsuba 0.6 by another one and keeps its depths.
const fn by(from: &'static str, to: &'static str) -> PluginTranslation {
    PluginTranslation {
        old: true,
        kept: Some(&["max_depth", "rr_depth", "hide_emitters"]),
        ..same(Integrator, from, to)
    }
}

/// Makes a rule for a plugin of Mitsuba 0.6 that keeps its name but drops parameters without
/// effect.
const fn old(
    kind: PluginKind,
    name: &'static str,
    dropped: &'static [&'static str],
) -> PluginTranslation {
    PluginTranslation {
        old: true,
        dropped,
        ..same(kind, name, name)
    }
}

/// Makes a rule that drops the sampling weight of an emitter.
const fn weighted(name: &'static str) -> PluginTranslation {
    PluginTranslation {
        dropped: &["sampling_weight"],
        ..same(Emitter, name, name)
    }
}

/// Parameters of films that control how files are written.
const FILES: &[&str] = &[
    "banner",
    "high_quality_edges",
    "attach_log",
    "gamma",
    "variable",
    "digits",
    "tonemap_method",
];
/// Parameters of cameras for motion.
const SHUTTER: &[&str] = &["shutter_open", "shutter_close"];
/// Parameters of integrators that control sampling.
const METHOD: &[&str] = &["strict_normals"];
/// Parameters of samplers that control their sequences.
const SEQUENCES: &[&str] = &["dimension", "scramble"];
/// Parameters of the fork's medium: its solver, stepper and sampling of distances.
const SOLVER: &[&str] = &[
    "sdf",
    "stepsize",
    "tol2",
    "rrweight",
    "boundaryprecision",
    "cerescheckgradients",
    "ceresgradient_check_relative_precision",
    "ceresmaxiterations",
    "ceresfunctiontolerance",
    "ceresgradienttolerance",
    "ceresparametertolerance",
    "makesensordirectconnections",
    "aggressivetracing",
    "strategy",
    "medium_sampling_weight",
    "sampling_density",
];

/// Translations of all plugins of other dialects.
pub(super) const RULES: &[PluginTranslation] = &[
    // Plugins of the refractive fork.
    PluginTranslation {
        renamed: &[("rif", "ior")],
        dropped: SOLVER,
        ..same(Medium, "heterogeneousrefractive", "homogeneous")
    },
    PluginTranslation {
        dropped: &["send_data", "sendData"],
        implied: &[
            ("placement", String("nodes")),
            ("use_grid_bbox", Boolean(true)),
        ],
        ..same(Volume, "splinevolume", "bspline")
    },
    // Index n = n_o + n_max J_m(kr) cos(mφ) around x, with φ measured from z; `to_world` and the
    // box have no effect.
    PluginTranslation {
        renamed: &[
            ("freq", "frequency"),
            ("speed", "sound_speed"),
            ("n_o", "n0"),
            ("n_max", "amplitude"),
            ("mode", "order"),
        ],
        dropped: &["to_world", "min", "max", "send_data", "sendData"],
        implied: &[
            ("frequency", Float(832_000.0)),
            ("sound_speed", Float(1500.0)),
            ("n0", Float(1.3333)),
            ("amplitude", Float(0.0)),
            ("order", Integer(0)),
            ("direction", Vector(1.0, 0.0, 0.0)),
            ("reference", Vector(0.0, 0.0, 1.0)),
        ],
        ..same(Volume, "acousticrifvolume", "acoustic")
    },
    same(Bsdf, "hdielectric", "dielectric"),
    same(Bsdf, "hroughdielectric", "roughdielectric"),
    // Plugins of Mitsuba 0.5 and 0.6. `difftrans` is a sheet that transmits all its diffuse light.
    PluginTranslation {
        old: true,
        renamed: &[
            ("transmittance", "base_color"),
            ("diffuse_transmittance", "base_color"),
        ],
        implied: &[("diff_trans", Float(2.0))],
        ..same(Bsdf, "difftrans", "principledthin")
    },
    old(Texture, "bitmap", &["max_anisotropy", "cache", "gamma"]),
    PluginTranslation {
        old: true,
        implied: &[("name", String("vertex_color"))],
        ..same(Texture, "vertexcolors", "mesh_attribute")
    },
    PluginTranslation {
        old: true,
        renamed: &[("diffuse_reflectance", "reflectance")],
        ..same(Bsdf, "roughdiffuse", "roughdiffuse")
    },
    PluginTranslation {
        old: true,
        renamed: &[("diffuse_reflectance", "reflectance")],
        ..same(Bsdf, "diffuse", "diffuse")
    },
    // Drop the variant: variants differ only at grazing angles.
    old(Bsdf, "ward", &["variant"]),
    PluginTranslation {
        dropped: FILES,
        ..same(Film, "hdrfilm", "hdrfilm")
    },
    PluginTranslation {
        old: true,
        dropped: FILES,
        implied: &[("width", Integer(1)), ("height", Integer(1))],
        ..same(Film, "mfilm", "hdrfilm")
    },
    PluginTranslation {
        dropped: FILES,
        ..same(Film, "ldrfilm", "hdrfilm")
    },
    PluginTranslation {
        dropped: FILES,
        ..same(Film, "tiledhdrfilm", "hdrfilm")
    },
    old(Sensor, "perspective", SHUTTER),
    old(Sensor, "thinlens", SHUTTER),
    old(Sensor, "orthographic", SHUTTER),
    old(Integrator, "path", METHOD),
    old(Integrator, "volpath", METHOD),
    PluginTranslation {
        dropped: METHOD,
        ..same(Integrator, "volpath_simple", "volpath")
    },
    PluginTranslation {
        old: true,
        dropped: &["light_image", "sample_direct", "show_weighted"],
        ..same(Integrator, "bdpt", "bdpt")
    },
    old(Integrator, "direct", METHOD),
    old(Integrator, "ptracer", &["granularity", "brute_force"]),
    by("photonmapper", "photon"),
    by("ppm", "photon"),
    by("sppm", "sppm"),
    by("pssmlt", "bdpt"),
    by("mlt", "bdpt"),
    by("erpt", "bdpt"),
    PluginTranslation {
        implied: &[("max_depth", Integer(5))],
        ..by("vpl", "path")
    },
    old(Sampler, "independent", SEQUENCES),
    old(Sampler, "ldsampler", SEQUENCES),
    old(Sampler, "stratified", SEQUENCES),
    old(Sampler, "halton", SEQUENCES),
    old(Sampler, "hammersley", SEQUENCES),
    old(Sampler, "sobol", SEQUENCES),
    PluginTranslation {
        old: true,
        renamed: &[("density", "sigma_t")],
        dropped: &["method", "step_size"],
        ..same(Medium, "heterogeneous", "heterogeneous")
    },
    PluginTranslation {
        old: true,
        dropped: &["send_data"],
        implied: &[
            ("placement", String("nodes")),
            ("use_grid_bbox", Boolean(true)),
        ],
        ..same(Volume, "gridvolume", "gridvolume")
    },
    PluginTranslation {
        old: true,
        dropped: &["cache", "gamma", "sampling_weight"],
        ..same(Emitter, "envmap", "envmap")
    },
    old(
        Emitter,
        "sunsky",
        &["resolution", "stretch", "extend", "sampling_weight"],
    ),
    weighted("envmap"),
    weighted("point"),
    weighted("spot"),
    weighted("directional"),
    weighted("constant"),
    weighted("area"),
    weighted("projector"),
    PluginTranslation {
        old: true,
        dropped: &["sampling_weight", "intensity"],
        implied: &[("power", Float(1.0))],
        ..weighted("collimated")
    },
    weighted("collimated"),
    old(
        Shape,
        "obj",
        &["max_smooth_angle", "collapse", "flip_tex_coords"],
    ),
    old(Shape, "ply", &["max_smooth_angle", "srgb"]),
    old(Shape, "serialized", &["max_smooth_angle"]),
];
