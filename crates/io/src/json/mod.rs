//! Scene files in JSON, with the same structure as the dictionaries of Mitsuba's Python interface.
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

use crate::diagnostic::{Diagnostics, Location, SourceFile};
use crate::draft;
use crate::input::Limits;
use crate::scene::{SceneDescription, Value};
use crate::schema::Type;
use std::path::Path;

/// Reads a scene file. `overrides` are pairs of name and value that replace the file's
/// `parameters`. Volumes of MCX input files take at most as much memory as `limits` allow.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found.
pub fn load(
    path: &Path,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let source = draft::read(path).map_err(|d| diagnostics.push(d)).ok()?;
    loader::load(&source, overrides, limits, diagnostics)
}

/// Reads a scene from text, with the default [`Limits`]. `name` is the path that messages show and
/// from which relative paths start.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found.
pub fn parse(
    text: &str,
    name: impl AsRef<Path>,
    overrides: &[(String, String)],
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    parse_within(text, name, overrides, Limits::default(), diagnostics)
}

/// Reads a scene from text like [`parse`], with the given memory limits.
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

/// Makes a scene that a program has built, with memory limits as in [`load`]. Relative paths start
/// from the current folder.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found, with places such
/// as `scene["ball"]["radius"]`.
pub fn build(
    scene: Item,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let root = build::tree(scene, diagnostics);
    loader::describe(root, overrides, limits, diagnostics)
}

/// Converts a value that a program has built, of a parameter of a `known` type. Messages name the
/// value by `place`. Returns the value, `None` after an error, and its place.
pub(crate) fn value_of_item(
    item: Item,
    place: String,
    known: Option<Type>,
    diagnostics: &mut Diagnostics,
) -> (Option<Value>, Location) {
    let node = build::tree_at(item, place, diagnostics);
    (values::value(&node, known, diagnostics), node.location)
}
