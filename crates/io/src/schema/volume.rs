//! Volumes: refractive indices and other quantities that vary in space.

use super::parameter::{
    TO_WORLD, boolean, float, integer, list, number_or_word, point, spectrum, tensor, text, vector,
    word,
};
use super::row::{many, one, own_plugin, plugin};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::Volume;

const PLACED: &[Parameter] = &[TO_WORLD];

const FILE: &[Parameter] = &[
    text("filename", "file with the samples; give filename or data"),
    tensor("data", "samples: an array of 3 axes, or 4 with channels"),
    text(
        "dataset",
        "name of the array in the file; required for HDF5",
    ),
    text(
        "axis_order",
        "order of the array's axes, such as zyx; required if the format does not state it; zyx for data",
    ),
    word(
        "placement",
        &["centers", "nodes"],
        "placement of the samples; required for an index, unless the file states it",
    )
    .or_nothing(),
    TO_WORLD,
    boolean(
        "use_grid_bbox",
        false,
        "true to use the bounding box of a .vol file instead of the unit cube",
    ),
];

const NUMBERS: &[Parameter] = &[
    float("scale", "factor of the samples").or(1.0),
    float("offset", "offset added to the samples").or(0.0),
];

const SMOOTHING: &[Parameter] = &[
    number_or_word(
        "smoothing",
        &["none", "auto"],
        "standard deviation of the samples' noise, by which the spline may miss them; auto for \
         their rounding error",
    )
    .at_least(0.0),
    boolean(
        "condense",
        true,
        "true to store a grid that is finer than its field with fewer samples, which changes it by at most its rounding",
    ),
];

const GRID: &[Parameter] = &[
    word("filter_type", &["trilinear", "nearest"], "between samples"),
    word(
        "wrap_mode",
        &["clamp", "repeat", "mirror"],
        "accepted: the outermost samples are continued",
    ),
    boolean("raw", true, "accepted and ignored"),
    boolean("accel", true, "accepted and ignored"),
];

const LAW: &[Parameter] = &[
    float("reference", "density or pressure with the index n0").or(0.0),
    float("scale", "factor of the change of the index").or(1.0),
];

const N0: Parameter = float("n0", "index").as_index().required();
const ORIGIN: Parameter =
    point("origin", "a point on the axis, or where n = n0").or_triple([0.0, 0.0, 0.0]);
const CENTER: Parameter = point("center", "centre").or_triple([0.0, 0.0, 0.0]);
const DIRECTION: Parameter =
    vector("direction", "direction of the axis").or_triple([0.0, 0.0, 1.0]);
const SLOPE: Parameter = vector("slope", "gradient per scene unit").required();
const DN_DP: Parameter = float(
    "dn_dp",
    "change of the index per pascal; required with pressure",
)
.within(-1e-6, 1e-6);

const ELASTO_OPTIC: &[Parameter] = &[float(
    "elasto_optic",
    "ρc² ∂n/∂p of the medium; required for tagged light. Samples are sound if a \
     frequency is given",
)
.positive()];

const MODE: &[Parameter] = &[
    float(
        "amplitude",
        "amplitude of the index; give amplitude, or pressure and dn_dp",
    ),
    float("pressure", "amplitude, Pa"),
    DN_DP,
    integer("order", "azimuthal order m")
        .within(0.0, 64.0)
        .or(0.0),
    float("phase", "phase of the azimuth, radians").or(0.0),
    float("time_phase", "phase of the oscillation, radians").or(0.0),
    float(
        "wave_number",
        "wave number in radians per scene unit; give it, or frequency and sound_speed",
    )
    .positive(),
    float("frequency", "frequency, Hz").positive(),
    float("sound_speed", "scene units per second").positive(),
];

const IN_TIME: &[Parameter] = &[
    float(
        "frequency",
        "frequency in Hz, if samples are complex amplitudes or a time series",
    )
    .positive(),
    float(
        "sound_speed",
        "speed of sound in scene units per second; required with frequency",
    )
    .positive(),
    float("time_phase", "phase in radians, with frequency").or(0.0),
    float(
        "time_step",
        "time between channels in s, if the channels are instants",
    )
    .positive()
    .or_computed("the file's"),
    float("periods", "number of last samples to fit")
        .positive()
        .or_computed("those of the second half"),
    integer("frame", "number of the channel").at_least(0.0),
];

