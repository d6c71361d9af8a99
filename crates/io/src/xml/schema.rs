//! XML Schema of scenes, made from the table of plugins, for editors.

use super::tags::TRANSFORMS;
use super::write::escaped;
use crate::scene::PluginKind;
use crate::schema::{Parameter, Plugin, plugins};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Elements that hold a value, with the attributes that each may have besides `name`.
const VALUES: [(&str, &[&str]); 11] = [
    ("float", &["value"]),
    ("integer", &["value"]),
    ("boolean", &["value"]),
    ("string", &["value"]),
    ("rgb", &["value"]),
    ("srgb", &["value"]),
    ("point", &["value", "x", "y", "z"]),
    ("vector", &["value", "x", "y", "z"]),
    ("blackbody", &["temperature", "scale"]),
    ("spectrum", &["value", "filename", "type", "id"]),
    ("transform", &[]),
];

/// Elements that refer to objects or files, or define parameters, folders and animations; with
/// their attributes.
const OTHERS: [(&str, &[&str]); 6] = [
    ("ref", &["name", "id"]),
    ("alias", &["id", "as"]),
    ("default", &["name", "value"]),
    ("include", &["filename"]),
    ("path", &["value"]),
    ("animation", &["name"]),
];

/// Returns an XML Schema (1.0) of scenes in XML, with the names of Mitsuba 3. It lists the types
/// and the parameters of each kind of object, but not which type has which parameters. Only the
/// texts that explain parameters state limits.
pub fn xml_schema() -> String {
    let mut schema = String::from(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">\n\
         <xs:element name=\"scene\" type=\"scene\"/>\n\
         <xs:simpleType name=\"substituted\"><xs:restriction base=\"xs:string\"><xs:pattern value=\".*\\$.*\"/></xs:restriction></xs:simpleType>\n",
    );
    schema.push_str(&transforms());
    for kind in PluginKind::ALL {
        if kind != PluginKind::Scene {
            schema.push_str(&types(kind));
            schema.push_str(&names(kind));
        }
        schema.push_str(&object(kind));
    }
    schema.push_str("</xs:schema>\n");
    schema
}

/// Returns the definition of a transform's elements.
fn transforms() -> String {
    let attributes = ["value", "x", "y", "z", "angle", "origin", "target", "up"];
    let attributes: String = attributes.into_iter().map(attribute).collect();
    let elements = TRANSFORMS
        .into_iter()
        .map(|tag| format!("<xs:element name=\"{tag}\" type=\"step\"/>"));
    format!(
        "<xs:complexType name=\"step\">{attributes}</xs:complexType>\n\
         <xs:group name=\"steps\"><xs:choice>{}</xs:choice></xs:group>\n",
        elements.collect::<String>()
    )
}

/// Returns the types of a kind, each with its help.
fn types(kind: PluginKind) -> String {
    let types = plugins(kind).iter();
    let types = types.map(|plugin| value(plugin.name, plugin.help));
    choice_of_words(&format!("{kind}.type"), &types.collect::<String>(), false)
}

/// Returns the names of a kind's parameters and roles. Each has its help and the types that have
/// it.
fn names(kind: PluginKind) -> String {
    let mut known: BTreeMap<&str, String> = BTreeMap::new();
    let all = plugins(kind).iter();
    for (plugin, parameter) in all.flat_map(|p| p.parameters().map(move |parameter| (p, parameter)))
    {
        let help = known.entry(parameter.name).or_default();
        let separator = if help.is_empty() { "" } else { "\n" };
        let _ = write!(help, "{separator}{}", described(plugin, parameter));
    }
    for slot in plugins(kind).iter().flat_map(Plugin::children) {
        if let Some(role) = slot.role {
            known.entry(role).or_insert_with(|| slot.help.to_owned());
        }
    }
    let is_open = plugins(kind).iter().any(|plugin| plugin.others().is_some());
    let names = known.iter().map(|(name, help)| value(name, help));
    choice_of_words(&format!("{kind}.name"), &names.collect::<String>(), is_open)
}

fn described(plugin: &Plugin, parameter: &Parameter) -> String {
    let default = match (parameter.is_required(), parameter.default.json()) {
        (true, _) => "; required".into(),
        (false, Some(default)) => format!("; default: {default}"),
        (false, None) => String::new(),
    };
    format!("{}: {}{default}", plugin.name, parameter.description())
}

/// Defines a choice of words, or of a text with a scene parameter; if `is_open`, any text.
fn choice_of_words(name: &str, words: &str, is_open: bool) -> String {
    let other = if is_open { "xs:string" } else { "substituted" };
    format!(
        "<xs:simpleType name=\"{name}.word\"><xs:restriction base=\"xs:string\">\n{words}</xs:restriction></xs:simpleType>\n\
         <xs:simpleType name=\"{name}\"><xs:union memberTypes=\"{name}.word {other}\"/></xs:simpleType>\n"
    )
}

fn value(word: &str, help: &str) -> String {
    format!(
        "<xs:enumeration value=\"{}\"><xs:annotation><xs:documentation>{}</xs:documentation></xs:annotation></xs:enumeration>\n",
        escaped(word),
        escaped(help)
    )
}

fn attribute(name: &str) -> String {
    format!("<xs:attribute name=\"{name}\" type=\"xs:string\"/>")
}

/// Defines an object of a kind.
fn object(kind: PluginKind) -> String {
    let mut elements = String::new();
    for other in PluginKind::ALL {
        if !matches!(other, PluginKind::Scene | PluginKind::Spectrum) {
            let _ = writeln!(
                elements,
                "<xs:element name=\"{0}\" type=\"{0}\"/>",
                other.tag()
            );
        }
    }
    let name = match kind {
        PluginKind::Scene => "xs:string".into(),
        _ => format!("{kind}.name"),
    };
    for (tag, attributes) in VALUES {
        let attributes: String = attributes.iter().map(|name| attribute(name)).collect();
        let steps = match tag {
            "transform" => "<xs:group ref=\"steps\" minOccurs=\"0\" maxOccurs=\"unbounded\"/>",
            "spectrum" => {
                "<xs:any processContents=\"skip\" minOccurs=\"0\" maxOccurs=\"unbounded\"/>"
            }
            _ => "",
        };
        let _ = writeln!(
            elements,
            "<xs:element name=\"{tag}\"><xs:complexType><xs:sequence>{steps}</xs:sequence><xs:attribute name=\"name\" type=\"{name}\"/>{attributes}</xs:complexType></xs:element>"
        );
    }
    for (tag, attributes) in OTHERS {
        let attributes: String = attributes.iter().map(|name| attribute(name)).collect();
        let _ = writeln!(
            elements,
            "<xs:element name=\"{tag}\"><xs:complexType>{attributes}</xs:complexType></xs:element>"
        );
    }
    let attributes = match kind {
        PluginKind::Scene => attribute("version"),
        _ => format!(
            "<xs:attribute name=\"type\" type=\"{kind}.type\" use=\"required\"/>{}{}",
            attribute("id"),
            attribute("name")
        ),
    };
    format!(
        "<xs:complexType name=\"{}\"><xs:choice minOccurs=\"0\" maxOccurs=\"unbounded\">\n{elements}</xs:choice>{attributes}</xs:complexType>\n",
        kind.tag()
    )
}
