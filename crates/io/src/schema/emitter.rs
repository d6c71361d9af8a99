//! Emitters.

use super::parameter::{
    TO_WORLD, boolean, float, integer, list, point, spectrum, tensor, text, vector, word,
};
use super::row::{one, own_plugin, plugin, role, texture};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Medium, Texture, Volume};

const PLACED: &[Parameter] = &[TO_WORLD];

const INSIDE: &[Slot] = &[one(Medium, "Accepted: containment decides.")];

const SPOT: &[Parameter] = &[
    spectrum("intensity", "intensity on the axis, W/sr, ≥ 0").or(1.0),
    float("cutoff_angle", "degrees")
        .positive()
        .at_most(180.0)
        .or(20.0),
    float(
        "beam_width",
        "angle of full intensity in degrees, at most cutoff_angle",
    )
    .at_least(0.0)
    .or_computed("¾ of the cut-off"),
];

const APERTURE: &[Parameter] = &[
    word(
        "profile",
        &["disc", "gaussian", "rectangle"],
        "profile of the irradiance across the beam",
    ),
    float("radius", "radius of a disc or Gaussian, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
    float(
        "inner_radius",
        "radius of the dark middle of a disc, below radius, scene units",
    )
    .at_least(0.0)
    .or(0.0),
    float("width", "width of a rectangle along local x, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
    float("height", "height of a rectangle along local y, scene units")
        .positive()
        .or_computed("a thousandth of the scene"),
    float(
        "skew",
        "displacement along local x of the side of a rectangle at larger y, from the side at smaller y: a parallelogram, scene units",
    )
    .or(0.0),
];

const BEAM: &[Parameter] = &[
    spectrum("power", "power, W, ≥ 0; give power or irradiance"),
    spectrum("irradiance", "irradiance on the axis, W/m², ≥ 0"),
];

const FIBER: &[Parameter] = &[
    spectrum("power", "power, W, ≥ 0").required(),
    float(
        "numerical_aperture",
        "numerical aperture n sin θ₀, at most the index at the end; give numerical_aperture or cutoff_angle",
    )
    .positive(),
    float(
        "cutoff_angle",
        "angle θ₀ in degrees, at most 180 for uniform and fan, otherwise at most 90",
    )
    .positive()
    .at_most(180.0),
    word(
        "angular_profile",
        &[
            "uniform",
            "lambertian",
            "gaussian",
            "fan",
            "slopes",
            "angles",
        ],
        "angular profile: equal intensity within θ₀, equal radiance within θ₀, radiance ∝ exp(−2 sin²θ/sin²θ₀), a fan perpendicular to local x, normal slopes, or a distribution of angles",
    ),
    list(
        "slopes",
        "standard deviations of the slopes along local x and y, for slopes",
    ),
    list(
        "angles",
        "increasing angles in degrees, 0 to 180, for angles",
    ),
    list(
        "angle_weights",
        "relative power between neighbouring angles, one fewer than angles",
    )
    .or_computed("equal"),
    vector("axis", "direction of the light in the local frame").or_computed("+z"),
    float(
        "focus",
        "distance of the point to which the axes of all cones converge; < 0 for a point from which they diverge",
    ),
];

const BEHIND_PICTURE: &[Slot] = &[
    one(Medium, "Accepted: containment decides."),
    role(
        Texture,
        "texture",
        "A bitmap as a factor of the irradiance of a rectangle.",
    ),
];

const ENVMAP: &[Parameter] = &[
    text(
        "filename",
        "image file: .exr, .hdr or .pfm; .png, .jpg, .bmp or .tga in sRGB; give filename or data",
    ),
    tensor(
        "data",
        "linear pixels: (rows, columns), or three axes with one or three channels",
    ),
    float("scale", "factor").at_least(0.0).or(1.0),
    boolean("mis_compensation", false, "accepted and ignored"),
    TO_WORLD,
];

const SUNSKY: &[Parameter] = &[
    float("turbidity", "turbidity: haze, 1 for none")
        .within(1.0, 10.0)
        .or(3.0),
    spectrum("albedo", "albedo of the ground, 0 to 1").or(0.3),
    vector("sun_direction", "direction towards the sun, in the world")
        .or_computed("from place and time"),
    float("latitude", "latitude in degrees, northern > 0")
        .within(-90.0, 90.0)
        .or(35.6894),
    float("longitude", "longitude in degrees, eastern > 0")
        .within(-180.0, 360.0)
        .or(139.6917),
    float("timezone", "time zone: hours ahead of universal time")
        .within(-24.0, 24.0)
        .or(9.0),
    integer("year", "year of the date")
        .within(-4000.0, 9999.0)
        .or(2010.0),
    integer("month", "month of the date")
        .within(1.0, 12.0)
        .or(7.0),
    integer("day", "day of the date").within(1.0, 31.0).or(10.0),
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
        "diameter of the sun in degrees; does not change its power",
    )
    .positive()
    .below(90.0)
    .or(0.5358),
    boolean("complex_sun", false, "accepted and ignored"),
    TO_WORLD,
];

const PROJECTOR: &[Parameter] = &[
    spectrum("irradiance", "irradiance at unit distance, ≥ 0").or(1.0),
    float("scale", "factor").at_least(0.0).or(1.0),
    TO_WORLD,
];

const IES: &[Parameter] = &[
    text("filename", "file in the format LM-63, type C").required(),
    spectrum("scale", "factor of the intensities in the file, ≥ 0").or(1.0),
    TO_WORLD,
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "point",
        "A point that emits equal intensity in all directions.",
        &[
            &[
                point("position", "position, instead of to_world").or_computed("from to_world"),
                spectrum("intensity", "intensity, W/sr, ≥ 0").or(1.0),
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
                "A bitmap as a factor of the intensity, projected along +z; cutoff_angle must be below 90.",
            ),
        ],
    ),
    plugin(
        "projector",
        "A point that projects an image along +z.",
        &[super::sensor::VIEW, PROJECTOR],
        &[role(Texture, "irradiance", "Bitmap instead of the colour.")],
    ),
    own_plugin("ies", "A measured luminaire.", &[IES], &[]),
    plugin(
        "directional",
        "Parallel light from outside.",
        &[
            &[
                spectrum(
                    "irradiance",
                    "irradiance of a surface across the direction, W/m², ≥ 0",
                )
                .or(1.0),
                vector("direction", "direction of the light, instead of to_world")
                    .or_computed("from to_world"),
            ],
            PLACED,
        ],
        INSIDE,
    ),
    plugin(
        "constant",
        "Equal radiance from all directions.",
        &[
            &[spectrum("radiance", "radiance, W/(m² sr), ≥ 0").or(1.0)],
            PLACED,
        ],
        INSIDE,
    ),
    plugin(
        "envmap",
        "An equirectangular image around the scene.",
        &[ENVMAP],
        &[],
    ),
    plugin("sunsky", "The sun and the sky, with +z up.", &[SUNSKY], &[]),
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
        "Light of equal radiance in all directions, from all points of a volume.",
        &[
            &[
                spectrum(
                    "radiance",
                    "radiance per length, W/(m³ sr), ≥ 0, in the unit cube",
                )
                .or(1.0),
                spectrum(
                    "power",
                    "total power, W, ≥ 0, instead of the power of the radiance",
                ),
            ],
            PLACED,
        ],
        &[
            one(Medium, "Accepted: containment decides."),
            role(
                Volume,
                "radiance",
                "A gridvolume or constvolume at its own place, instead of the unit cube.",
            ),
        ],
    ),
    plugin(
        "area",
        "Light of equal radiance in all directions, from the surface of its shape.",
        &[&[spectrum("radiance", "radiance, W/(m² sr), ≥ 0").or(1.0)]],
        &[texture("radiance")],
    ),
    plugin(
        "directionalarea",
        "Parallel light along the normals of the rectangle or disk that it belongs to.",
        &[&[spectrum("radiance", "the irradiance of the light, W/m², ≥ 0").or(1.0)]],
        &[],
    ),
];
