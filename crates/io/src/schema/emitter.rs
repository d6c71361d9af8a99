//! Emitters.

use super::parameter::{TO_WORLD, boolean, float, integer, point, spectrum, text, vector, word};
use super::row::{one, own_plugin, plugin, role, texture};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Medium, Texture, Volume};

const PLACED: &[Parameter] = &[TO_WORLD];

const INSIDE: &[Slot] = &[one(Medium, "Accepted: containment decides.")];

const SPOT: &[Parameter] = &[
    spectrum("intensity", "on the axis, W/sr, ≥ 0").or(1.0),
    float("cutoff_angle", "degrees")
        .positive()
        .at_most(180.0)
        .or(20.0),
    float(
        "beam_width",
        "degrees of full intensity, at most cutoff_angle",
    )
    .at_least(0.0)
    .or_computed("¾ of the cut-off"),
];

const APERTURE: &[Parameter] = &[
    word(
        "profile",
        &["disc", "gaussian", "rectangle"],
        "irradiance across the beam",
    ),
    float("radius", "of a disc or Gaussian, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
    float("width", "of a rectangle along local x, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
    float("height", "of a rectangle along local y, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
];

const BEAM: &[Parameter] = &[
    spectrum("power", "W, ≥ 0; this or the irradiance is required"),
    spectrum("irradiance", "on the axis, W/m², ≥ 0"),
];

const FIBER: &[Parameter] = &[
    spectrum("power", "W, ≥ 0").required(),
    float(
        "numerical_aperture",
        "n sin θ₀, at most the index at the end; this or the cutoff_angle is required",
    )
    .positive(),
    float("cutoff_angle", "θ₀ in degrees")
        .positive()
        .at_most(90.0),
    word(
        "angular_profile",
        &["uniform", "lambertian", "gaussian"],
        "the same intensity within θ₀, the same radiance, or radiance as exp(−2 sin²θ/sin²θ₀)",
    ),
    float(
        "focus",
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
        ".exr, .hdr or .pfm; .png, .jpg, .bmp or .tga in sRGB",
    )
    .required(),
    float("scale", "factor").at_least(0.0).or(1.0),
    boolean("mis_compensation", false, "accepted and ignored"),
    TO_WORLD,
];

const SUNSKY: &[Parameter] = &[
    float("turbidity", "haze; 1 for none")
        .within(1.0, 10.0)
        .or(3.0),
    spectrum("albedo", "of the ground, 0 to 1").or(0.3),
    vector("sun_direction", "towards the sun, in the world").or_computed("by place and time"),
    float("latitude", "degrees, northern > 0")
        .within(-90.0, 90.0)
        .or(35.6894),
    float("longitude", "degrees, eastern > 0")
        .within(-180.0, 360.0)
        .or(139.6917),
    float("timezone", "hours ahead of universal time")
        .within(-24.0, 24.0)
        .or(9.0),
    integer("year", "of the date")
        .within(-4000.0, 9999.0)
        .or(2010.0),
    integer("month", "of the date").within(1.0, 12.0).or(7.0),
    integer("day", "of the date").within(1.0, 31.0).or(10.0),
    float("hour", "of local time").or(15.0),
    float("minute", "of local time").or(0.0),
    float("second", "of local time").or(0.0),
    float("sun_scale", "factor of the sun")
        .at_least(0.0)
        .or(1.0),
    float("sky_scale", "factor of the sky")
        .at_least(0.0)
        .or(1.0),
    float(
        "sun_aperture",
        "diameter of the sun in degrees; its power stays",
    )
    .positive()
    .below(90.0)
    .or(0.5358),
    boolean("complex_sun", false, "accepted and ignored"),
    TO_WORLD,
];

const PROJECTOR: &[Parameter] = &[
    spectrum("irradiance", "at unit distance, ≥ 0").or(1.0),
    float("scale", "factor").at_least(0.0).or(1.0),
    TO_WORLD,
];

const IES: &[Parameter] = &[
    text("filename", "an LM-63 file of type C").required(),
    spectrum("scale", "factor of the file's intensities, ≥ 0").or(1.0),
    TO_WORLD,
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "point",
        "The same intensity in all directions.",
        &[
            &[
                point("position", "in place of to_world").or_computed("by to_world"),
                spectrum("intensity", "W/sr, ≥ 0").or(1.0),
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
    own_plugin("ies", "A luminaire that was measured.", &[IES], &[]),
    plugin(
        "directional",
        "Parallel light from outside.",
        &[
            &[
                spectrum("irradiance", "across the direction, W/m², ≥ 0").or(1.0),
                vector("direction", "in place of to_world").or_computed("by to_world"),
            ],
            PLACED,
        ],
        INSIDE,
    ),
    plugin(
        "constant",
        "The same radiance from everywhere.",
        &[&[spectrum("radiance", "≥ 0").or(1.0)], PLACED],
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
    own_plugin(
        "collimated",
        "A beam along +z.",
        &[APERTURE, BEAM, PLACED],
        BEHIND_PICTURE,
    ),
    own_plugin(
        "fiber",
        "The end of a fibre: an aperture that radiates into a cone about +z.",
        &[APERTURE, FIBER, PLACED],
        BEHIND_PICTURE,
    ),
    own_plugin(
        "volumelight",
        "Light from all points of a volume, the same in all directions.",
        &[
            &[
                spectrum(
                    "radiance",
                    "per length, W/(m³ sr), ≥ 0: all over the unit cube",
                )
                .or(1.0),
                spectrum("power", "total, W, ≥ 0: in place of what the radiance says"),
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
        &[&[spectrum("radiance", "≥ 0").or(1.0)]],
        &[texture("radiance")],
    ),
];
