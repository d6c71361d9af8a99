//! Writing scene descriptions as XML of Mitsuba 3.

use crate::scene::{
    Child, ObjectDescription, ObjectId, Property, SceneDescription, SpectrumValue, Value,
};
use crate::schema::{self, Type};
use std::collections::HashSet;
use std::fmt::Display;

/// An array that replaces a file; XML has no element for it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("XML cannot hold an array as '{parameter}' of {object}")]
pub struct ArrayInXml {
    /// Object that has the array, for example `{"type": "gridvolume"}`.
    pub object: String,
    /// Name of the parameter.
    pub parameter: String,
}

/// Converts a scene to XML. The XML reads as an equal scene with an equal hash. Roles of the
/// scene's own children, which have no effect, are left out. Names of data files do not change:
/// [`SceneDescription::relocated`] adapts them to another folder.
///
/// # Errors
/// Returns an error if an array replaces a file.
pub fn write(scene: &SceneDescription) -> Result<String, ArrayInXml> {
    let children = &scene.root.children;
    let mut writer = Writer {
        out: String::from("<scene version=\"3.0.0\">\n"),
        top: children.iter().map(|child| child.object.number).collect(),
        written: HashSet::new(),
    };
    writer.properties(&scene.root, 1)?;
    for child in children {
        if writer.written.insert(child.object.number) {
            writer.object(None, &child.object, 1)?;
        } else {
            writer.reference(None, &child.object, 1);
        }
    }
    writer.out.push_str("</scene>\n");
    Ok(writer.out)
}

struct Writer {
    out: String,
    /// Children of the scene itself. Other objects refer to them.
    top: HashSet<ObjectId>,
    written: HashSet<ObjectId>,
}

impl Writer {
    fn object(
        &mut self,
        role: Option<&str>,
        object: &ObjectDescription,
        depth: usize,
    ) -> Result<(), ArrayInXml> {
        let tag = object.kind.tag();
        let mut attributes = vec![("type", object.plugin.as_str())];
        attributes.extend(object.id.as_deref().map(|id| ("id", id)));
        attributes.extend(role.map(|role| ("name", role)));
        if object.properties.is_empty() && object.children.is_empty() {
            self.empty(tag, &attributes, depth);
            return Ok(());
        }
        self.open(tag, &attributes, depth);
        self.properties(object, depth + 1)?;
        for child in &object.children {
            self.child(child, depth + 1)?;
        }
        self.close(tag, depth);
        Ok(())
    }

    fn child(&mut self, child: &Child, depth: usize) -> Result<(), ArrayInXml> {
        let (role, object) = (child.name.as_deref(), &*child.object);
        let above = self.top.contains(&object.number);
        let again = above || !self.written.insert(object.number);
        if again && object.id.is_some() {
            self.reference(role, object, depth);
            Ok(())
        } else {
            self.object(role, object, depth)
        }
    }

    fn reference(&mut self, role: Option<&str>, object: &ObjectDescription, depth: usize) {
        let id = object.id.as_deref().unwrap_or_default();
        let mut attributes = vec![("id", id)];
        attributes.extend(role.map(|role| ("name", role)));
        self.empty("ref", &attributes, depth);
    }

    fn properties(&mut self, object: &ObjectDescription, depth: usize) -> Result<(), ArrayInXml> {
        let mut properties = object.properties.iter();
        properties.try_for_each(|property| self.property(object, property, depth))
    }

    fn property(
        &mut self,
        object: &ObjectDescription,
        property: &Property,
        depth: usize,
    ) -> Result<(), ArrayInXml> {
        let name = property.name.as_str();
        match &property.value {
            Value::Float(v) => self.value("float", name, &number(*v), depth),
            Value::Integer(v) if is_real(object, name) => {
                self.value("float", name, &v.to_string(), depth)
            }
            Value::Integer(v) => self.value("integer", name, &v.to_string(), depth),
            Value::Boolean(v) => self.value("boolean", name, &v.to_string(), depth),
            Value::String(v) => self.value("string", name, v, depth),
            Value::Spectrum(spectrum) => self.spectrum(name, spectrum, depth),
            Value::Point(v) => self.value("point", name, &list(v.to_array()), depth),
            Value::Vector(v) => self.value("vector", name, &list(v.to_array()), depth),
            Value::Transform(matrix) => {
                let rows = matrix.transpose().to_cols_array();
                let rows = rows.map(number).join(" ");
                self.open("transform", &[("name", name)], depth);
                self.empty("matrix", &[("value", &rows)], depth + 1);
                self.close("transform", depth);
            }
            Value::Tensor(_) => {
                return Err(ArrayInXml {
                    object: object.label(),
                    parameter: name.to_owned(),
                });
            }
        }
        Ok(())
    }

