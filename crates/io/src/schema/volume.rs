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
    text("filename", "the file with the samples; this, or data"),
    tensor(
        "data",
        "the samples themselves: an array of 3 axes, or 4 with channels",
    ),
    text("dataset", "which of a file's arrays; required for HDF5"),
    text(
        "axis_order",
        "which axis of the array is which, such as zyx; required where the format does not say; zyx for data",
    ),
    word(
        "placement",
        &["centers", "nodes"],
        "where samples sit; required for an index, unless the file says it",
    )
    .or_nothing(),
    TO_WORLD,
    boolean(
        "use_grid_bbox",
        false,
        "whether the bounding box of a .vol file takes the place of the unit cube",
    ),
];

const NUMBERS: &[Parameter] = &[
    float("scale", "factor of the file's numbers").or(1.0),
    float("offset", "added to them").or(0.0),
];

const SMOOTHING: &[Parameter] = &[
    number_or_word(
        "smoothing",
        &["none", "auto"],
        "standard deviation of the samples' noise, by which the spline may pass \
         them; or auto: that of their rounding",
    )
    .at_least(0.0),
    boolean(
        "condense",
        true,
        "whether a grid that is finer than its field is held by fewer samples, which change it by its rounding at most",
    ),
];

const GRID: &[Parameter] = &[
    word("filter_type", &["trilinear", "nearest"], "between samples"),
    word(
        "wrap_mode",
        &["clamp", "repeat", "mirror"],
        "accepted: the outermost samples continue",
    ),
    boolean("raw", true, "accepted and ignored"),
    boolean("accel", true, "accepted and ignored"),
];

const LAW: &[Parameter] = &[
    float("reference", "density or pressure at which the index is n0").or(0.0),
    float("scale", "factor of the samples' effect").or(1.0),
];

const N0: Parameter = float("n0", "index").as_index().required();
const ORIGIN: Parameter =
    point("origin", "a point on the axis, or where n = n0").or_triple([0.0, 0.0, 0.0]);
const CENTER: Parameter = point("center", "the middle").or_triple([0.0, 0.0, 0.0]);
const DIRECTION: Parameter = vector("direction", "of the axis").or_triple([0.0, 0.0, 1.0]);
const SLOPE: Parameter = vector("slope", "gradient per scene unit").required();
const DN_DP: Parameter =
    float("dn_dp", "index per pascal; needed with a pressure").within(-1e-6, 1e-6);

const ELASTO_OPTIC: &[Parameter] = &[float(
    "elasto_optic",
    "ρc² ∂n/∂p of the medium; needed for tagged light. Samples are those of sound where a \
     frequency is given",
)
.positive()];

const MODE: &[Parameter] = &[
    float("amplitude", "of the index; this, or pressure and dn_dp"),
    float("pressure", "amplitude, Pa"),
    DN_DP,
    integer("order", "m").within(0.0, 64.0).or(0.0),
    float("phase", "of the azimuth, radians").or(0.0),
    float("time_phase", "radians").or(0.0),
    float(
        "wave_number",
        "radians per scene unit; this, or frequency and sound_speed",
    )
    .positive(),
    float("frequency", "Hz").positive(),
    float("sound_speed", "scene units per second").positive(),
];

const IN_TIME: &[Parameter] = &[
    float(
        "frequency",
        "Hz: samples are complex amplitudes, or a series in time",
    )
    .positive(),
    float(
        "sound_speed",
        "scene units per second; required with frequency",
    )
    .positive(),
    float("time_phase", "with frequency: radians").or(0.0),
    float("time_step", "s: the channels are instants")
        .positive()
        .or_computed("the file's"),
    float("periods", "the last so many are fitted")
        .positive()
        .or_computed("those of the second half"),
    integer("frame", "the channel that is taken").at_least(0.0),
];

const SOURCE: &[Parameter] = &[
    word(
        "aperture",
        &["bowl", "piston", "linear_array", "ring_array"],
        "the surface that moves",
    )
    .required(),
    float(
        "radius",
        "of curvature of a bowl, or of the ring, scene units",
    )
    .positive(),
    float("diameter", "of a bowl's rim or a piston, scene units").positive(),
    float(
        "pressure",
        "density times speed of sound times velocity of the surface, Pa",
    )
    .required(),
    float("frequency", "Hz").positive().required(),
    float("sound_speed", "scene units per second")
        .positive()
        .required(),
    float("time_phase", "radians").or(0.0),
    ORIGIN,
    DIRECTION,
    vector(
        "reference",
        "along a linear array, to the first element of a ring",
    )
    .or_computed("x, or y if the direction is nearly x"),
];

