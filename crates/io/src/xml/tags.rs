//! Element names of the XML dialect.

use crate::scene::PluginKind;

/// Elements that set a parameter.
const PROPERTIES: [&str; 10] = [
    "float",
    "integer",
    "boolean",
    "string",
    "rgb",
    "srgb",
    "spectrum",
    "point",
    "vector",
    "transform",
];
/// Elements that are neither plugins nor parameters.
const OTHERS: [&str; 7] = [
    "ref",
    "alias",
    "default",
    "include",
    "path",
    "animation",
    "blackbody",
];
/// Elements of a transform.
pub(super) const TRANSFORMS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Role of an element.
pub(super) enum Tag {
    Plugin(PluginKind),
    Property,
    Transform,
    Animation,
    Blackbody,
    Ref,
    Alias,
    Default,
    Include,
    Path,
    Unknown,
}

impl Tag {
    /// Classifies an element by its name. `typed` is true if the element has a `type`, as every
    /// plugin must.
    pub(super) fn new(name: &str, typed: bool) -> Self {
        match name {
            "ref" => Tag::Ref,
            "alias" => Tag::Alias,
            "default" => Tag::Default,
            "include" => Tag::Include,
            "path" => Tag::Path,
            "transform" => Tag::Transform,
            "animation" => Tag::Animation,
            "blackbody" => Tag::Blackbody,
            "spectrum" if typed => Tag::Plugin(PluginKind::Spectrum),
            name if PROPERTIES.contains(&name) => Tag::Property,
            name => match PluginKind::from_tag(name) {
                Some(PluginKind::Scene) | None => Tag::Unknown,
                Some(kind) => Tag::Plugin(kind),
            },
        }
    }
}

/// Returns the name of every element that may stand in a plugin.
pub(super) fn known() -> impl Iterator<Item = &'static str> {
    let plugins = PluginKind::ALL
        .iter()
        .map(|k| k.tag())
        .filter(|t| *t != "scene");
    plugins.chain(PROPERTIES).chain(OTHERS)
}
