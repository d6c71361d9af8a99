//! Scene files by their extension.

use crate::diagnostic::Diagnostics;
use crate::input::Limits;
use crate::scene::SceneDescription;
use crate::{json, xml};
use std::path::Path;

/// Reads a scene file without making a scene of it: JSON if its extension is `.json`, else XML. `overrides` are pairs of parameter
/// name and value that take the place of those in the file. `limits` are those of [`json::load`].
///
/// Returns `None` if there was an error; every problem found is in `diagnostics`.
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

/// Whether a scene file is JSON.
pub fn is_json(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("json"))
}
