//! Cameras and meters.

use super::integrator::TAGGED;
use super::parameter::{
    TO_WORLD, boolean, float, integer, list, point, spectrum, text, vector, word,
};
use super::row::{many, one, own_plugin, plugin, role};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Film, Medium, Rfilter, Sampler, Sensor, Shape, Texture};

const CAMERA: &[Parameter] = &[
    TO_WORLD,
    float("near_clip", "clipping plane; clips nothing").or(0.01),
    float(
        "far_clip",
        "far clipping plane; clips nothing, but is the default of focus_distance",
    )
    .or(1e4),
    float("shutter_open", "accepted and ignored: nothing moves").or(0.0),
    float("shutter_close", "accepted and ignored").or(0.0),
    spectrum("srf", "not supported: use a film of wavelengths"),
];

pub(super) const VIEW: &[Parameter] = &[
    float("fov", "field of view in degrees")
        .within(1e-3, 179.0)
        .or_computed("by focal_length"),
    word(
        "fov_axis",
        &["x", "y", "smaller", "larger", "diagonal"],
        "side of the image across which fov measures",
    ),
    text(
        "focal_length",
        "focal length of a lens for 35 mm film, instead of fov",
    )
    .or_text("50mm"),
];

const PINHOLE: &[Parameter] = &[
    float(
        "focus_distance",
        "accepted and ignored: everything is in focus",
    ),
    float(
        "principal_point_offset_x",
        "offset of the principal point to the right, as a fraction of the image's width",
    )
    .within(-100.0, 100.0)
    .or(0.0),
    float(
        "principal_point_offset_y",
        "offset of the principal point downwards, as a fraction of the image's height",
    )
    .within(-100.0, 100.0)
    .or(0.0),
];

const FOCUS_POINT: Parameter = point(
    "focus_point",
    "a point of the plane in focus, in the world, instead of focus_distance",
);

const APERTURE: &[Parameter] = &[
    integer(
        "blades",
        "number of straight blades of an iris, which form a polygon with corners on the rim; default: a disc",
    )
    .within(3.0, 100.0),
    float(
        "blade_angle",
        "angle of one corner, from local x towards y, degrees",
    )
    .or(0.0),
    float(
        "obscuration",
        "radius of a central obstruction, as a fraction of the aperture's radius",
    )
    .within(0.0, 0.95)
    .or(0.0),
    integer(
        "vanes",
        "number of vanes: straight bars from the centre to the rim that cover the aperture",
    )
    .within(1.0, 100.0),
    float(
        "vane_width",
        "width of a vane, as a fraction of the aperture's radius; required with vanes",
    )
    .positive()
    .at_most(1.0),
    float(
        "vane_angle",
        "angle of one vane, from local x towards y, degrees",
    )
    .or(0.0),
    boolean(
        "diffraction",
        false,
        "true if the aperture diffracts; needs a film of wavelengths",
    ),
    float(
        "metres_per_unit",
        "length of a scene unit in metres; required with diffraction",
    )
    .positive(),
];

const LENS: &[Parameter] = &[
    float("aperture_radius", "radius of the aperture, local units")
        .positive()
        .required(),
    float(
        "focus_distance",
        "distance of the plane in focus along the axis, local units",
    )
    .positive()
    .or_computed("far_clip"),
    FOCUS_POINT,
];

const RAY: &[Parameter] = &[
    point(
        "origin",
        "origin, instead of to_world, together with direction",
    ),
    vector("direction", "direction, instead of to_world, not zero"),
];

const DISTANT: &[Parameter] = &[
    vector(
        "direction",
        "of the rays that leave the sensor, in place of to_world; not zero",
    ),
    point("target", "in the world: where all rays go"),
];

const TELECENTRIC: &[Parameter] = &[
    float(
        "acceptance_angle",
        "half angle of the cone of directions, degrees",
    )
    .positive()
    .at_most(45.0)
    .required(),
    float(
        "focus_distance",
        "distance of the plane in focus along the axis, local units",
    )
    .at_least(0.0)
    .or(0.0),
    FOCUS_POINT,
    vector(
        "knife_edge",
        "direction towards the covered side, [x, y, 0] in local axes",
    ),
    float(
        "knife_angle",
        "angle at which the knife cuts, degrees, within the acceptance angle",
    )
    .or(0.0),
];

/// Largest number of bins along an axis of a meter.
const MAX_BINS: f64 = 1048576.0;

