//! Scenes as files, by their extension.

use crate::error::FileError;
use crate::read::is_json;
use crate::scene::{
    NameOfFile, ObjectDescription, SceneDescription, SpectrumValue, Value, descendants,
};
use crate::xml::ArrayInXml;
use crate::{atomic, json, xml};
use std::path::Path;

/// Why a scene is not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// XML has no element for a value.
    #[error("{0}: write a .json file")]
    Array(#[from] ArrayInXml),
    /// A text that would not be read as it is: `$` begins the name of a parameter, and XML has no control characters.
    #[error(
        "{object} has the text '{text}', which scene files cannot hold ($ names a parameter): choose another name"
    )]
    Text {
        /// What has it.
        object: String,
        /// The text, control characters escaped.
        text: String,
    },
    /// The name of a data file.
    #[error(transparent)]
    Name(#[from] NameOfFile),
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Writes a scene for [`read_scene`](crate::read_scene): JSON if the extension is `.json`, else XML of Mitsuba 3. Data files are named as
/// they are seen from the folder of the new file.
///
/// # Errors
/// What scene files cannot hold, and a file that cannot be written.
pub fn write_scene(scene: &SceneDescription, path: &Path) -> Result<(), WriteError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let scene = scene.relocated(folder.unwrap_or(Path::new(".")))?;
    descendants([&*scene.root]).try_for_each(check_texts)?;
    let text = if is_json(path) {
        json::write(&scene)
    } else {
        xml::write(&scene)?
    };
    Ok(atomic::write_bytes(path, text.as_bytes())?)
}

/// Refuses texts that would be read as something else.
fn check_texts(object: &ObjectDescription) -> Result<(), WriteError> {
    let names = object.properties.iter().map(|p| p.name.as_str());
    let roles = object.children.iter().filter_map(|c| c.name.as_deref());
    let values = object.properties.iter().filter_map(|p| match &p.value {
        Value::String(text) | Value::Spectrum(SpectrumValue::File(text)) => Some(text.as_str()),
        _ => None,
    });
    let own = [Some(object.plugin.as_str()), object.id.as_deref()];
    let mut texts = own
        .into_iter()
        .flatten()
        .chain(names)
        .chain(roles)
        .chain(values);
    let is_control = |c: char| c.is_control() && !['\n', '\r', '\t'].contains(&c);
    match texts.find(|text| text.contains(|c| c == '$' || is_control(c))) {
        None => Ok(()),
        Some(text) => Err(WriteError::Text {
            object: object.label(),
            text: text.escape_debug().to_string(),
        }),
    }
}
