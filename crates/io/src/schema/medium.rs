//! Media and phase functions.

use super::row::{boolean, float, list, many, one, plugin, role, spectrum, vector, word};
use super::{Parameter, Plugin, Slot, substance};
use crate::scene::PluginKind::{Phase, Volume};
use crate::tissue;

const INDEX: &[Parameter] = &[float("ior", "(see the index rules)", "index, > 0")];

const SCATTERING: &[Parameter] = &[
    spectrum("sigma_t", "1", "extinction per scene unit, ≥ 0"),
    spectrum("albedo", "0.75", "share that is scattered, 0 to 1"),
    spectrum(
        "sigma_s",
        "",
        "scattering per scene unit, ≥ 0; with sigma_a instead of sigma_t and albedo",
    ),
    spectrum("sigma_a", "", "absorption per scene unit, ≥ 0"),
    word(
        "material",
        &substance::TURBID_NAMES,
        "a substance, in place of coefficients, for scenes in millimetres",
    ),
    word(
        "tissue",
        &tissue::NAMES,
        "in place of coefficients and a phase function, for films of wavelengths and scenes in millimetres",
    ),
    float("blood", "0", "share of a tissue's volume, 0 to 1"),
    float(
        "saturation",
        "0",
        "share of its haemoglobin with oxygen, 0 to 1",
    ),
    float("water", "0", "share of a tissue's volume, 0 to 1"),
    float(
        "volume_fraction",
        "",
        "share of the volume that the spheres of a phase function mie fill, 0 to 0.741, in place of coefficients; for scenes in millimetres",
    ),
    float(
        "number_density",
        "",
        "the same as their number in a cubic millimetre, ≥ 0",
    ),
    float("scale", "1", "factor of the extinction, ≥ 0"),
    spectrum(
        "emission",
        "0",
        "radiance in vacuum of a black body as warm as the medium, ≥ 0",
    ),
    vector(
        "velocity",
        "0, 0, 0",
        "of what scatters light, in scene units per second, for records of detected light",
    ),
    boolean("sample_emitters", "true", "accepted and ignored"),
    boolean("has_spectral_extinction", "true", "accepted and ignored"),
];

const FIELD: Slot = role(Volume, "ior", "The index where it varies.");

const CHILDREN: &[Slot] = &[
    FIELD,
    role(Volume, "sigma_t", "The extinction where it varies."),
    role(Volume, "albedo", "The albedo where it varies."),
    role(Volume, "emission", "The emission where it varies."),
    role(
        Volume,
        "velocity",
        "The velocity where it varies: a grid of three channels.",
    ),
    one(Phase, "The phase function; isotropic without any."),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "homogeneous",
        "Matter that scatters and absorbs.",
        &[SCATTERING, INDEX],
        CHILDREN,
    ),
    plugin(
        "heterogeneous",
        "The same as homogeneous.",
        &[SCATTERING, INDEX],
        CHILDREN,
    ),
    plugin("transparent", "Clear matter.", &[INDEX], &[FIELD]),
];

pub(super) const PHASES: &[Plugin] = &[
    plugin("isotropic", "The same in all directions.", &[], &[]),
    plugin(
        "hg",
        "Henyey–Greenstein.",
        &[&[float("g", "0.8", "mean cosine, between -1 and 1")]],
        &[role(Volume, "g", "A mean cosine that varies in space.")],
    ),
    plugin(
        "vmf",
        "von Mises–Fisher.",
        &[&[float("kappa", "required", "concentration, ≥ 0")]],
        &[],
    ),
    plugin(
        "rayleigh",
        "Particles much smaller than the wavelength.",
        &[],
        &[],
    ),
    plugin(
        "mie",
        "Spheres of any size, by their index and that around them.",
        &[&[
            float(
                "radius",
                "required",
                "of spheres, or the median of a log-normal distribution, µm, > 0",
            ),
            float(
                "geometric_deviation",
                "1",
                "geometric standard deviation of radii, 1 to 4",
            ),
            spectrum("eta", "required", "index of spheres, > 0"),
            spectrum("k", "0", "imaginary part of their index, ≥ 0"),
            spectrum("ext_eta", "required", "index of the medium around, > 0"),
            float(
                "wavelength",
                "(that of the channel)",
                "in vacuum, nm, > 0; required unless the film has wavelengths",
            ),
        ]],
        &[],
    ),
    plugin(
        "blendphase",
        "A mixture of two phase functions.",
        &[&[float("weight", "required", "of the second, 0 to 1")]],
        &[
            many(Phase, "The two."),
            role(Volume, "weight", "A weight that varies in space."),
        ],
    ),
    plugin(
        "mixturephase",
        "A mixture of any number of phase functions.",
        &[&[list("weights", "required", "their shares, ≥ 0")]],
        &[many(Phase, "As many as there are shares.")],
    ),
    plugin(
        "tabphase",
        "Values at equally spaced cosines.",
        &[&[list(
            "values",
            "required",
            "two or more numbers ≥ 0, from cosine -1 to 1",
        )]],
        &[],
    ),
];
