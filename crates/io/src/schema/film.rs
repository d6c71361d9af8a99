//! Films, filters and samplers.

use super::parameter::{boolean, float, integer, list, text, word};
use super::row::{one, plugin};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::Rfilter;

const HDRFILM: &[Parameter] = &[
    integer("width", "pixels").within(1.0, 65536.0).or(768.0),
    integer("height", "pixels").within(1.0, 65536.0).or(576.0),
    word(
        "pixel_format",
        &["rgb", "luminance", "spectral"],
        "channels",
    ),
    list(
        "wavelengths",
        "nm, at most 4096; required if pixel_format is spectral",
    ),
    list(
        "decomposition",
        "what light is separated by: length, time, bounce, light",
    ),
    float("min_bound", "of length or time: start of the first bin").or(0.0),
    float("max_bound", "of length or time: end of the last bin"),
    float("bin_width", "of length or time: width of a bin").positive(),
    float("speed_of_light", "of time: scene units per unit of time").positive(),
    integer("max_bounces", "of bounce: the last layer").within(0.0, 1000.0),
    boolean(
        "reweight",
        false,
        "adds an image with less weight for rare bright samples",
    ),
    integer("crop_offset_x", "columns left out at the left")
        .at_least(0.0)
        .or(0.0),
    integer("crop_offset_y", "rows left out at the top")
        .at_least(0.0)
        .or(0.0),
    integer("crop_width", "columns of the picture")
        .at_least(1.0)
        .or_computed("the rest"),
    integer("crop_height", "rows of the picture")
        .at_least(1.0)
        .or_computed("the rest"),
    boolean("sample_border", true, "accepted and ignored"),
    boolean("compensate", false, "accepted and ignored"),
    text("file_format", "accepted and ignored"),
    text("component_format", "accepted and ignored"),
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
        &[&[float("radius", "pixels").within(0.1, 32.0).or(1.0)]],
        &[],
    ),
    plugin(
        "gaussian",
        "A bell, cut off at four standard deviations.",
        &[&[float("stddev", "pixels").within(0.025, 8.0).or(0.5)]],
        &[],
    ),
    plugin(
        "mitchell",
        "Mitchell and Netravali's cubics, negative in places.",
        &[&[
            float("B", "weight of the first cubic")
                .within(-4.0, 4.0)
                .or(1.0 / 3.0),
            float("C", "weight of the second cubic")
                .within(-4.0, 4.0)
                .or(1.0 / 3.0),
        ]],
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
        &[&[integer("lobes", "on either side").within(1.0, 16.0).or(3.0)]],
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
    old_even("halton"),
    old_even("hammersley"),
    old_even("sobol"),
];

/// Describes a sampler of Mitsuba with evenly spread samples. morgana replaces it by `ldsampler`.
const fn even(name: &'static str) -> Plugin {
    plugin(
        name,
        "ldsampler takes its place, with a warning.",
        &[SAMPLES, REPLICATES, JITTER],
        &[],
    )
}

const JITTER: &[Parameter] = &[
    boolean("jitter", true, "accepted and ignored"),
    integer("strength", "accepted and ignored").or(2.0),
];

const REPLICATES: &[Parameter] =
    &[
        integer("replicate_size", "samples in a replicate, a power of two")
            .within(1.0, 1024.0)
            .or_computed("at most a quarter of the samples"),
    ];

const SAMPLES: &[Parameter] = &[
    integer("sample_count", "samples per pixel, or particles in all")
        .at_least(1.0)
        .or_computed("64 per pixel; 1 000 000 particles"),
    integer("phases", "instants of a period of sound")
        .within(1.0, 256.0)
        .or(1.0),
    boolean("bending", true, "whether sound bends rays"),
    boolean(
        "adaptive",
        false,
        "whether noisy pixels get more samples, with the integrator path",
    ),
    integer("seed", "accepted and ignored"),
];

/// Describes a sampler of only earlier versions of Mitsuba, with evenly spread samples. morgana
/// replaces it by `ldsampler`.
const fn old_even(name: &'static str) -> Plugin {
    Plugin {
        in_mitsuba: false,
        ..even(name)
    }
}
