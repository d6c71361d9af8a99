//! Substances that a scene may name instead of a refractive index, or of scattering and absorption
//! coefficients.

/// Refractive indices at 589.3 nm and room temperature; gases at standard conditions. Names and
/// values come from Mitsuba's documentation, which cites a source for each.
pub(crate) const INDICES: [(&str, f64); 14] = [
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water ice", 1.31),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("fused quartz", 1.458),
    ("glycerol", 1.4729),
    ("acrylic glass", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("diamond", 2.419),
];

/// Names of the substances in [`INDICES`].
pub(crate) const NAMES: [&str; INDICES.len()] = {
    let mut names = [""; INDICES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = INDICES[i].0;
        i += 1;
    }
    names
};

/// Scattering and absorption of a substance for red, green and blue light, in 1/mm.
pub(crate) struct Turbid {
    pub name: &'static str,
    /// Reduced scattering coefficient σs' = (1 − g) σs, for scattering that is isotropic.
    pub scattering: [f64; 3],
    pub absorption: [f64; 3],
}

const fn turbid(name: &'static str, scattering: [f64; 3], absorption: [f64; 3]) -> Turbid {
    Turbid {
        name,
        scattering,
        absorption,
    }
}

/// Coefficients measured by H. W. Jensen, S. R. Marschner, M. Levoy and P. Hanrahan, "A practical
/// model for subsurface light transport", SIGGRAPH 2001. The names are those in Mitsuba 0.6.
pub(crate) const TURBID: [Turbid; 12] = [
    turbid("apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    turbid("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    turbid("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    turbid("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    turbid("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    turbid("marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    turbid("potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    turbid("skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    turbid("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    turbid("skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    turbid("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    turbid("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

/// Names of the substances in [`TURBID`], after `none`.
pub(crate) const TURBID_NAMES: [&str; TURBID.len() + 1] = {
    let mut names = ["none"; TURBID.len() + 1];
    let mut i = 0;
    while i < TURBID.len() {
        names[i + 1] = TURBID[i].name;
        i += 1;
    }
    names
};
