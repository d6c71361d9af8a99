//! Scene descriptions: trees of plugins with parameters, as written in a file.
//!
//! A description does not interpret plugins. References are resolved: an object with two references
//! is a single [`ObjectDescription`], with one [`ObjectId`], in both places.

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
    /// Root object, of kind [`PluginKind::Scene`].
    pub root: Arc<ObjectDescription>,
    /// Every parameter (`<default>` or override) with its value, by name.
    pub parameters: Vec<(String, String)>,
    /// Folders that are searched, in this order, besides the folder of the file that names a file.
    pub folders: Vec<PathBuf>,
}

/// Identity of an object within its scene description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub(crate) usize);

/// A plugin with its parameters and the objects nested in it.
#[derive(Clone, Debug)]
pub struct ObjectDescription {
    /// Identity; equal for two references to one object.
    pub number: ObjectId,
    /// Kind of the object: a shape, an emitter, ...
    pub kind: PluginKind,
    /// Name of the plugin: the `type`, such as `sphere`. Empty for the scene.
    pub plugin: String,
    /// Name by which references find the object.
    pub id: Option<String>,
    /// Parameters in their order in the file; names are unique.
    pub properties: Vec<Property>,
    /// Nested and referenced objects in their order in the file.
    pub children: Vec<Child>,
    /// Place of the object: its tag.
    pub location: Location,
    /// Position of the object's `type` in the source.
    pub plugin_location: Location,
}

impl ObjectDescription {
    /// Returns the object's name in messages, for example `<shape type="sphere">`, or
    /// `{"type": "sphere"}` in JSON.
    pub fn label(&self) -> String {
        let plugin = (self.kind != PluginKind::Scene).then_some(self.plugin.as_str());
        words::object(self.kind.tag(), plugin, &self.location)
    }
}

/// Returns objects and all objects in them, each once, however many references it has.
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
    /// Name.
    pub name: String,
    /// Value.
    pub value: Value,
    /// Position of the name in the source.
    pub name_location: Location,
    /// Position of the value in the source.
    pub location: Location,
}

/// Value of a parameter.
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
    /// An array of numbers that replaces a file.
    Tensor(Arc<Tensor>),
}

impl Value {
    /// Returns the tag with which this type of value is written, for example `float`.
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

/// An object with its role in its parent.
#[derive(Clone, Debug)]
pub struct Child {
    /// Role, such as `interior`; `None` if the kind is enough.
    pub name: Option<String>,
    /// Object, shared with every other reference to it.
    pub object: Arc<ObjectDescription>,
    /// Place where the object is nested or referenced.
    pub location: Location,
}
