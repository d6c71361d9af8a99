//! Spectra that plugins compute.

use super::parameter::{boolean, float, list, spectrum, vector};
use super::row::{one, plugin};
use super::{Parameter, Plugin};
use crate::scene::PluginKind;

const RANGE: &[Parameter] = &[
    float("wavelength_min", "smallest wavelength, nm")
        .positive()
        .or(360.0),
    float("wavelength_max", "largest wavelength, nm")
        .positive()
        .or(830.0),
];
pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "d65",
        "Daylight: the illuminant D65, white on a colour film.",
        &[&[
            float("scale", "luminance").or(1.0),
            spectrum("color", "RGB value, times D65"),
        ]],
        &[one(PluginKind::Texture, "A texture, times D65.")],
    ),
    plugin(
        "blackbody",
        "Thermal radiation by Planck's law, W/(m² sr nm).",
        &[
            &[
                float("temperature", "K").positive().required(),
                float("scale", "a factor").or(1.0),
            ],
            RANGE,
        ],
        &[],
    ),
    plugin(
        "regular",
        "Values at wavelengths of equal distance.",
        &[&[
            float("wavelength_min", "first wavelength, nm")
                .positive()
                .required(),
            float("wavelength_max", "last wavelength, nm")
                .positive()
                .required(),
            list("values", "at least two values").required(),
        ]],
        &[],
    ),
    plugin(
        "irregular",
        "Values at wavelengths.",
        &[&[
            list("wavelengths", "wavelengths in nm, increasing").required(),
            list(
                "values",
                "values at the wavelengths, as many as wavelengths",
            )
            .required(),
        ]],
        &[],
    ),
    plugin(
        "uniform",
        "A number, the same in every channel.",
        &[&[float("value", "number").required()], RANGE],
        &[],
    ),
    plugin(
        "srgb",
        "A colour.",
        &[&[
            spectrum("color", "RGB value").required(),
            boolean("unbounded", false, "true to allow values outside [0, 1]"),
        ]],
        &[],
    ),
    plugin(
        "rawconstant",
        "A number, or red, green and blue.",
        &[&[vector("value", "one number, or three numbers").required()]],
        &[],
    ),
];