const READING: &[Parameter] = &[
    word(
        "normalization",
        &["absolute", "per_watt"],
        "normalisation: units of the emitters, or per unit of their power",
    ),
    float(
        "min_bound",
        "smallest optical path length of the bins, scene units",
    )
    .or(0.0),
    float(
        "max_bound",
        "largest optical path length of the bins, scene units",
    ),
    float("bin_width", "width of a bin").positive(),
    boolean(
        "weight_windows",
        false,
        "true to split and terminate particles so that late bins are as accurate as early ones; particles take longer",
    ),
    list(
        "modulation_frequencies",
        "frequencies in Hz at which the power of the emitters is modulated, at most 64; adds amplitude and phase",
    ),
];

const CELLS: &[Parameter] = &[
    word(
        "coordinates",
        &["cartesian", "cylindrical", "spherical"],
        "shape of the cells",
    ),
    TO_WORLD,
    integer("nx", "number of cells along x; required if cartesian").within(1.0, MAX_BINS),
    integer("ny", "number of cells along y; required if cartesian").within(1.0, MAX_BINS),
    integer("nz", "number of cells along z; required unless spherical").within(1.0, MAX_BINS),
    integer("nr", "number of rings or shells; required unless cartesian").within(1.0, MAX_BINS),
    word(
        "estimator",
        &["track_length", "collision"],
        "estimator: by the track lengths of particles, or by their collisions",
    ),
    float(
        "gruneisen",
        "Grüneisen parameter Γ; adds the initial pressure p0",
    )
    .at_least(0.0),
    float("pulse_energy", "pulse energy for p0, J")
        .positive()
        .or(1.0),
    float(
        "metres_per_unit",
        "length of a scene unit in metres, for p0, modulation_frequencies and units in files",
    )
    .positive()
    .or(1.0),
];

const SURFACE: &[Parameter] = &[
    integer("nu", "number of bins of position along u")
        .within(1.0, MAX_BINS)
        .or(1.0),
    integer("nv", "number of bins of position along v")
        .within(1.0, MAX_BINS)
        .or(1.0),
    boolean("parts", false, "true to separate the sides of the shape"),
    integer("cosine_bins", "number of bins of the cosine").within(1.0, MAX_BINS),
    vector("cosine_axis", "axis of the cosine, not zero").or_computed("the normal"),
    vector("center", "centre of the disc that accepts light"),
    float("radius", "radius of the disc that accepts light").positive(),
    float("numerical_aperture", "largest n sin θ of accepted light").positive(),
    boolean(
        "records",
        false,
        "true to keep a record of each accepted particle",
    ),
    integer("max_records", "maximum number of records")
        .at_least(1.0)
        .or(1e6),
    boolean(
        "tagged",
        false,
        "true to record phase shifts from the sound, and to separate power by them",
    ),
    boolean(
        "stokes",
        false,
        "true to measure the Stokes parameters of power and records",
    ),
    float(
        "metres_per_unit",
        "length of a scene unit in metres; required with modulation_frequencies",
    )
    .positive(),
];

const TAGS: &[Parameter] = &[boolean(
    "tagged",
    false,
    "true to separate fluence by the phase shift from the sound",
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
        "A square bitmap of the transmittance of the aperture.",
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
        "A pinhole camera.",
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
        "Parallel rays over the local square [-1, 1]².",
        &[CAMERA],
        PICTURE,
    ),
    own_plugin(
        "telecentric",
        "An equal narrow cone of directions at every point, optionally with a knife edge.",
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
        "Light along one ray: a pinhole camera with a view of 0.001°.",
        &[RAY, CAMERA],
        PICTURE,
    ),
    plugin(
        "distant",
        "Mean radiance that leaves the scene, or a part of it, in one direction. The film has one pixel.",
        &[DISTANT, CAMERA],
        &[
            role(
                Shape,
                "target",
                "A rectangle or disk: the mean over its area. It is no part of the scene.",
            ),
            one(Film, "One pixel."),
            one(Rfilter, "Ignored: filters belong into the film."),
            one(Sampler, "The number of samples."),
            one(Medium, "The medium that the sensor is in."),
        ],
    ),
    own_plugin(
        "fluencemeter",
        "Fluence rate and absorbed power in cells.",
        &[CELLS, READING, TAGS, TAGGED],
        METER,
    ),
    plugin(
        "irradiancemeter",
        "Power through its shape.",
        &[SURFACE, READING, TAGGED],
        METER,
    ),
];
