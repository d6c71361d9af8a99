//! The scene description: a tree of plugins with parameters, as written in a file.
//!
//! Nothing here knows what a plugin means. References are resolved: an object that is referenced
//! twice is the same [`ObjectDescription`] with the same [`ObjectId`] in both places.

mod extinction;
mod hash;
mod kind;
mod registry;
mod relocate;
mod spectrum;

pub(crate) use formats::colour::rgb_from_hex;
pub use formats::colour::{linear_from_srgb, srgb_from_linear};
pub use formats::tensor::{Numbers, Tensor};
pub use hash::SceneHash;
pub use kind::PluginKind;
pub use registry::FileRegistry;
pub(crate) use registry::find;
pub use relocate::NameOfFile;
pub use spectrum::SpectrumValue;

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use crate::diagnostic::{Location, words};

/// A whole scene.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// The root object, of kind [`PluginKind::Scene`].
    pub root: Arc<ObjectDescription>,
    /// Every parameter (`<default>` or override) with the value it had, by name.
    pub parameters: Vec<(String, String)>,
    /// Folders in which files are looked for besides that of the file that names them, in this order.
    pub folders: Vec<PathBuf>,
}

/// Identity of an object within its scene description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub(crate) usize);

/// A plugin with its parameters and the objects nested in it.
#[derive(Clone, Debug)]
pub struct ObjectDescription {
    /// Identity: equal for two references to the same object.
    pub number: ObjectId,
    /// What it is: a shape, an emitter, ...
    pub kind: PluginKind,
    /// Which one: the `type`, such as `sphere`. Empty for the scene.
    pub plugin: String,
    /// The name by which references find it.
    pub id: Option<String>,
    /// Parameters in the order in which they were written; names are unique.
    pub properties: Vec<Property>,
    /// Nested and referenced objects in the order in which they were written.
    pub children: Vec<Child>,
    /// Where it was written: its tag.
    pub location: Location,
    /// Where its `type` was written.
    pub plugin_location: Location,
}

impl ObjectDescription {
    /// How messages call it, for example `<shape type="sphere">`, or `{"type": "sphere"}` in JSON.
    pub fn label(&self) -> String {
        let plugin = (self.kind != PluginKind::Scene).then_some(self.plugin.as_str());
        words::object(self.kind.tag(), plugin, &self.location)
    }
}

/// Objects and all that they contain, each once, however many references there are.
pub(crate) fn descendants<'a>(
    roots: impl IntoIterator<Item = &'a ObjectDescription>,
) -> impl Iterator<Item = &'a ObjectDescription> {
    let mut seen = HashSet::new();
    let mut open: Vec<&ObjectDescription> = roots.into_iter().collect();
    open.reverse();
    std::iter::from_fn(move || {
        let object = std::iter::from_fn(|| open.pop()).find(|o| seen.insert(o.number))?;
        open.extend(object.children.iter().rev().map(|c| &*c.object));
        Some(object)
    })
}

/// A named parameter.
#[derive(Clone, Debug)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Value,
    /// Where its name was written.
    pub name_location: Location,
    /// Where its value was written.
    pub location: Location,
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A finite number.
    Float(f64),
    /// A whole number.
    Integer(i64),
    /// True or false.
    Boolean(bool),
    /// Text.
    String(String),
    /// A spectrum or colour.
    Spectrum(SpectrumValue),
    /// A position.
    Point(DVec3),
    /// A direction or displacement.
    Vector(DVec3),
    /// An affine or projective map, acting on column vectors.
    Transform(DMat4),
    /// Numbers that stand in for a file.
    Tensor(Arc<Tensor>),
}

impl Value {
    /// The tag that such a value is written with, for example `float`.
    pub(crate) fn type_name(&self) -> &'static str {
        match self {
            Value::Float(_) => "float",
            Value::Integer(_) => "integer",
            Value::Boolean(_) => "boolean",
            Value::String(_) => "string",
            Value::Spectrum(SpectrumValue::Rgb(_)) => "rgb",
            Value::Spectrum(_) => "spectrum",
            Value::Point(_) => "point",
            Value::Vector(_) => "vector",
            Value::Transform(_) => "transform",
            Value::Tensor(_) => "array",
        }
    }
}

/// An object in the role it plays in its parent.
#[derive(Clone, Debug)]
pub struct Child {
    /// The role, such as `interior`; `None` if the kind says it all.
    pub name: Option<String>,
    /// The object, shared with every other reference to it.
    pub object: Arc<ObjectDescription>,
    /// Where it is nested or referenced.
    pub location: Location,
}
