//! Volumes: refractive indices, and what else varies in space.

use super::row::{
    TO_WORLD, boolean, choice, float, integer, list, many, number_or_word, one, plugin, point,
    spectrum, tensor, text, vector, word,
};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::Volume;

const PLACED: &[Parameter] = &[TO_WORLD];

const FILE: &[Parameter] = &[
    text("filename", "", "the file with the samples; this, or data"),
    tensor(
        "data",
        "",
        "the samples themselves: an array of 3 axes, or 4 with channels",
    ),
    text("dataset", "", "which of a file's arrays; required for HDF5"),
    text(
        "axis_order",
        "",
        "which axis of the array is which, such as zyx; required where the format does not say; zyx for data",
    ),
    choice(
        "placement",
        &["centers", "nodes"],
        "",
        "where samples sit; required for an index, unless the file says it",
    ),
    TO_WORLD,
    boolean(
        "use_grid_bbox",
        "false",
        "whether the bounding box of a .vol file takes the place of the unit cube",
    ),
];

const NUMBERS: &[Parameter] = &[
    float("scale", "1", "factor of the file's numbers"),
    float("offset", "0", "added to them"),
];

const SMOOTHING: &[Parameter] = &[
    number_or_word(
        "smoothing",
        &["none", "auto"],
        "standard deviation of the samples' noise, by which the spline may pass them, >= 0; or auto: that of their rounding",
    ),
    boolean(
        "condense",
        "true",
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
    boolean("raw", "true", "accepted and ignored"),
    boolean("accel", "true", "accepted and ignored"),
];

const LAW: &[Parameter] = &[
    float(
        "reference",
        "0",
        "density or pressure at which the index is n0",
    ),
    float("scale", "1", "factor of the samples' effect"),
];

const N0: Parameter = float("n0", "required", "index, > 0");
const ORIGIN: Parameter = point(
    "origin",
    "[0, 0, 0]",
    "a point on the axis, or where n = n0",
);
const CENTER: Parameter = point("center", "[0, 0, 0]", "the middle");
const DIRECTION: Parameter = vector("direction", "[0, 0, 1]", "of the axis");
const SLOPE: Parameter = vector("slope", "required", "gradient per scene unit");
const DN_DP: Parameter = float(
    "dn_dp",
    "",
    "index per pascal, at most 1e-6; needed with a pressure",
);

const ELASTO_OPTIC: &[Parameter] = &[float(
    "elasto_optic",
    "",
    "ρc² ∂n/∂p of the medium, > 0; needed for tagged light. Samples are those of sound where a frequency is given",
)];

const MODE: &[Parameter] = &[
    float("amplitude", "", "of the index; this, or pressure and dn_dp"),
    float("pressure", "", "amplitude, Pa"),
    DN_DP,
    integer("order", "0", "m, 0 to 64"),
    float("phase", "0", "of the azimuth, radians"),
    float("time_phase", "0", "radians"),
    float(
        "wave_number",
        "",
        "radians per scene unit, > 0; this, or frequency and sound_speed",
    ),
    float("frequency", "", "Hz, > 0"),
    float("sound_speed", "", "scene units per second, > 0"),
];

const IN_TIME: &[Parameter] = &[
    float(
        "frequency",
        "",
        "Hz, > 0: samples are complex amplitudes, or a series in time",
    ),
    float(
        "sound_speed",
        "",
        "scene units per second, > 0; required with frequency",
    ),
    float("time_phase", "0", "with frequency: radians"),
    float(
        "time_step",
        "(the file's)",
        "s, > 0: the channels are instants",
    ),
    float(
        "periods",
        "(those of the second half)",
        "the last so many are fitted, > 0",
    ),
    integer("frame", "", "the channel that is taken, ≥ 0"),
];

const SOURCE: &[Parameter] = &[
    choice(
        "aperture",
        &["bowl", "piston", "linear_array", "ring_array"],
        "required",
        "the surface that moves",
    ),
    float(
        "radius",
        "",
        "of curvature of a bowl, or of the ring, scene units, > 0",
    ),
    float(
        "diameter",
        "",
        "of a bowl's rim or a piston, scene units, > 0",
    ),
    float(
        "pressure",
        "required",
        "density times speed of sound times velocity of the surface, Pa",
    ),
    float("frequency", "required", "Hz, > 0"),
    float("sound_speed", "required", "scene units per second, > 0"),
    float("time_phase", "0", "radians"),
    ORIGIN,
    DIRECTION,
    vector(
        "reference",
        "(x, or y if the direction is nearly x)",
        "along a linear array, to the first element of a ring",
    ),
];

const ELEMENTS: &[Parameter] = &[
    integer("elements", "", "number of elements of an array, ≥ 1"),
    float(
        "pitch",
        "",
        "from an element of a linear array to the next, scene units, > 0",
    ),
    float(
        "width",
        "(all that there is)",
        "of an element, along the array, scene units, > 0",
    ),
    float(
        "height",
        "",
        "of an element, across the array, scene units, > 0",
    ),
    point("focus", "", "where all elements are in phase"),
    list("delays", "0", "of the elements, s; in place of a focus"),
    list("apodization", "1", "factors of the elements' amplitudes"),
];

const REGION: &[Parameter] = &[
    N0,
    DN_DP,
    point(
        "min",
        "required",
        "least corner of the box in which the sound is computed",
    ),
    point("max", "required", "its greatest corner"),
    float(
        "spacing",
        "(a tenth of a wavelength)",
        "of samples at most, scene units, > 0",
    ),
];

const COORDINATES: &[&str] = &["r", "rho", "x", "y", "z"];

const OF_FORMULA: &Parameter = &float(
    "(any name)",
    "",
    "a number that the formula uses by this name",
);

const DISPERSION: &[Parameter] = &[float(
    "reference_wavelength",
    "",
    "nm, > 0: where a nested volume gives the index; required with it",
)];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "constant",
        "The same index everywhere.",
        &[&[float("value", "required", "> 0")], PLACED],
        &[],
    ),
    plugin(
        "linear",
        "n = n0 + slope·(x − origin).",
        &[&[N0, SLOPE, ORIGIN], PLACED],
        &[],
    ),
    plugin(
        "linear_square",
        "n² = n0² + slope·(x − origin).",
        &[&[N0, SLOPE, ORIGIN], PLACED],
        &[],
    ),
    plugin(
        "luneburg",
        "n² = n_exterior² (2 − r²/radius²).",
        &[
            &[
                float("n_exterior", "1", "> 0"),
                CENTER,
                float("radius", "1", "scene units, > 0"),
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "selfoc",
        "n² = n0² (1 − alpha² r²), r from the axis.",
        &[
            &[
                N0,
                float("alpha", "required", "per scene unit, ≥ 0"),
                ORIGIN,
                DIRECTION,
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "fisheye",
        "n = n0/(1 + r²/radius²).",
        &[
            &[
                float("n0", "2", "> 0"),
                CENTER,
                float("radius", "1", "scene units, > 0"),
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "gaussian",
        "n = n0 + delta exp(−r²/2 width²).",
        &[
            &[
                N0,
                float("delta", "required", "height"),
                CENTER,
                float("width", "required", "scene units, > 0"),
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "acoustic",
        "Standing sound around an axis: one mode, or nested ones.",
        &[
            &[
                N0,
                ORIGIN,
                DIRECTION,
                vector("reference", "(any)", "where the azimuth is 0"),
            ],
            MODE,
            ELASTO_OPTIC,
            PLACED,
        ],
        &[many(Volume, "Modes.")],
    ),
    plugin("mode", "A mode of an acoustic field.", &[MODE], &[]),
    plugin(
        "expression",
        "An index by a formula in x, y, z, r and rho.",
        &[
            &[
                text("n", "", "formula of the index; this, or n2"),
                text("n2", "", "formula of its square"),
            ],
            PLACED,
        ],
        &[],
    )
    .with_others(OF_FORMULA),
    plugin(
        "profile",
        "An index that varies with one coordinate, by a table.",
        &[
            &[
                choice(
                    "coordinate",
                    COORDINATES,
                    "required",
                    "what it varies with: the distance from the origin or from the z axis, or a coordinate",
                ),
                list(
                    "table",
                    "",
                    "pairs: coordinate, index; this, data or filename",
                ),
                tensor("data", "", "the same as an array of two columns"),
                text("filename", "", "a text file with two columns"),
                float(
                    "shift",
                    "0",
                    "added to the table's coordinates, such as a radius to heights",
                ),
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "standard_atmosphere",
        "The index of the US Standard Atmosphere of 1976, above the plane z = 0 or around a sphere.",
        &[
            &[
                float("radius", "", "of the sphere around the origin, > 0"),
                float("metres_per_unit", "1", "metres in a scene unit, > 0"),
                float("wavelength", "(the channel's)", "of air, nm, 230 to 1690"),
                float("constant", "", "K in m³/kg, instead of the wavelength"),
            ],
            PLACED,
        ],
        &[],
    ),
    plugin(
        "bspline",
        "A tricubic B-spline through samples of the index.",
        &[FILE, NUMBERS, SMOOTHING],
        &[],
    ),
    plugin(
        "gladstone_dale",
        "The index of a gas from samples of its density, kg/m³.",
        &[
            FILE,
            &[
                float("n0", "1", "index at the reference, > 0"),
                float("wavelength", "(the channel's)", "of air, nm, 230 to 1690"),
                float("constant", "", "K in m³/kg, instead of the wavelength"),
            ],
            LAW,
            SMOOTHING,
        ],
        &[],
    ),
    plugin(
        "pressure",
        "The index of a liquid from samples of the pressure, Pa.",
        &[FILE, &[N0, DN_DP], LAW, SMOOTHING, IN_TIME, ELASTO_OPTIC],
        &[],
    ),
    plugin(
        "transducer",
        "The index of a liquid in the sound of a transducer.",
        &[SOURCE, ELEMENTS, REGION, PLACED, ELASTO_OPTIC],
        &[],
    ),
    plugin(
        "sum",
        "Perturbations of a reference index, added in n².",
        &[&[float("reference", "1", "index, > 0")], PLACED],
        &[many(Volume, "The terms.")],
    ),
    plugin(
        "cauchy",
        "n = a + b/λ² + c/λ⁴, λ in µm.",
        &[
            &[
                float("a", "required", "> 0"),
                float("b", "0", "µm²"),
                float("c", "0", "µm⁴"),
            ],
            DISPERSION,
        ],
        &[one(Volume, "The index at the reference wavelength.")],
    ),
    plugin(
        "sellmeier",
        "n² = 1 + Σ bᵢλ²/(λ² − cᵢ), λ in µm.",
        &[
            &[
                float("b1", "required", "no unit"),
                float("c1", "required", "µm², ≥ 0"),
                float("b2", "0", "no unit"),
                float("c2", "0", "µm², ≥ 0"),
                float("b3", "0", "no unit"),
                float("c3", "0", "µm², ≥ 0"),
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
            spectrum("value", "required", "as the quantity that it stands for"),
            TO_WORLD,
        ]],
        &[],
    ),
];
