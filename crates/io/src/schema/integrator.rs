//! Integrators.

use super::row::{boolean, float, integer, list, many, plugin, role, word};
use super::{Parameter, Plugin};
use crate::PluginKind::{Integrator, Volume};

const DEPTH: &[Parameter] = &[integer(
    "max_depth",
    "-1",
    "longest path in edges, ≥ -1; -1 for no limit",
)];

const COMMON: &[Parameter] = &[
    integer(
        "rr_depth",
        "5",
        "edges after which Russian roulette begins, ≥ 1",
    ),
    float(
        "tolerance",
        "1e-6",
        "position error of a ray per unit of its length, 1e-12 to 1e-4",
    ),
    integer(
        "reflections",
        "0",
        "reflections at smooth dielectrics that connections may take, 0 to 28",
    ),
    boolean(
        "hide_emitters",
        "false",
        "whether light straight from emitters is left out",
    ),
    float("timeout", "", "accepted and ignored: see --time"),
    integer("samples_per_pass", "", "accepted and ignored"),
    integer("block_size", "", "accepted and ignored"),
];

const DIRECT: &[Parameter] = &[
    integer("shading_samples", "", "accepted and ignored"),
    integer("emitter_samples", "", "accepted and ignored"),
    integer("bsdf_samples", "", "accepted and ignored"),
];

const BDPT: &[Parameter] = &[
    word(
        "heuristic",
        &["balance", "power"],
        "how the strategies share a path",
    ),
    word(
        "connections",
        &["resampled", "all"],
        "which pairs of vertices are connected",
    ),
];

const AOV: &[Parameter] = &[
    list(
        "aovs",
        "(all of the way)",
        "quantities to show: `TYPE`, or `NAME:TYPE` as in Mitsuba",
    ),
    float(
        "reference_index",
        "(that of the surroundings)",
        "index of which optical path differences are taken, > 0",
    ),
    float(
        "wavelength",
        "",
        "in vacuum, scene units, > 0: what is counted as a wave",
    ),
];

/// What is told apart of tagged light.
pub(super) const TAGGED: &[Parameter] = &[
    float("wavelength", "", "of the light in vacuum, scene units, > 0"),
    integer("orders", "1", "the last sideband, 0 to 100"),
    integer(
        "delays",
        "0",
        "steps of the delay of correlations up to half a period of the sound, 0 to 1000",
    ),
];

const MERGING: &[Parameter] = &[float(
    "radius",
    "(automatic)",
    "how close vertices are that are merged in the first sample, scene units, > 0",
)];

const PHOTONS: &[Parameter] = &[
    integer(
        "photons",
        "(number of pixels)",
        "light paths of each map, 1 to 1e9",
    ),
    float(
        "radius",
        "(automatic)",
        "how far from where they fell photons count, scene units, > 0",
    ),
    word(
        "query",
        &["beam", "point"],
        "which photons in media a sensor ray sees",
    ),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "auto",
        "Path, particle or bidirectional path tracing, whichever a pilot finds best.",
        &[DEPTH, COMMON, BDPT],
        &[],
    ),
    plugin(
        "path",
        "Path tracing from the sensor.",
        &[DEPTH, COMMON],
        &[],
    ),
    plugin("volpath", "The same as path.", &[DEPTH, COMMON], &[]),
    plugin("volpathmis", "The same as path.", &[DEPTH, COMMON], &[]),
    plugin(
        "direct",
        "Light that scatters at most once, by path tracing.",
        &[COMMON, DIRECT],
        &[],
    ),
    plugin(
        "particle",
        "Particle tracing from the emitters.",
        &[DEPTH, COMMON],
        &[],
    ),
    plugin("ptracer", "The same as particle.", &[DEPTH, COMMON], &[]),
    plugin(
        "bdpt",
        "Bidirectional path tracing.",
        &[DEPTH, COMMON, BDPT],
        &[],
    ),
    plugin(
        "vcm",
        "Bidirectional path tracing with merging of vertices: consistent, not unbiased.",
        &[DEPTH, COMMON, BDPT, MERGING],
        &[],
    ),
    plugin(
        "aov",
        "Quantities of unscattered rays, instead of light or beside that of a nested integrator.",
        &[DEPTH, COMMON, AOV],
        &[
            role(
                Volume,
                "reference_index",
                "The index of which optical path differences are taken, where it varies.",
            ),
            many(
                Integrator,
                "As in Mitsuba: the first renders light, and the quantities are further layers.",
            ),
        ],
    ),
    plugin(
        "moment",
        "What the first of its integrators finds, and second moments of it.",
        &[],
        &[many(Integrator, "The first renders.")],
    ),
    plugin(
        "stokes",
        "Image of its integrator (path, direct, particle or bdpt) with the Stokes parameters of the light.",
        &[],
        &[many(Integrator, "The first renders.")],
    ),
    plugin(
        "tagged",
        "Image of its integrator (path, direct, particle or bdpt) with the sidebands to which sound shifts the light.",
        &[TAGGED],
        &[many(Integrator, "The first renders.")],
    ),
    plugin(
        "photon",
        "Photon maps of a fixed radius.",
        &[DEPTH, COMMON, PHOTONS],
        &[],
    ),
    plugin(
        "sppm",
        "Progressive photon maps.",
        &[DEPTH, COMMON, PHOTONS],
        &[],
    ),
];
