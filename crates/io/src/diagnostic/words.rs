//! Names of things in messages, in the language of the scene file.

use super::Location;

/// Returns true if a place is in a JSON file or in a dictionary, which has the same form.
fn in_json(place: &Location) -> bool {
    let extension = place.file().extension();
    place.source().is_index() || extension.is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

/// Returns the name of a type or a kind, or of several separated by " or ": `<float>`, or `float`
/// in JSON.
pub(crate) fn element(kind: &str, place: &Location) -> String {
    if in_json(place) {
        kind.to_owned()
    } else {
        format!("<{}>", kind.replace(" or ", "> or <"))
    }
}

/// Returns the entry for a parameter of a type: `<float name="radius">`, or `"radius" (float)` in
/// JSON.
pub(crate) fn entry(name: &str, kind: &str, place: &Location) -> String {
    if in_json(place) {
        format!("\"{name}\" ({kind})")
    } else {
        format!("<{} name=\"{name}\">", kind.replace(" or ", "> or <"))
    }
}

/// Returns the name of an object: `<shape type="sphere">`, or `{"type": "sphere"}` in JSON.
pub(crate) fn object(kind: &str, plugin: Option<&str>, place: &Location) -> String {
    match (in_json(place), plugin) {
        (true, plugin) => format!("{{\"type\": \"{}\"}}", plugin.unwrap_or(kind)),
        (false, Some(plugin)) => format!("<{kind} type=\"{plugin}\">"),
        (false, None) => format!("<{kind}>"),
    }
}
