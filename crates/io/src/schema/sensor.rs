//! Cameras and meters.

use super::integrator::TAGGED;
use super::parameter::{TO_WORLD, boolean, float, integer, point, spectrum, text, vector, word};
use super::row::{many, one, own_plugin, plugin, role};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Film, Medium, Rfilter, Sampler, Sensor, Texture};

const CAMERA: &[Parameter] = &[
    TO_WORLD,
    float("near_clip", "cuts nothing").or(0.01),
    float("far_clip", "cuts nothing; the focus distance without any").or(1e4),
    float("shutter_open", "accepted and ignored: nothing moves").or(0.0),
    float("shutter_close", "accepted and ignored").or(0.0),
    spectrum("srf", "not modelled: use a film of wavelengths"),
];

pub(super) const VIEW: &[Parameter] = &[
    float("fov", "field of view in degrees")
        .within(1e-3, 179.0)
        .or_computed("by focal_length"),
    word(
        "fov_axis",
        &["x", "y", "smaller", "larger", "diagonal"],
        "the side of the image that fov is across",
    ),
    text(
        "focal_length",
        "in place of fov: that of a lens for 35 mm film",
    )
    .or_text("50mm"),
];

const PINHOLE: &[Parameter] = &[
    float("focus_distance", "accepted and ignored: all is in focus"),
    float(
        "principal_point_offset_x",
        "how far to the right the picture is taken from, in its width",
    )
    .within(-100.0, 100.0)
    .or(0.0),
    float("principal_point_offset_y", "how far down, in its height")
        .within(-100.0, 100.0)
        .or(0.0),
];

const FOCUS_POINT: Parameter = point(
    "focus_point",
    "in place of focus_distance: a point of the plane in focus, in the world",
);

const APERTURE: &[Parameter] = &[
    integer(
        "blades",
        "number of straight blades of an iris: a polygon with corners on the rim; else a disc",
    )
    .within(3.0, 100.0),
    float(
        "blade_angle",
        "where one corner is, from local x towards y, degrees",
    )
    .or(0.0),
    float(
        "obscuration",
        "share of the aperture's radius that is covered in its middle",
    )
    .within(0.0, 0.95)
    .or(0.0),
    integer(
        "vanes",
        "straight bars from the middle to the rim that cover the aperture",
    )
    .within(1.0, 100.0),
    float(
        "vane_width",
        "as a share of the aperture's radius; required with vanes",
    )
    .positive()
    .at_most(1.0),
    float(
        "vane_angle",
        "where one vane is, from local x towards y, degrees",
    )
    .or(0.0),
    boolean(
        "diffraction",
        false,
        "whether the aperture diffracts; needs a film of wavelengths",
    ),
    float(
        "metres_per_unit",
        "length of a scene unit; required with diffraction",
    )
    .positive(),
];

const LENS: &[Parameter] = &[
    float("aperture_radius", "local units")
        .positive()
        .required(),
    float(
        "focus_distance",
        "of the plane in focus, along the axis, local units",
    )
    .positive()
    .or_computed("far_clip"),
    FOCUS_POINT,
];

const RAY: &[Parameter] = &[
    point("origin", "in place of to_world, with direction"),
    vector("direction", "in place of to_world, not zero"),
];

const TELECENTRIC: &[Parameter] = &[
    float(
        "acceptance_angle",
        "half the angle of the cone of directions, degrees",
    )
    .positive()
    .at_most(45.0)
    .required(),
    float(
        "focus_distance",
        "of the plane in focus, along the axis, local units",
    )
    .at_least(0.0)
    .or(0.0),
    FOCUS_POINT,
    vector(
        "knife_edge",
        "towards the covered side, [x, y, 0] in local axes",
    ),
    float(
        "knife_angle",
        "where the knife cuts, degrees, within the acceptance angle",
    )
    .or(0.0),
];

/// Largest number of bins along an axis of a meter.
const MOST_BINS: f64 = 1048576.0;

const READING: &[Parameter] = &[
    word(
        "normalization",
        &["absolute", "per_watt"],
        "units of the emitters, or per unit of their power",
    ),
    float(
        "min_bound",
        "least optical path length of the bins, scene units",
    )
    .or(0.0),
    float("max_bound", "greatest optical path length"),
    float("bin_width", "width of a bin").positive(),
    boolean(
        "weight_windows",
        false,
        "divides and terminates particles so that late bins are as accurate as early ones; particles take longer",
    ),
];

