//! How messages name things: as the language of the file would write them.

use super::Location;

/// Whether a place is in a file of JSON, or in a dictionary, which says the same.
fn in_json(place: &Location) -> bool {
    let extension = place.file().extension();
    place.source().is_index() || extension.is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

/// A type or a kind, or several with " or " between: `<float>`, or `float` in JSON.
pub(crate) fn element(kind: &str, place: &Location) -> String {
    if in_json(place) {
        kind.to_owned()
    } else {
        format!("<{}>", kind.replace(" or ", "> or <"))
    }
}

/// A parameter of a type: `<float name="radius">`, or `"radius" (float)` in JSON.
pub(crate) fn entry(name: &str, kind: &str, place: &Location) -> String {
    if in_json(place) {
        format!("\"{name}\" ({kind})")
    } else {
        format!("<{} name=\"{name}\">", kind.replace(" or ", "> or <"))
    }
}

/// An object: `<shape type="sphere">`, or `{"type": "sphere"}` in JSON.
pub(crate) fn object(kind: &str, plugin: Option<&str>, place: &Location) -> String {
    match (in_json(place), plugin) {
        (true, plugin) => format!("{{\"type\": \"{}\"}}", plugin.unwrap_or(kind)),
        (false, Some(plugin)) => format!("<{kind} type=\"{plugin}\">"),
        (false, None) => format!("<{kind}>"),
    }
}
