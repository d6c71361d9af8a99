//! Spectra that plugins compute.

use super::row::{boolean, float, list, one, plugin, spectrum, vector};
use super::{Parameter, Plugin};
use crate::scene::PluginKind;

const RANGE: &[Parameter] = &[
    float("wavelength_min", "360", "nm"),
    float("wavelength_max", "830", "nm"),
];
pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "d65",
        "Daylight: the illuminant D65, white on a colour film.",
        &[&[
            float("scale", "1", "luminance"),
            spectrum("color", "", "an RGB value, times D65"),
        ]],
        &[one(PluginKind::Texture, "A texture, times D65.")],
    ),
    plugin(
        "blackbody",
        "Thermal radiation by Planck's law, W/(m² sr nm).",
        &[
            &[
                float("temperature", "required", "K, > 0"),
                float("scale", "1", "a factor"),
            ],
            RANGE,
        ],
        &[],
    ),
    plugin(
        "regular",
        "Values at wavelengths of equal distance.",
        &[&[
            float("wavelength_min", "required", "of the first, nm"),
            float("wavelength_max", "required", "of the last, nm"),
            list("values", "required", "two or more"),
        ]],
        &[],
    ),
    plugin(
        "irregular",
        "Values at wavelengths.",
        &[&[
            list("wavelengths", "required", "nm, increasing"),
            list("values", "required", "as many"),
        ]],
        &[],
    ),
    plugin(
        "uniform",
        "A number, the same in every channel.",
        &[&[float("value", "required", "the number")], RANGE],
        &[],
    ),
    plugin(
        "srgb",
        "A colour.",
        &[&[
            spectrum("color", "required", "an RGB value"),
            boolean("unbounded", "false", "whether it may lie outside [0, 1]"),
        ]],
        &[],
    ),
    plugin(
        "rawconstant",
        "A number, or red, green and blue.",
        &[&[vector("value", "required", "one number or three")]],
        &[],
    ),
];