const CELLS: &[Parameter] = &[
    word(
        "coordinates",
        &["cartesian", "cylindrical", "spherical"],
        "shape of the cells",
    ),
    TO_WORLD,
    integer("nx", "cells along x; required if cartesian").within(1.0, MOST_BINS),
    integer("ny", "cells along y; required if cartesian").within(1.0, MOST_BINS),
    integer("nz", "cells along z; required unless spherical").within(1.0, MOST_BINS),
    integer("nr", "rings or shells; required unless cartesian").within(1.0, MOST_BINS),
    word(
        "estimator",
        &["track_length", "collision"],
        "by the track lengths of particles, or by their collisions",
    ),
    float("gruneisen", "Γ; adds the initial pressure p0").at_least(0.0),
    float("pulse_energy", "for p0, J").positive().or(1.0),
    float("metres_per_unit", "for p0, length of a scene unit")
        .positive()
        .or(1.0),
];

const SURFACE: &[Parameter] = &[
    integer("nu", "bins of position along u")
        .within(1.0, MOST_BINS)
        .or(1.0),
    integer("nv", "bins of position along v")
        .within(1.0, MOST_BINS)
        .or(1.0),
    boolean(
        "parts",
        false,
        "whether the sides of the shape are separate",
    ),
    integer("cosine_bins", "bins of the cosine").within(1.0, MOST_BINS),
    vector("cosine_axis", "axis of the cosine, not zero").or_computed("the normal"),
    vector("center", "accepts light within a radius of this point"),
    float("radius", "the radius").positive(),
    float(
        "numerical_aperture",
        "accepts light with n sin θ up to this",
    )
    .positive(),
    boolean(
        "records",
        false,
        "whether to keep a record of each particle that is accepted",
    ),
    integer("max_records", "the most records that are kept")
        .at_least(1.0)
        .or(1e6),
    boolean(
        "tagged",
        false,
        "whether records say what sound does to phases, and power is told apart by that",
    ),
    boolean(
        "stokes",
        false,
        "measures the Stokes parameters of power, and of records",
    ),
];

const TAGS: &[Parameter] = &[boolean(
    "tagged",
    false,
    "whether fluence is told apart by what sound does to its phase",
)];

const PICTURE: &[Slot] = &[
    one(Film, "The image."),
    one(Rfilter, "Ignored: filters belong into the film."),
    one(Sampler, "The number of samples."),
    one(Medium, "The medium that the sensor is in."),
];

const LENS_PICTURE: &[Slot] = &[
    role(
        Texture,
        "aperture",
        "A square bitmap of the share of light that each part of the aperture lets pass.",
    ),
    one(Film, "The image."),
    one(Rfilter, "Ignored: filters belong into the film."),
    one(Sampler, "The number of samples."),
    one(Medium, "The medium that the sensor is in."),
];

const METER: &[Slot] = &[
    one(Film, "The channels."),
    one(Sampler, "The number of particles."),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "perspective",
        "A pinhole.",
        &[VIEW, PINHOLE, CAMERA],
        PICTURE,
    ),
    plugin(
        "thinlens",
        "An ideal lens.",
        &[VIEW, LENS, APERTURE, CAMERA],
        LENS_PICTURE,
    ),
    plugin(
        "orthographic",
        "Parallel rays; sees local [-1, 1] across.",
        &[CAMERA],
        PICTURE,
    ),
    own_plugin(
        "telecentric",
        "The same narrow cone of directions at every point, with a knife edge if wanted.",
        &[TELECENTRIC, APERTURE, CAMERA],
        LENS_PICTURE,
    ),
    plugin(
        "batch",
        "Cameras side by side, each on a column of the film.",
        &[],
        &[
            many(
                Sensor,
                "The cameras; their own films and samplers do not count.",
            ),
            one(Film, "The image of all."),
            one(Rfilter, "Ignored: filters belong into the film."),
            one(Sampler, "The number of samples."),
            one(Medium, "The medium that the sensor is in."),
        ],
    ),
    plugin(
        "radiancemeter",
        "What comes along a ray: a pinhole that sees 0.001°.",
        &[RAY, CAMERA],
        PICTURE,
    ),
    own_plugin(
        "fluencemeter",
        "Fluence rate and absorbed power in cells.",
        &[CELLS, READING, TAGS, TAGGED],
        METER,
    ),
    plugin(
        "irradiancemeter",
        "Power through the shape that it belongs to.",
        &[SURFACE, READING, TAGGED],
        METER,
    ),
];
