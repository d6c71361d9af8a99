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
    integer(
        "rr_depth",
        "number of edges after which Russian roulette begins",
    )
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
        "true to leave out light that comes straight from emitters",
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
        "heuristic of multiple importance sampling",
    ),
    word(
        "connections",
        &["resampled", "all"],
        "pairs of vertices to connect",
    ),
];

const AOV: &[Parameter] = &[
    list(
        "aovs",
        "quantities to show: `TYPE`, or `NAME:TYPE` as in Mitsuba",
    )
    .or_computed("all quantities of the path"),
    float(
        "reference_index",
        "index of the reference of optical path differences",
    )
    .as_index()
    .or_computed("that of the surroundings"),
    float(
        "wavelength",
        "wavelength in vacuum, scene units, of which optical path differences are multiples",
    )
    .positive(),
];

/// Parameters that set how tagged light is separated.
pub(super) const TAGGED: &[Parameter] = &[
    float(
        "wavelength",
        "wavelength of the light in vacuum, scene units",
    )
    .positive(),
    integer("orders", "number of the last sideband")
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
    "radius within which the first sample merges vertices, scene units",
)
.positive()
.or_computed("automatic")];

const MAPS: &[Parameter] = &[
    integer("photons", "light paths of each map")
        .within(1.0, 1e9)
        .or_computed("number of pixels"),
    PHOTON_RADIUS,
];

const PREVIEW: &[Parameter] = &[
    integer("photons", "light paths of each map")
        .within(1.0, 1e9)
        .or_computed("a quarter of the number of pixels"),
    PHOTON_RADIUS,
];

const PHOTON_RADIUS: Parameter = float("radius", "radius within which photons count, scene units")
    .positive()
    .or_computed("automatic");

const QUERY: &[Parameter] = &[word(
    "query",
    &["beam", "point"],
    "photons in media that a sensor ray gathers",
)];

pub(super) const PLUGINS: &[Plugin] = &[
    own_plugin(
        "auto",
        "Path tracing, particle tracing or bidirectional path tracing, chosen by a pilot render.",
        &[DEPTH, COMMON, BDPT],
        &[],
    ),
    plugin(
        "path",
        "Path tracing from the sensor.",
        &[DEPTH, COMMON],
        &[],
    ),
    plugin("volpath", "Alias of path.", &[DEPTH, COMMON], &[]),
    plugin("volpathmis", "Alias of path.", &[DEPTH, COMMON], &[]),
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
    plugin("ptracer", "Alias of particle.", &[DEPTH, COMMON], &[]),
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
        "Quantities of unscattered rays, instead of light or beside the light of a nested integrator.",
        &[DEPTH, COMMON, AOV],
        &[
            role(
                Volume,
                "reference_index",
                "Index of the reference of optical path differences, where it varies.",
            ),
            many(
                Integrator,
                "As in Mitsuba: the first renders light, and the quantities are further layers.",
            ),
        ],
    ),
    plugin(
        "depth",
        "Distance from the camera to the first surface, instead of light: aov with the quantity depth.",
        &[DEPTH, COMMON],
        &[],
    ),
    plugin(
        "moment",
        "Image of its first integrator, with second moments of the image.",
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
        &[DEPTH, COMMON, MAPS, QUERY],
        &[],
    ),
    own_plugin(
        "sppm",
        "Progressive photon maps.",
        &[DEPTH, COMMON, MAPS, QUERY],
        &[],
    ),
    own_plugin(
        "preview",
        "Quick first picture: path tracing of light that scatters once, progressive photon maps for the rest.",
        &[DEPTH, COMMON, PREVIEW],
        &[],
    ),
];
