//! Scene files in the XML dialect of Mitsuba 3.
//!
//! ```
//! use morgana_io::{Diagnostics, xml};
//!
//! let text = r#"<scene version="3.0.0"><shape type="sphere"/></scene>"#;
//! let mut diagnostics = Diagnostics::new();
//! let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics).unwrap();
//! assert_eq!(scene.root.children[0].object.plugin, "sphere");
//! ```
//!
//! Elements: `scene`, the plugins of [`PluginKind`](crate::PluginKind), the parameters
//! `float integer boolean string rgb srgb blackbody spectrum point vector transform`, and
//! `ref alias default include`. In any attribute, `$name` and `${name}` stand for a parameter's
//! value.

mod document;
mod element;
mod loader;
mod numbers;
mod properties;
mod schema;
mod spectra;
mod tags;
mod transforms;
mod write;

pub use schema::xml_schema;
pub use write::{ArrayInXml, write};

use std::path::Path;

use crate::diagnostic::{Diagnostics, SourceFile};
use crate::draft;
use crate::scene::SceneDescription;

/// Reads a scene file. `overrides` are pairs of name and value that replace the file's
/// `<default>`s.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found.
pub fn load(
    path: &Path,
    overrides: &[(String, String)],
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let source = draft::read(path).map_err(|d| diagnostics.push(d)).ok()?;
    loader::load(source, overrides, diagnostics)
}

/// Reads a scene from text. `name` is the path that messages show and from which relative paths
/// start.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found.
pub fn parse(
    text: &str,
    name: impl AsRef<Path>,
    overrides: &[(String, String)],
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let source = SourceFile::new(name.as_ref(), text.to_owned());
    loader::load(source, overrides, diagnostics)
}
