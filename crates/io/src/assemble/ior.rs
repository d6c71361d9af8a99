//! Indices of common substances, by the names that Mitsuba gives them.

use crate::query::{INDEX, Query};
use crate::scene::Value;
use crate::schema::substance::{INDICES, NAMES};

/// An index given as a number or as the name of a substance; `None` if it is not given.
pub(super) fn index(query: &mut Query, name: &str) -> Option<f64> {
    if !query.has(name) {
        return None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name)?;
    if !matches!(property.value, Value::String(_)) {
        return Some(query.float_in(name, INDEX, 1.0));
    }
    Some(INDICES[query.one_of(name, &NAMES)].1)
}