const SOURCE: &[Parameter] = &[
    word(
        "aperture",
        &["bowl", "piston", "linear_array", "ring_array"],
        "shape of the moving surface",
    )
    .required(),
    float(
        "radius",
        "radius of curvature of a bowl, or radius of the ring, scene units",
    )
    .positive(),
    float(
        "diameter",
        "radius of the rim of a bowl, or of a piston, scene units",
    )
    .positive(),
    float(
        "pressure",
        "source pressure: density × speed of sound × velocity of the surface, Pa",
    )
    .required(),
    float("frequency", "frequency, Hz").positive().required(),
    float("sound_speed", "scene units per second")
        .positive()
        .required(),
    float("time_phase", "phase of the oscillation, radians").or(0.0),
    ORIGIN,
    DIRECTION,
    vector(
        "reference",
        "direction along a linear array, or to the first element of a ring",
    )
    .or_computed("x, or y if the direction is nearly x"),
];

const ELEMENTS: &[Parameter] = &[
    integer("elements", "number of elements of an array").within(1.0, 1048576.0),
    float(
        "pitch",
        "distance between neighbouring elements of a linear array, scene units",
    )
    .positive(),
    float("width", "size of an element along the array, scene units")
        .positive()
        .or_computed("all that there is"),
    float("height", "size of an element across the array, scene units").positive(),
    point("focus", "point at which all elements are in phase"),
    list("delays", "delays of the elements, s; instead of a focus").or(0.0),
    list("apodization", "factors of the amplitudes of the elements").or(1.0),
];

const REGION: &[Parameter] = &[
    N0,
    DN_DP.required(),
    point(
        "min",
        "smallest corner of the box in which the sound is computed",
    )
    .required(),
    point("max", "largest corner of this box").required(),
    float("spacing", "largest spacing of samples, scene units")
        .positive()
        .or_computed("a tenth of a wavelength"),
];

const COORDINATES: &[&str] = &["r", "rho", "x", "y", "z"];

const OF_FORMULA: &Parameter = &float("(any name)", "number that the formula uses by this name");

/// Wavelength in vacuum, within the range for which the formula for the index of air was fitted.
const OF_AIR: Parameter = float("wavelength", "wavelength in air, nm")
    .within(230.0, 1690.0)
    .or_computed("the channel's");
/// Gladstone–Dale constant of a gas other than air.
const OF_GAS: Parameter =
    float("constant", "K in m³/kg, instead of the wavelength").within(0.0, 0.1);

const DISPERSION: &[Parameter] = &[float(
    "reference_wavelength",
    "wavelength in nm at which a nested volume gives the index; required with this volume",
)
.positive()];

