//! Cameras and meters.

use super::integrator::TAGGED;
use super::row::{
    TO_WORLD, boolean, choice, float, integer, many, one, plugin, point, role, spectrum, text,
    vector, word,
};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Film, Medium, Rfilter, Sampler, Sensor, Texture};

const CAMERA: &[Parameter] = &[
    TO_WORLD,
    float("near_clip", "0.01", "cuts nothing"),
    float(
        "far_clip",
        "10000",
        "cuts nothing; the focus distance without any",
    ),
    float("shutter_open", "0", "accepted and ignored: nothing moves"),
    float("shutter_close", "0", "accepted and ignored"),
    spectrum("srf", "", "not modelled: use a film of wavelengths"),
];

pub(super) const VIEW: &[Parameter] = &[
    float(
        "fov",
        "(by focal_length)",
        "field of view in degrees, 0.001 to 179",
    ),
    word(
        "fov_axis",
        &["x", "y", "smaller", "larger", "diagonal"],
        "the side of the image that fov is across",
    ),
    text(
        "focal_length",
        "\"50mm\"",
        "in place of fov: that of a lens for 35 mm film",
    ),
];

const PINHOLE: &[Parameter] = &[
    float(
        "focus_distance",
        "",
        "accepted and ignored: all is in focus",
    ),
    float(
        "principal_point_offset_x",
        "0",
        "how far to the right the picture is taken from, in its width, -100 to 100",
    ),
    float(
        "principal_point_offset_y",
        "0",
        "how far down, in its height, -100 to 100",
    ),
];

const FOCUS_POINT: Parameter = point(
    "focus_point",
    "",
    "in place of focus_distance: a point of the plane in focus, in the world",
);

const APERTURE: &[Parameter] = &[
    integer(
        "blades",
        "",
        "number of straight blades of an iris, 3 to 100: a polygon with corners on the rim; else a disc",
    ),
    float(
        "blade_angle",
        "0",
        "where one corner is, from local x towards y, degrees",
    ),
    float(
        "obscuration",
        "0",
        "share of the aperture's radius that is covered in its middle, 0 to 0.95",
    ),
    integer(
        "vanes",
        "",
        "straight bars from the middle to the rim that cover the aperture, 1 to 100",
    ),
    float(
        "vane_width",
        "required with vanes",
        "as a share of the aperture's radius, > 0 and at most 1",
    ),
    float(
        "vane_angle",
        "0",
        "where one vane is, from local x towards y, degrees",
    ),
    boolean(
        "diffraction",
        "false",
        "whether the aperture diffracts; needs a film of wavelengths",
    ),
    float(
        "metres_per_unit",
        "required with diffraction",
        "length of a scene unit, > 0",
    ),
];

const LENS: &[Parameter] = &[
    float("aperture_radius", "required", "local units, > 0"),
    float(
        "focus_distance",
        "(far_clip)",
        "of the plane in focus, along the axis, local units, > 0",
    ),
    FOCUS_POINT,
];

const RAY: &[Parameter] = &[
    point("origin", "", "in place of to_world, with direction"),
    vector("direction", "", "in place of to_world, not zero"),
];

const TELECENTRIC: &[Parameter] = &[
    float(
        "acceptance_angle",
        "required",
        "half the angle of the cone of directions, degrees, > 0 and at most 45",
    ),
    float(
        "focus_distance",
        "0",
        "of the plane in focus, along the axis, local units, ≥ 0",
    ),
    FOCUS_POINT,
    vector(
        "knife_edge",
        "",
        "towards the covered side, [x, y, 0] in local axes",
    ),
    float(
        "knife_angle",
        "0",
        "where the knife cuts, degrees, within the acceptance angle",
    ),
];

const READING: &[Parameter] = &[
    word(
        "normalization",
        &["absolute", "per_watt"],
        "units of the emitters, or per unit of their power",
    ),
    float(
        "min_bound",
        "0",
        "least optical path length of the bins, scene units",
    ),
    float("max_bound", "", "greatest optical path length"),
    float("bin_width", "", "width of a bin, > 0"),
    boolean(
        "weight_windows",
        "false",
        "divides and terminates particles so that late bins are as accurate as early ones; particles take longer",
    ),
];

const CELLS: &[Parameter] = &[
    choice(
        "coordinates",
        &["cartesian", "cylindrical", "spherical"],
        "cartesian",
        "shape of the cells",
    ),
    TO_WORLD,
    integer("nx", "", "cells along x, ≥ 1; required if cartesian"),
    integer("ny", "", "cells along y, ≥ 1; required if cartesian"),
    integer("nz", "", "cells along z, ≥ 1; required unless spherical"),
    integer("nr", "", "rings or shells, ≥ 1; required unless cartesian"),
    word(
        "estimator",
        &["track_length", "collision"],
        "by the track lengths of particles, or by their collisions",
    ),
    float("gruneisen", "", "Γ ≥ 0; adds the initial pressure p0"),
    float("pulse_energy", "1", "for p0, J, > 0"),
    float(
        "metres_per_unit",
        "1",
        "for p0, length of a scene unit, > 0",
    ),
];

const SURFACE: &[Parameter] = &[
    integer("nu", "1", "bins of position along u, ≥ 1"),
    integer("nv", "1", "bins of position along v, ≥ 1"),
    boolean(
        "parts",
        "false",
        "whether the sides of the shape are separate",
    ),
    integer("cosine_bins", "", "bins of the cosine, ≥ 1"),
    vector(
        "cosine_axis",
        "(the normal)",
        "axis of the cosine, not zero",
    ),
    vector("center", "", "accepts light within a radius of this point"),
    float("radius", "", "the radius, > 0"),
    float(
        "numerical_aperture",
        "",
        "accepts light with n sin θ up to this, > 0",
    ),
    boolean(
        "records",
        "false",
        "whether to keep a record of each particle that is accepted",
    ),
    integer(
        "max_records",
        "1000000",
        "the most records that are kept, ≥ 1",
    ),
    boolean(
        "tagged",
        "false",
        "whether records say what sound does to phases, and power is told apart by that",
    ),
    boolean(
        "stokes",
        "false",
        "measures the Stokes parameters of power, and of records",
    ),
];

const TAGS: &[Parameter] = &[boolean(
    "tagged",
    "false",
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
    plugin(
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
    plugin(
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
