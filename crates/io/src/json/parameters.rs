//! Parameters of scene files: `"parameters": {"spp": 64}`, and `"$spp"` in texts.

use super::tree::{self, Entry, Json, Node};
use super::values::report;
use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile};
use crate::draft;
use std::collections::HashMap;

/// Largest number of elements of an array. Repeated often, longer arrays would fill the memory.
const MAX_ELEMENTS: usize = 64;

/// The parameters of a scene file.
pub(super) struct Parameters {
    texts: draft::Parameters,
    /// True for each declared parameter that is a text, by name.
    is_text: HashMap<String, bool>,
}

impl Parameters {
    pub(super) fn new(overrides: &[(String, String)]) -> Self {
        let declaration = |name: &str| format!("\"{name}\": ... to the scene's \"parameters\"");
        Parameters {
            texts: draft::Parameters::new(overrides, declaration),
            is_text: HashMap::new(),
        }
    }

    /// Reads the declared parameters. Later values may refer to earlier parameters.
    pub(super) fn declare(&mut self, node: &mut Node, diagnostics: &mut Diagnostics) {
        let Json::Object(entries) = &mut node.json else {
            let message = format!("expected an object, found {}", node.json.describe());
            return report(node, message, diagnostics);
        };
        for entry in entries {
            self.substitute(&mut entry.node, diagnostics);
            self.add(entry, diagnostics);
        }
    }

    fn add(&mut self, entry: &Entry, diagnostics: &mut Diagnostics) {
        let Some(text) = text(&entry.node) else {
            let message = format!(
                "a parameter is a number, true or false, a text, or an array of up to {MAX_ELEMENTS} of these"
            );
            return report(&entry.node, message, diagnostics);
        };
        let is_text = matches!(entry.node.json, Json::String(_));
        self.is_text.insert(entry.key.clone(), is_text);
        let value = self.texts.declare(&entry.key, &text);
        if !is_text && value.parse::<serde_json::Value>().is_err() {
            let message = format!(
                "-D {}={}: expected a value like {text}",
                entry.key,
                draft::shorten(value)
            );
            diagnostics.push(Diagnostic::error(message).at(&entry.node.location));
        }
    }

    /// Replaces `$name` in all texts of a value. A text that is only `$name` becomes the
    /// parameter's value; in other texts, `$name` becomes the parameter's text. A result such as
    /// `-$name` that reads as a number is a number.
    pub(crate) fn substitute(&mut self, node: &mut Node, diagnostics: &mut Diagnostics) {
        let at = node.location.clone();
        match &mut node.json {
            Json::String(text) if text.contains('$') => {
                node.json = match self.texts.substitute(text, diagnostics) {
                    Ok(new) => match draft::Parameters::whole(text) {
                        Some(name) => self.typed(name, &new, &at),
                        None => {
                            tree::number(&new).unwrap_or_else(|| Json::String(new.into_owned()))
                        }
                    },
                    Err(failure) => {
                        self.texts.report(failure, &at, diagnostics);
                        Json::Broken
                    }
                };
            }
            Json::Array(items) => {
                for item in items {
                    self.substitute(item, diagnostics);
                }
            }
            Json::Object(entries) => {
                for entry in entries {
                    self.substitute(&mut entry.node, diagnostics);
                }
            }
            _ => {}
        }
    }

    /// Returns the value of a parameter. If only the command line gives the parameter, a value that
    /// is not JSON is a text.
    fn typed(&self, name: &str, value: &str, at: &Location) -> Json {
        let is_text = self.is_text.get(name).copied();
        let text = || Json::String(value.to_owned());
        if is_text == Some(true) {
            return text();
        }
        let source = SourceFile::new("", value.to_owned());
        match (tree::parse(&source, &mut Diagnostics::new()), is_text) {
            (Some(node), _) => node.moved(at).json,
            (None, None) => text(),
            // The declaration has reported this error.
            (None, Some(_)) => Json::Broken,
        }
    }

    /// Reports unused overrides; returns names and values.
    pub(super) fn finish(self, diagnostics: &mut Diagnostics) -> Vec<(String, String)> {
        self.texts.report_open(diagnostics);
        self.texts.report_unused(diagnostics);
        self.texts.into_values()
    }
}

/// Converts a text or a plain value, or an array of plain values, to JSON text. Returns `None` for
/// other values.
fn text(node: &Node) -> Option<String> {
    let plain = |node: &Node| match &node.json {
        Json::Boolean(v) => Some(v.to_string()),
        Json::Integer(v) => Some(v.to_string()),
        Json::Float(v) => Some(format!("{v:?}")),
        Json::String(v) => Some(serde_json::Value::from(v.as_str()).to_string()),
        _ => None,
    };
    match &node.json {
        Json::String(v) => Some(v.clone()),
        Json::Array(items) if items.len() <= MAX_ELEMENTS => {
            let items: Option<Vec<String>> = items.iter().map(plain).collect();
            items.map(|items| format!("[{}]", items.join(", ")))
        }
        _ => plain(node),
    }
}
