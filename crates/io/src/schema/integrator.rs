//! Integrators.

use super::parameter::{boolean, float, integer, list, word};
use super::row::{many, own_plugin, plugin, role};
use super::{Parameter, Plugin};
use crate::PluginKind::{Integrator, Volume};

const DEPTH: &[Parameter] = &[
    integer("max_depth", "longest path in edges; -1 for no limit")
        .within(-1.0, 1e6)
        .or(-1.0),
];

const COMMON: &[Parameter] = &[
    integer("rr_depth", "edges after which Russian roulette begins")
        .within(1.0, 1e6)
        .or(5.0),
    float(
        "tolerance",
        "position error of a ray per unit of its length",
    )
    .within(1e-12, 1e-4)
    .or(1e-6),
    integer(
        "reflections",
        "reflections at smooth dielectrics that connections may take",
    )
    .within(0.0, 28.0)
    .or(0.0),
    boolean(
        "hide_emitters",
        false,
        "whether light straight from emitters is left out",
    ),
    float("timeout", "accepted and ignored: see --time").or(-1.0),
    integer("samples_per_pass", "accepted and ignored"),
    integer("block_size", "accepted and ignored"),
];

const DIRECT: &[Parameter] = &[
    integer("shading_samples", "accepted and ignored")
        .within(0.0, 1e6)
        .or(1.0),
    integer("emitter_samples", "accepted and ignored")
        .within(0.0, 1e6)
        .or(1.0),
    integer("bsdf_samples", "accepted and ignored")
        .within(0.0, 1e6)
        .or(1.0),
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
        "quantities to show: `TYPE`, or `NAME:TYPE` as in Mitsuba",
    )
    .or_computed("all of the way"),
    float(
        "reference_index",
        "index of which optical path differences are taken",
    )
    .as_index()
    .or_computed("that of the surroundings"),
    float(
        "wavelength",
        "in vacuum, scene units: what is counted as a wave",
    )
    .positive(),
];

/// Parameters that set how tagged light is separated.
pub(super) const TAGGED: &[Parameter] = &[
    float("wavelength", "of the light in vacuum, scene units").positive(),
    integer("orders", "the last sideband")
        .within(0.0, 100.0)
        .or(1.0),
    integer(
        "delays",
        "steps of the delay of correlations up to half a period of the sound",
    )
    .within(0.0, 1000.0)
    .or(0.0),
];

const MERGING: &[Parameter] = &[float(
    "radius",
    "how close vertices are that are merged in the first sample, scene units",
)
.positive()
.or_computed("automatic")];

const PHOTONS: &[Parameter] = &[
    integer("photons", "light paths of each map")
        .within(1.0, 1e9)
        .or_computed("number of pixels"),
    float(
        "radius",
        "how far from where they fell photons count, scene units",
    )
    .positive()
    .or_computed("automatic"),
    word(
        "query",
        &["beam", "point"],
        "which photons in media a sensor ray sees",
    ),
];

pub(super) const PLUGINS: &[Plugin] = &[
    own_plugin(
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
    own_plugin(
        "particle",
        "Particle tracing from the emitters.",
        &[DEPTH, COMMON],
        &[],
    ),
    plugin("ptracer", "The same as particle.", &[DEPTH, COMMON], &[]),
    own_plugin(
        "bdpt",
        "Bidirectional path tracing.",
        &[DEPTH, COMMON, BDPT],
        &[],
    ),
    own_plugin(
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
    own_plugin(
        "tagged",
        "Image of its integrator (path, direct, particle or bdpt) with the sidebands to which sound shifts the light.",
        &[TAGGED],
        &[many(Integrator, "The first renders.")],
    ),
    own_plugin(
        "photon",
        "Photon maps of a fixed radius.",
        &[DEPTH, COMMON, PHOTONS],
        &[],
    ),
    own_plugin(
        "sppm",
        "Progressive photon maps.",
        &[DEPTH, COMMON, PHOTONS],
        &[],
    ),
];
