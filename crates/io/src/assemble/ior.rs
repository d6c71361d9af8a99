//! Indices of common substances, by the names that Mitsuba gives them.

use crate::query::{POSITIVE, Query};
use crate::scene::Value;

/// Refractive indices at 589.3 nm and room temperature, gases at standard conditions. The names and
/// values are those of Mitsuba's documentation, where each is cited.
const INDICES: [(&str, f64); 14] = [
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

/// An index given as a number or as the name of a substance; `None` if it is not given.
pub(super) fn index(query: &mut Query, name: &str) -> Option<f64> {
    if !query.has(name) {
        return None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name)?;
    if !matches!(property.value, Value::String(_)) {
        return Some(query.float_in(name, POSITIVE, 1.0));
    }
    let names = INDICES.map(|(name, _)| name);
    Some(INDICES[query.one_of(name, &names)].1)
}
