//! Writing scenes to files in XML or JSON.

use crate::error::FileError;
use crate::read::is_json;
use crate::scene::{
    NameOfFile, ObjectDescription, SceneDescription, SpectrumValue, Value, descendants,
};
use crate::xml::ArrayInXml;
use crate::{atomic, json, xml};
use std::path::Path;

/// Reason why a scene is not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// XML has no element for a value.
    #[error("{0}: write a .json file")]
    Array(#[from] ArrayInXml),
    /// A text that would read differently: `$` starts the name of a parameter, and XML has no
    /// control characters.
    #[error(
        "{object} has the text '{text}', which scene files cannot hold ($ names a parameter): choose another name"
    )]
    Text {
        /// Object that has the text.
        object: String,
        /// Text, with control characters escaped.
        text: String,
    },
    /// The name of a data file is not Unicode.
    #[error(transparent)]
    Name(#[from] NameOfFile),
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Writes a scene for [`read_scene`](crate::read_scene): JSON if the extension is `.json`,
/// otherwise XML of Mitsuba 3. Names of data files become relative to the folder of the new file.
///
/// # Errors
/// Returns an error if a scene file cannot hold the scene, or cannot be written.
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

/// Refuses texts that would read differently.
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
