//! Films, filters and samplers.

use super::row::{boolean, float, integer, list, one, plugin, text, word};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::Rfilter;

const HDRFILM: &[Parameter] = &[
    integer("width", "768", "pixels, 1 to 65536"),
    integer("height", "576", "pixels, 1 to 65536"),
    word(
        "pixel_format",
        &["rgb", "luminance", "spectral"],
        "channels",
    ),
    list(
        "wavelengths",
        "",
        "nm, at most 4096; required if pixel_format is spectral",
    ),
    list(
        "decomposition",
        "",
        "what light is separated by: length, time, bounce, light",
    ),
    float(
        "min_bound",
        "0",
        "of length or time: start of the first bin",
    ),
    float("max_bound", "", "of length or time: end of the last bin"),
    float("bin_width", "", "of length or time: width of a bin, > 0"),
    float(
        "speed_of_light",
        "",
        "of time: scene units per unit of time, > 0",
    ),
    integer("max_bounces", "", "of bounce: the last layer, 0 to 1000"),
    boolean(
        "reweight",
        "false",
        "adds an image with less weight for rare bright samples",
    ),
    integer("crop_offset_x", "0", "columns left out at the left"),
    integer("crop_offset_y", "0", "rows left out at the top"),
    integer("crop_width", "the rest", "columns of the picture"),
    integer("crop_height", "the rest", "rows of the picture"),
    boolean("sample_border", "true", "accepted and ignored"),
    boolean("compensate", "false", "accepted and ignored"),
    text("file_format", "", "accepted and ignored"),
    text("component_format", "", "accepted and ignored"),
];

pub(super) const PLUGINS: &[Plugin] = &[plugin(
    "hdrfilm",
    "An image of radiance.",
    &[HDRFILM],
    &[one(Rfilter, "The reconstruction filter.")],
)];

pub(super) const FILTERS: &[Plugin] = &[
    plugin("box", "The pixel's own area.", &[], &[]),
    plugin(
        "tent",
        "A linear fall-off.",
        &[&[float("radius", "1", "pixels, > 0")]],
        &[],
    ),
    plugin(
        "gaussian",
        "A bell, cut off at four standard deviations.",
        &[&[float("stddev", "0.5", "pixels, > 0")]],
        &[],
    ),
    plugin(
        "mitchell",
        "Mitchell and Netravali's cubics, negative in places.",
        &[&[float("B", "1/3", "-4 to 4"), float("C", "1/3", "-4 to 4")]],
        &[],
    ),
    plugin(
        "catmullrom",
        "Catmull and Rom's cubics, negative in places.",
        &[],
        &[],
    ),
    plugin(
        "lanczos",
        "A sinc in the window of a wider one, negative in places.",
        &[&[integer("lobes", "3", "on either side, 1 to 16")]],
        &[],
    ),
];

pub(super) const SAMPLERS: &[Plugin] = &[
    plugin(
        "independent",
        "Independent random numbers.",
        &[SAMPLES],
        &[],
    ),
    plugin(
        "ldsampler",
        "Low-discrepancy points over the samples of a pixel, in independent replicates.",
        &[SAMPLES, REPLICATES],
        &[],
    ),
    even("stratified"),
    even("multijitter"),
    even("orthogonal"),
    even("halton"),
    even("hammersley"),
    even("sobol"),
];

/// A sampler of Mitsuba that spreads samples evenly, too.
const fn even(name: &'static str) -> Plugin {
    plugin(
        name,
        "ldsampler takes its place, with a warning.",
        &[SAMPLES, REPLICATES, JITTER],
        &[],
    )
}

const JITTER: &[Parameter] = &[
    boolean("jitter", "true", "accepted and ignored"),
    integer("strength", "2", "accepted and ignored"),
];

const REPLICATES: &[Parameter] = &[integer("set", "8", "points of a replicate, 8 or 64")];

const SAMPLES: &[Parameter] = &[
    integer(
        "sample_count",
        "(64 per pixel; 1 000 000 particles)",
        "samples per pixel, or particles in all, ≥ 1",
    ),
    integer("phases", "1", "instants of a period of sound, 1 to 256"),
    boolean("bending", "true", "whether sound bends rays"),
    boolean(
        "adaptive",
        "false",
        "whether noisy pixels get more samples, with the integrator path",
    ),
    integer("seed", "", "accepted and ignored"),
];
