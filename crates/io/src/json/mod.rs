//! Scene files in JSON: the dictionaries of Mitsuba's Python interface, written down.
//!
//! ```
//! use morgana_io::{Diagnostics, json};
//!
//! let text = r#"{"type": "scene", "ball": {"type": "sphere", "radius": 2}}"#;
//! let mut diagnostics = Diagnostics::new();
//! let scene = json::parse(text, "scene.json", &[], &mut diagnostics).unwrap();
//! assert_eq!(scene.root.children[0].object.id.as_deref(), Some("ball"));
//! ```
//!
//! The kind of an object follows from its `type`, by the [table](crate::schema) of plugins.

mod build;
mod keys;
mod loader;
mod mcx;
mod parameters;
mod transforms;
mod tree;
mod values;
mod write;

pub use build::Item;
pub use write::write;

use crate::diagnostic::{Diagnostics, SourceFile};
use crate::draft;
use crate::input::Limits;
use crate::scene::SceneDescription;
use std::path::Path;

/// Reads a scene file. `overrides` are pairs of parameter name and value that take the place of the file's
/// `parameters`. An input file of MCX makes no volume that takes more memory than `limits` allow.
///
/// Returns `None` if there was an error; every problem found is in `diagnostics`.
pub fn load(
    path: &Path,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let source = draft::read(path).map_err(|d| diagnostics.push(d)).ok()?;
    loader::load(&source, overrides, limits, diagnostics)
}

/// Reads a scene from text, with the default [`Limits`]. `name` is the path that messages show and relative paths start
/// from.
///
/// Returns `None` if there was an error; every problem found is in `diagnostics`.
pub fn parse(
    text: &str,
    name: impl AsRef<Path>,
    overrides: &[(String, String)],
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    parse_within(text, name, overrides, Limits::default(), diagnostics)
}

/// Reads a scene from text, as [`parse`] does, within other limits of memory.
pub fn parse_within(
    text: &str,
    name: impl AsRef<Path>,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let source = SourceFile::new(name.as_ref(), text.to_owned());
    loader::load(&source, overrides, limits, diagnostics)
}

/// Makes a scene of what a program has built, within limits of memory as in [`load`]. Relative paths start from the
/// current folder.
///
/// Returns `None` if there was an error; every problem found is in `diagnostics`, with places such as
/// `scene["ball"]["radius"]`.
pub fn build(
    scene: Item,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let root = build::tree(scene, diagnostics);
    loader::describe(root, overrides, limits, diagnostics)
}
