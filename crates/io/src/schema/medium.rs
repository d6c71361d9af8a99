//! Media and phase functions.

use super::parameter::{boolean, float, list, spectrum, vector, word};
use super::row::{many, one, own_plugin, plugin, role};
use super::{Parameter, Plugin, Slot, substance};
use crate::scene::PluginKind::{self, Volume};
use crate::tissue;
use transport::phase::Phase;

const INDEX: &[Parameter] = &[float("ior", "index")
    .as_index()
    .or_computed("see the index rules")];

const SCATTERING: &[Parameter] = &[
    spectrum("sigma_t", "extinction per scene unit, ≥ 0").or(1.0),
    spectrum(
        "albedo",
        "fraction of the extinction that is scattering, 0 to 1",
    )
    .or(0.75),
    spectrum(
        "sigma_s",
        "scattering per scene unit, ≥ 0; with sigma_a instead of sigma_t and albedo",
    )
    .or(0.0),
    spectrum("sigma_a", "absorption per scene unit, ≥ 0").or(0.0),
    word(
        "material",
        &substance::TURBID_NAMES,
        "name of a substance, instead of coefficients, for scenes in millimetres",
    ),
    word(
        "tissue",
        &tissue::NAMES,
        "name of a tissue, instead of coefficients and a phase function, for films of wavelengths and scenes in \
         millimetres",
    ),
    float("blood", "fraction of the tissue's volume")
        .within(0.0, 1.0)
        .or(0.0),
    float(
        "saturation",
        "fraction of the haemoglobin that carries oxygen",
    )
    .within(0.0, 1.0)
    .or(0.0),
    float("water", "fraction of the tissue's volume")
        .within(0.0, 1.0)
        .or(0.0),
    float("fat", "fraction of the tissue's volume")
        .within(0.0, 1.0)
        .or(0.0),
    float("melanin", "fraction of the tissue's volume in melanosomes")
        .within(0.0, 1.0)
        .or(0.0),
    float(
        "volume_fraction",
        "fraction of the volume that the spheres of a phase function mie fill, instead of \
         coefficients; for scenes in millimetres",
    )
    .within(0.0, 0.741),
    float(
        "number_density",
        "number of spheres in a cubic millimetre, instead of volume_fraction",
    )
    .within(0.0, 1e18),
    float("scale", "factor of the extinction")
        .at_least(0.0)
        .or(1.0),
    spectrum(
        "emission",
        "radiance in vacuum of a black body with the temperature of the medium, ≥ 0",
    )
    .or(0.0),
    vector(
        "velocity",
        "velocity of the scatterers, in scene units per second, for records of light",
    )
    .or_triple([0.0, 0.0, 0.0]),
    spectrum(
        "fluorophore_sigma_a",
        "absorption by a fluorophore per scene unit, ≥ 0, in addition to the medium's own",
    )
    .or(0.0),
    list(
        "fluorescence_wavelengths",
        "wavelengths of the film, in nm, at which the fluorophore emits",
    ),
    list(
        "quantum_yields",
        "emitted photons at each of these wavelengths per photon that the fluorophore absorbs, in total ≤ 1",
    ),
    float("lifetime", "mean time from absorption to emission, s")
        .at_least(0.0)
        .or(0.0),
    float(
        "metres_per_unit",
        "length of a scene unit in metres; required with lifetime",
    )
    .positive(),
    boolean("sample_emitters", true, "accepted and ignored"),
    boolean("has_spectral_extinction", true, "accepted and ignored"),
];

const FIELD: Slot = role(Volume, "ior", "Refractive index that varies in space.");

const CHILDREN: &[Slot] = &[
    FIELD,
    role(Volume, "sigma_t", "Extinction that varies in space."),
    role(Volume, "albedo", "Albedo that varies in space."),
    role(Volume, "emission", "Emission that varies in space."),
    role(
        Volume,
        "velocity",
        "Velocity that varies in space: a grid of three channels.",
    ),
    one(
        PluginKind::Phase,
        "The phase function; isotropic without any.",
    ),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "homogeneous",
        "A medium that scatters and absorbs.",
        &[SCATTERING, INDEX],
        CHILDREN,
    ),
    plugin(
        "heterogeneous",
        "Alias of homogeneous.",
        &[SCATTERING, INDEX],
        CHILDREN,
    ),
    own_plugin("transparent", "A clear medium.", &[INDEX], &[FIELD]),
];

pub(super) const PHASES: &[Plugin] = &[
    plugin("isotropic", "Equal scattering in all directions.", &[], &[])
        .phase(|_| Ok(Phase::isotropic())),
    plugin(
        "hg",
        "Henyey–Greenstein.",
        &[&[float("g", "mean cosine").above(-1.0).below(1.0).or(0.8)]],
        &[role(Volume, "g", "A mean cosine that varies in space.")],
    ),
    own_plugin(
        "vmf",
        "von Mises–Fisher.",
        &[&[float("kappa", "concentration").at_least(0.0).required()]],
        &[],
    )
    .phase(|number| Phase::von_mises_fisher(number("kappa"))),
    plugin(
        "rayleigh",
        "Particles much smaller than the wavelength.",
        &[],
        &[],
    )
    .phase(|_| Ok(Phase::rayleigh())),
    own_plugin(
        "mie",
        "Mie scattering by spheres of any size.",
        &[&[
            float(
                "radius",
                "radius of spheres, or median of a log-normal distribution, µm",
            )
            .positive()
            .required(),
            float(
                "geometric_deviation",
                "geometric standard deviation of radii",
            )
            .within(1.0, 4.0)
            .or(1.0),
            spectrum("eta", "index of spheres, > 0").required(),
            spectrum("k", "imaginary part of the index of spheres, ≥ 0").or(0.0),
            spectrum("ext_eta", "index of the medium around the spheres, > 0").required(),
            float(
                "wavelength",
                "wavelength in vacuum, nm; required unless the film has wavelengths",
            )
            .positive()
            .or_computed("that of the channel"),
        ]],
        &[],
    ),
    plugin(
        "sggx",
        "Mirror-like flakes with the normals of an ellipsoid (SGGX).",
        &[&[list(
            "S",
            "elements xx, yy, zz, xy, xz, yz of the positive definite matrix S: ωᵀSω is the square of the flakes' \
             projected area along ω",
        )]],
        &[role(
            Volume,
            "S",
            "A matrix that varies in space: a grid of six channels.",
        )],
    ),
    plugin(
        "blendphase",
        "A mixture of two phase functions.",
        &[&[float("weight", "weight of the second bsdf")
            .within(0.0, 1.0)
            .required()]],
        &[
            many(PluginKind::Phase, "The two."),
            role(Volume, "weight", "A weight that varies in space."),
        ],
    ),
    own_plugin(
        "mixturephase",
        "A mixture of any number of phase functions.",
        &[&[list("weights", "weights of the phase functions, ≥ 0").required()]],
        &[many(PluginKind::Phase, "As many as there are shares.")],
    ),
    plugin(
        "tabphase",
        "Values at equally spaced cosines, or quantiles of the cosine.",
        &[&[
            list(
                "values",
                "at least two numbers ≥ 0, from cosine -1 to 1; give values or quantiles",
            ),
            list(
                "quantiles",
                "cosines that increase from -1 to 1: light is as often scattered to cosines between any two neighbours",
            ),
        ]],
        &[],
    ),
];
