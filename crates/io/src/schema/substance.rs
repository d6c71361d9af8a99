//! Substances that stand for their index of refraction.

/// Refractive indices at 589.3 nm and room temperature, gases at standard conditions. The names and
/// values are those of Mitsuba's documentation, where each is cited.
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

/// Their names.
pub(crate) const NAMES: [&str; INDICES.len()] = {
    let mut names = [""; INDICES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = INDICES[i].0;
        i += 1;
    }
    names
};