const ELEMENTS: &[Parameter] = &[
    integer("elements", "number of elements of an array").within(1.0, 1048576.0),
    float(
        "pitch",
        "from an element of a linear array to the next, scene units",
    )
    .positive(),
    float("width", "of an element, along the array, scene units")
        .positive()
        .or_computed("all that there is"),
    float("height", "of an element, across the array, scene units").positive(),
    point("focus", "where all elements are in phase"),
    list("delays", "of the elements, s; in place of a focus").or(0.0),
    list("apodization", "factors of the elements' amplitudes").or(1.0),
];

const REGION: &[Parameter] = &[
    N0,
    DN_DP.required(),
    point(
        "min",
        "least corner of the box in which the sound is computed",
    )
    .required(),
    point("max", "its greatest corner").required(),
    float("spacing", "of samples at most, scene units")
        .positive()
        .or_computed("a tenth of a wavelength"),
];

const COORDINATES: &[&str] = &["r", "rho", "x", "y", "z"];

const OF_FORMULA: &Parameter = &float("(any name)", "a number that the formula uses by this name");

/// Wavelength in vacuum, within the range for which the formula for the index of air was fitted.
const OF_AIR: Parameter = float("wavelength", "of air, nm")
    .within(230.0, 1690.0)
    .or_computed("the channel's");
/// Gladstone–Dale constant of a gas other than air.
const OF_GAS: Parameter =
    float("constant", "K in m³/kg, instead of the wavelength").within(0.0, 0.1);

const DISPERSION: &[Parameter] = &[float(
    "reference_wavelength",
    "nm: where a nested volume gives the index; required with it",
)
.positive()];

pub(super) const PLUGINS: &[Plugin] = &[
    own_plugin(
        "constant",
        "The same index everywhere.",
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
                float("n0", "index in the middle").as_index().or(2.0),
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
                float("delta", "height").required(),
                CENTER,
                float("width", "scene units").positive().required(),
            ],
            PLACED,
        ],
        &[],
    ),
    own_plugin(
        "acoustic",
        "Standing sound around an axis: one mode, or nested ones.",
        &[
            &[
                N0,
                ORIGIN,
                DIRECTION,
                vector("reference", "where the azimuth is 0").or_computed("any"),
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
                text("n2", "formula of its square"),
            ],
            PLACED,
        ],
        &[],
    )
    .with_others(OF_FORMULA),
    own_plugin(
        "profile",
        "An index that varies with one coordinate, by a table.",
        &[
            &[
                word(
                    "coordinate",
                    COORDINATES,
                    "what it varies with: the distance from the origin or from the z axis, or a \
                     coordinate",
                )
                .required(),
                list("table", "pairs: coordinate, index; this, data or filename"),
                tensor("data", "the same as an array of two columns"),
                text("filename", "a text file with two columns"),
                float(
                    "shift",
                    "added to the table's coordinates, such as a radius to heights",
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
                float("radius", "of the sphere around the origin").positive(),
                float("metres_per_unit", "metres in a scene unit")
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
        "Perturbations of a reference index, added in n².",
        &[&[float("reference", "index").as_index().or(1.0)], PLACED],
        &[many(Volume, "The terms.")],
    ),
    own_plugin(
        "cauchy",
        "n = a + b/λ² + c/λ⁴, λ in µm.",
        &[
            &[
                float("a", "no unit").positive().required(),
                float("b", "µm²").or(0.0),
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
                float("b1", "no unit").required(),
                float("c1", "µm²").at_least(0.0).required(),
                float("b2", "no unit").or(0.0),
                float("c2", "µm²").at_least(0.0).or(0.0),
                float("b3", "no unit").or(0.0),
                float("c3", "µm²").at_least(0.0).or(0.0),
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
        "The same extinction or albedo everywhere.",
        &[&[
            spectrum("value", "as the quantity that it stands for").required(),
            TO_WORLD,
        ]],
        &[],
    ),
];
