//! Reading scene files in XML or JSON.

use crate::diagnostic::Diagnostics;
use crate::input::Limits;
use crate::scene::SceneDescription;
use crate::{json, xml};
use std::path::Path;

/// Reads a scene file without assembling the scene: JSON if its extension is `.json`, otherwise
/// XML. `overrides` are pairs of parameter name and value that replace those in the file. `limits`
/// have the meaning that they have for [`json::load`].
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found.
pub fn read_scene(
    path: &Path,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    if is_json(path) {
        json::load(path, overrides, limits, diagnostics)
    } else {
        xml::load(path, overrides, diagnostics)
    }
}

/// Returns true if a scene file is JSON.
pub fn is_json(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("json"))
}
