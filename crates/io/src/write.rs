//! Scenes as files, by their extension.

use crate::error::FileError;
use crate::read::is_json;
use crate::scene::SceneDescription;
use crate::xml::UnwritableValue;
use crate::{atomic, json, xml};
use std::path::Path;

/// Why a scene is not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// XML has no words for a value.
    #[error("{0}: write a .json file")]
    Value(#[from] UnwritableValue),
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Writes a scene for [`read_scene`](crate::read_scene): JSON if the extension is `.json`, else XML of Mitsuba 3. Data files are named as
/// they are seen from the folder of the new file.
///
/// # Errors
/// A value that XML cannot hold, and a file that cannot be written.
pub fn write_scene(scene: &SceneDescription, path: &Path) -> Result<(), WriteError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let scene = scene.relocated(folder.unwrap_or(Path::new(".")));
    let text = if is_json(path) {
        json::write(&scene)
    } else {
        xml::write(&scene)?
    };
    Ok(atomic::write_bytes(path, text.as_bytes())?)
}