    fn spectrum(&mut self, name: &str, spectrum: &SpectrumValue, depth: usize) {
        match spectrum {
            SpectrumValue::Uniform(v) => self.value("float", name, &number(*v), depth),
            SpectrumValue::EqualEnergy(v) => self.value("spectrum", name, &number(*v), depth),
            SpectrumValue::Rgb(rgb) => self.value("rgb", name, &list(*rgb), depth),
            SpectrumValue::Sampled(pairs) => {
                let pairs = pairs
                    .iter()
                    .map(|(w, v)| format!("{}:{}", number(*w), number(*v)));
                self.value("spectrum", name, &joined(pairs), depth);
            }
            SpectrumValue::File(file) => {
                self.empty("spectrum", &[("name", name), ("filename", file)], depth);
            }
            SpectrumValue::D65(scale) => self.computed(name, "d65", &[("scale", *scale)], depth),
            SpectrumValue::Blackbody {
                temperature,
                scale,
                range: [min, max],
            } => {
                let parameters = [
                    ("temperature", *temperature),
                    ("scale", *scale),
                    ("wavelength_min", *min),
                    ("wavelength_max", *max),
                ];
                self.computed(name, "blackbody", &parameters, depth);
            }
        }
    }

    /// Writes a spectrum that a plugin computes.
    fn computed(&mut self, name: &str, plugin: &str, parameters: &[(&str, f64)], depth: usize) {
        self.open("spectrum", &[("type", plugin), ("name", name)], depth);
        for (name, v) in parameters {
            self.value("float", name, &number(*v), depth + 1);
        }
        self.close("spectrum", depth);
    }

    fn value(&mut self, tag: &str, name: &str, value: &str, depth: usize) {
        self.empty(tag, &[("name", name), ("value", value)], depth);
    }

    fn empty(&mut self, tag: &str, attributes: &[(&str, &str)], depth: usize) {
        self.start(tag, attributes, depth);
        self.out.push_str("/>\n");
    }

    fn open(&mut self, tag: &str, attributes: &[(&str, &str)], depth: usize) {
        self.start(tag, attributes, depth);
        self.out.push_str(">\n");
    }

    fn close(&mut self, tag: &str, depth: usize) {
        self.indent(depth);
        self.out.push_str(&format!("</{tag}>\n"));
    }

    fn start(&mut self, tag: &str, attributes: &[(&str, &str)], depth: usize) {
        self.indent(depth);
        self.out.push_str(&format!("<{tag}"));
        for (name, value) in attributes {
            self.out
                .push_str(&format!(" {name}=\"{}\"", escaped(value)));
        }
    }

    fn indent(&mut self, depth: usize) {
        self.out.push_str(&"    ".repeat(depth));
    }
}

/// Returns true if a whole number is the value of a real parameter. Mitsuba distinguishes the two
/// types.
fn is_real(object: &ObjectDescription, name: &str) -> bool {
    let plugin = schema::find(object.kind, &object.plugin);
    let parameter = plugin.and_then(|plugin| plugin.parameter(name));
    parameter.is_some_and(|p| p.value != Type::Integer)
}

/// Escapes text for an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\r' | '\t' => out.push_str(&format!("&#{};", c as u32)),
            c => out.push(c),
        }
    }
    out
}

/// Returns the shortest text that reads as the same number.
fn number(v: f64) -> String {
    format!("{v:?}").trim_end_matches(".0").to_owned()
}

fn list<const N: usize>(values: [f64; N]) -> String {
    joined(values.map(number))
}

fn joined(items: impl IntoIterator<Item = impl Display>) -> String {
    let items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    items.join(", ")
}