pub(super) const PLUGINS: &[Plugin] = &[
    own_plugin(
        "constant",
        "An index that is equal everywhere.",
        &[&[float("value", "index").as_index().required()], PLACED],
        &[],
    ),
    own_plugin(
        "linear",
        "n = n0 + slope·(x − origin).",
        &[&[N0, SLOPE, ORIGIN], PLACED],
        &[],
    ),
    own_plugin(
        "linear_square",
        "n² = n0² + slope·(x − origin).",
        &[&[N0, SLOPE, ORIGIN], PLACED],
        &[],
    ),
    own_plugin(
        "luneburg",
        "n² = n_exterior² (2 − r²/radius²).",
        &[
            &[
                float("n_exterior", "index at the rim").as_index().or(1.0),
                CENTER,
                float("radius", "scene units").positive().or(1.0),
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "selfoc",
        "n² = n0² (1 − alpha² r²), r from the axis.",
        &[
            &[
                N0,
                float("alpha", "per scene unit").positive().required(),
                ORIGIN,
                DIRECTION,
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "fisheye",
        "n = n0/(1 + r²/radius²).",
        &[
            &[
                float("n0", "index at the centre").as_index().or(2.0),
                CENTER,
                float("radius", "scene units").positive().or(1.0),
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "gaussian",
        "n = n0 + delta exp(−r²/2 width²).",
        &[
            &[
                N0,
                float("delta", "height of the bell").required(),
                CENTER,
                float("width", "scene units").positive().required(),
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "acoustic",
        "Standing sound around an axis: one mode, or several nested modes.",
        &[
            &[
                N0,
                ORIGIN,
                DIRECTION,
                vector("reference", "direction in which the azimuth is 0").or_computed("any"),
            ],
            MODE,
            ELASTO_OPTIC,
            PLACED,
        ],
        &[many(Volume, "Modes.")],
    ),
    own_plugin("mode", "A mode of an acoustic field.", &[MODE], &[]),
    own_plugin(
        "expression",
        "An index by a formula in x, y, z, r and rho.",
        &[
            &[
                text("n", "formula of the index; this, or n2"),
                text("n2", "formula of the square of the index"),
            ],
            PLACED,
        ],
        &[],
    )
    .with_others(OF_FORMULA),
    own_plugin(
        "profile",
        "An index from a table, which varies with one coordinate.",
        &[
            &[
                word(
                    "coordinate",
                    COORDINATES,
                    "coordinate of the table: distance from the origin (r) or from the z axis (rho), \
                     or x, y or z",
                )
                .required(),
                list("table", "pairs of coordinate and index; give table, data or filename"),
                tensor("data", "table as an array of two columns"),
                text("filename", "text file with two columns"),
                float(
                    "shift",
                    "offset added to the coordinates of the table, for example a planet's radius to convert heights",
                )
                .or(0.0),
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "standard_atmosphere",
        "The index of the US Standard Atmosphere of 1976, above the plane z = 0 or around a sphere.",
        &[
            &[
                float("radius", "radius of the sphere around the origin").positive(),
                float("metres_per_unit", "length of a scene unit in metres")
                    .positive()
                    .or(1.0),
                OF_AIR,
                OF_GAS,
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "bspline",
        "A tricubic B-spline through samples of the index.",
        &[FILE, NUMBERS, SMOOTHING],
        &[],
    ),
    own_plugin(
        "gladstone_dale",
        "The index of a gas from samples of its density, kg/m³.",
        &[
            FILE,
            &[
                float("n0", "index at the reference").as_index().or(1.0),
                OF_AIR,
                OF_GAS,
            ],
            LAW,
            SMOOTHING,
        ],
        &[],
    ),
    own_plugin(
        "pressure",
        "The index of a liquid from samples of the pressure, Pa.",
        &[
            FILE,
            &[N0, DN_DP.required()],
            LAW,
            SMOOTHING,
            IN_TIME,
            ELASTO_OPTIC,
        ],
        &[],
    ),
    own_plugin(
        "transducer",
        "The index of a liquid in the sound of a transducer.",
        &[SOURCE, ELEMENTS, REGION, PLACED, ELASTO_OPTIC],
        &[],
    ),
    own_plugin(
        "sum",
        "A reference index with perturbations that are added in n².",
        &[&[float("reference", "index").as_index().or(1.0)], PLACED],
        &[many(Volume, "The terms.")],
    ),
    own_plugin(
        "cauchy",
        "n = a + b/λ² + c/λ⁴, λ in µm.",
        &[
            &[
                float("a", "coefficient a").positive().required(),
                float("b", "coefficient b, µm²").or(0.0),
                float("c", "µm⁴").or(0.0),
            ],
            DISPERSION,
        ],
        &[one(Volume, "The index at the reference wavelength.")],
    ),
    own_plugin(
        "sellmeier",
        "n² = 1 + Σ bᵢλ²/(λ² − cᵢ), λ in µm.",
        &[
            &[
                float("b1", "coefficient b₁").required(),
                float("c1", "coefficient c₁, µm²").at_least(0.0).required(),
                float("b2", "coefficient b₂").or(0.0),
                float("c2", "coefficient c₂, µm²").at_least(0.0).or(0.0),
                float("b3", "coefficient b₃").or(0.0),
                float("c3", "coefficient c₃, µm²").at_least(0.0).or(0.0),
            ],
            DISPERSION,
        ],
        &[one(Volume, "The index at the reference wavelength.")],
    ),
    plugin(
        "gridvolume",
        "Samples of an extinction or albedo.",
        &[FILE, NUMBERS, GRID],
        &[],
    ),
    plugin(
        "constvolume",
        "An extinction or albedo that is equal everywhere.",
        &[&[
            spectrum("value", "value of the quantity").required(),
            TO_WORLD,
        ]],
        &[],
    ),
];
