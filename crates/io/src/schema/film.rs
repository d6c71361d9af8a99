//! Films, filters and samplers.

use super::parameter::{boolean, float, integer, list, text, word};
use super::row::{one, plugin};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::Rfilter;

const HDRFILM: &[Parameter] = &[
    integer("width", "width of the image in pixels")
        .within(1.0, 65536.0)
        .or(768.0),
    integer("height", "height of the image in pixels")
        .within(1.0, 65536.0)
        .or(576.0),
    word(
        "pixel_format",
        &["rgb", "luminance", "spectral"],
        "channels of the image",
    ),
    list(
        "wavelengths",
        "wavelengths in nm, at most 4096 of them; required if pixel_format is spectral",
    ),
    list(
        "decomposition",
        "criteria that separate light: length, time, bounce, light",
    ),
    float("min_bound", "start of the first bin, for length or time").or(0.0),
    float("max_bound", "end of the last bin, for length or time"),
    float("bin_width", "width of a bin, for length or time").positive(),
    float(
        "speed_of_light",
        "speed of light in scene units per unit of time, for time",
    )
    .positive(),
    integer("max_bounces", "last layer, for bounce").within(0.0, 1000.0),
    boolean(
        "reweight",
        false,
        "true to add an image with less weight for rare bright samples",
    ),
    integer("crop_offset_x", "columns left of the crop window")
        .at_least(0.0)
        .or(0.0),
    integer("crop_offset_y", "rows above the crop window")
        .at_least(0.0)
        .or(0.0),
    integer("crop_width", "columns of the picture")
        .at_least(1.0)
        .or_computed("the remaining ones"),
    integer("crop_height", "rows of the picture")
        .at_least(1.0)
        .or_computed("the remaining ones"),
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
    plugin("box", "The area of the pixel.", &[], &[]),
    plugin(
        "tent",
        "A filter that falls off linearly.",
        &[&[float("radius", "radius of the filter in pixels")
            .within(0.1, 32.0)
            .or(1.0)]],
        &[],
    ),
    plugin(
        "gaussian",
        "A Gaussian, cut off at four standard deviations.",
        &[&[
            float("stddev", "standard deviation of the filter in pixels")
                .within(0.025, 8.0)
                .or(0.5),
        ]],
        &[],
    ),
    plugin(
        "mitchell",
        "Cubics of Mitchell and Netravali, negative in places.",
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
        "Cubics of Catmull and Rom, negative in places.",
        &[],
        &[],
    ),
    plugin(
        "lanczos",
        "A sinc in the window of a wider sinc, negative in places.",
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
        "Replaced by ldsampler, with a warning.",
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
    boolean("bending", true, "true if sound bends rays"),
    boolean(
        "adaptive",
        false,
        "true to give noisy pixels more samples, with the integrator path",
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
