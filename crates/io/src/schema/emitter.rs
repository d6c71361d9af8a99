//! Emitters.

use super::row::{
    TO_WORLD, boolean, float, integer, one, plugin, point, role, spectrum, text, texture, vector,
    word,
};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Medium, Texture, Volume};

const PLACED: &[Parameter] = &[TO_WORLD];

const INSIDE: &[Slot] = &[one(Medium, "Accepted: containment decides.")];

const SPOT: &[Parameter] = &[
    spectrum("intensity", "1", "on the axis, W/sr, ≥ 0"),
    float("cutoff_angle", "20", "degrees, > 0 and at most 180"),
    float(
        "beam_width",
        "(¾ of the cut-off)",
        "degrees of full intensity, 0 to cutoff_angle",
    ),
];

const APERTURE: &[Parameter] = &[
    word(
        "profile",
        &["disc", "gaussian", "rectangle"],
        "irradiance across the beam",
    ),
    float(
        "radius",
        "(a thousandth of the scene)",
        "of a disc or Gaussian, scene units, > 0",
    ),
    float(
        "width",
        "(a thousandth of the scene)",
        "of a rectangle along local x, scene units, > 0",
    ),
    float(
        "height",
        "(a thousandth of the scene)",
        "of a rectangle along local y, scene units, > 0",
    ),
];

const BEAM: &[Parameter] = &[
    spectrum("power", "", "W, ≥ 0; this or the irradiance is required"),
    spectrum("irradiance", "", "on the axis, W/m², ≥ 0"),
];

const FIBER: &[Parameter] = &[
    spectrum("power", "required", "W, ≥ 0"),
    float(
        "numerical_aperture",
        "",
        "n sin θ₀, > 0 and at most the index at the end; this or the cutoff_angle is required",
    ),
    float("cutoff_angle", "", "θ₀ in degrees, > 0 and at most 90"),
    word(
        "angular_profile",
        &["uniform", "lambertian", "gaussian"],
        "the same intensity within θ₀, the same radiance, or radiance as exp(−2 sin²θ/sin²θ₀)",
    ),
    float(
        "focus",
        "",
        "distance of the point to which the axes of all cones go, or, < 0, from which they come",
    ),
];

const BEHIND_PICTURE: &[Slot] = &[
    one(Medium, "Accepted: containment decides."),
    role(
        Texture,
        "texture",
        "A bitmap, as a factor of a rectangle's irradiance.",
    ),
];

const ENVMAP: &[Parameter] = &[
    text(
        "filename",
        "required",
        ".exr, .hdr or .pfm; .png, .jpg, .bmp or .tga in sRGB",
    ),
    float("scale", "1", "factor, ≥ 0"),
    boolean("mis_compensation", "false", "accepted and ignored"),
    TO_WORLD,
];

const SUNSKY: &[Parameter] = &[
    float("turbidity", "3", "haze, 1 (none) to 10"),
    spectrum("albedo", "0.3", "of the ground, 0 to 1"),
    vector(
        "sun_direction",
        "(by place and time)",
        "towards the sun, in the world",
    ),
    float("latitude", "35.6894", "degrees, northern > 0"),
    float("longitude", "139.6917", "degrees, eastern > 0"),
    float("timezone", "9", "hours ahead of universal time"),
    integer("year", "2010", "of the date"),
    integer("month", "7", "1 to 12"),
    integer("day", "10", "1 to 31"),
    float("hour", "15", "of local time"),
    float("minute", "0", "of local time"),
    float("second", "0", "of local time"),
    float("sun_scale", "1", "factor of the sun, ≥ 0"),
    float("sky_scale", "1", "factor of the sky, ≥ 0"),
    float(
        "sun_aperture",
        "0.5358",
        "diameter of the sun in degrees, > 0 and < 90; its power stays",
    ),
    boolean("complex_sun", "false", "accepted and ignored"),
    TO_WORLD,
];

const PROJECTOR: &[Parameter] = &[
    spectrum("irradiance", "1", "at unit distance, ≥ 0"),
    float("scale", "1", "factor, ≥ 0"),
    TO_WORLD,
];

const IES: &[Parameter] = &[
    text("filename", "required", "an LM-63 file of type C"),
    spectrum("scale", "1", "factor of the file's intensities, ≥ 0"),
    TO_WORLD,
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "point",
        "The same intensity in all directions.",
        &[
            &[
                point("position", "[0, 0, 0]", "in place of to_world"),
                spectrum("intensity", "1", "W/sr, ≥ 0"),
            ],
            PLACED,
        ],
        INSIDE,
    ),
    plugin(
        "spot",
        "A cone of light along +z.",
        &[SPOT, PLACED],
        &[
            one(Medium, "Accepted: containment decides."),
            role(
                Texture,
                "texture",
                "A factor of the intensity, thrown along +z; cutoff_angle must be below 90.",
            ),
        ],
    ),
    plugin(
        "projector",
        "A point that throws an image along +z.",
        &[super::sensor::VIEW, PROJECTOR],
        &[role(Texture, "irradiance", "A bitmap in its place.")],
    ),
    plugin("ies", "A luminaire that was measured.", &[IES], &[]),
    plugin(
        "directional",
        "Parallel light from outside.",
        &[
            &[
                spectrum("irradiance", "1", "across the direction, W/m², ≥ 0"),
                vector("direction", "[0, 0, 1]", "in place of to_world"),
            ],
            PLACED,
        ],
        INSIDE,
    ),
    plugin(
        "constant",
        "The same radiance from everywhere.",
        &[&[spectrum("radiance", "1", "≥ 0")], PLACED],
        INSIDE,
    ),
    plugin(
        "envmap",
        "An equirectangular image around the scene.",
        &[ENVMAP],
        &[],
    ),
    plugin(
        "sunsky",
        "The sun and the sky that it lights, +z up.",
        &[SUNSKY],
        &[],
    ),
    plugin(
        "collimated",
        "A beam along +z.",
        &[APERTURE, BEAM, PLACED],
        BEHIND_PICTURE,
    ),
    plugin(
        "fiber",
        "The end of a fibre: an aperture that radiates into a cone about +z.",
        &[APERTURE, FIBER, PLACED],
        BEHIND_PICTURE,
    ),
    plugin(
        "volumelight",
        "Light from all points of a volume, the same in all directions.",
        &[
            &[
                spectrum(
                    "radiance",
                    "1",
                    "per length, W/(m³ sr), ≥ 0: all over the unit cube",
                ),
                spectrum(
                    "power",
                    "",
                    "total, W, ≥ 0: in place of what the radiance says",
                ),
            ],
            PLACED,
        ],
        &[
            one(Medium, "Accepted: containment decides."),
            role(
                Volume,
                "radiance",
                "A gridvolume or constvolume in its place, where that lies.",
            ),
        ],
    ),
    plugin(
        "area",
        "Light from the shape that it belongs to, the same in all directions.",
        &[&[spectrum("radiance", "1", "≥ 0")]],
        &[texture("radiance")],
    ),
];
