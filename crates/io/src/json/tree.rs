//! JSON as a tree that records the place of each value.

use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile};
use crate::draft::shorten;
use crate::scene::Tensor;
use jsonc_parser::ast::{self, ObjectPropName};
use jsonc_parser::common::{Range, Ranged};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use std::collections::HashMap;
use std::sync::Arc;

/// A value and its place.
#[derive(Clone)]
pub(super) struct Node {
    pub json: Json,
    pub location: Location,
}

/// A value.
#[derive(Clone)]
pub(super) enum Json {
    /// A wrong value that has been reported.
    Broken,
    Null,
    Boolean(bool),
    /// A number without a fraction, in any notation: JSON has a single type of numbers.
    Integer(i64),
    Float(f64),
    String(String),
    Array(Vec<Node>),
    Object(Vec<Entry>),
    /// An array of numbers that a program hands over.
    Tensor(Arc<Tensor>),
}

/// A named value in an object.
#[derive(Clone)]
pub(super) struct Entry {
    pub key: String,
    pub key_location: Location,
    pub node: Node,
}

impl Json {
    /// Returns the name of the value's type, for messages.
    pub(super) fn describe(&self) -> &'static str {
        match self {
            Json::Broken | Json::Null => "null",
            Json::Boolean(_) => "true or false",
            Json::Integer(_) | Json::Float(_) => "a number",
            Json::String(_) => "a text",
            Json::Array(_) | Json::Tensor(_) => "an array",
            Json::Object(_) => "an object",
        }
    }
}

impl Node {
    /// Returns the number, if the value is a number.
    pub(super) fn number(&self) -> Option<f64> {
        match self.json {
            Json::Integer(v) => Some(v as f64),
            Json::Float(v) => Some(v),
            _ => None,
        }
    }

    /// Sets the place of the value, and of all values in it.
    pub(super) fn moved(mut self, to: &Location) -> Self {
        self.location = to.clone();
        match &mut self.json {
            Json::Array(items) => {
                *items = items.drain(..).map(|item| item.moved(to)).collect();
            }
            Json::Object(entries) => {
                for entry in entries {
                    entry.key_location = to.clone();
                    entry.node = entry.node.clone().moved(to);
                }
            }
            _ => {}
        }
        self
    }
}

/// Options for RFC 8259 without extensions: no comments, no trailing commas.
const STRICT: ParseOptions = ParseOptions {
    allow_comments: false,
    allow_loose_object_property_names: false,
    allow_trailing_commas: false,
    allow_missing_commas: false,
    allow_single_quoted_strings: false,
    allow_hexadecimal_numbers: false,
    allow_unary_plus_numbers: false,
    allow_bare_decimal_point_numbers: false,
    allow_non_finite_numbers: false,
    allow_extended_string_escapes: false,
};

/// Parses the text of `source`. The parser refuses more than 512 levels of nesting.
pub(super) fn parse(source: &Arc<SourceFile>, diagnostics: &mut Diagnostics) -> Option<Node> {
    let invalid = |message: &str, range: Range| {
        let location = Location::new(source, range.start, range.end - range.start);
        Diagnostic::error(format!("invalid JSON: {message}")).at(&location)
    };
    match parse_to_ast(source.text(), &CollectOptions::default(), &STRICT) {
        Ok(result) => match result.value {
            Some(value) => Some(
                Builder {
                    source,
                    diagnostics,
                }
                .node(value),
            ),
            None => {
                diagnostics.push(invalid("the file is empty", Range::new(0, 0)));
                None
            }
        },
        Err(error) => {
            let message = error.kind().to_string();
            diagnostics.push(invalid(&uncapitalized(&message), error.range()));
            None
        }
    }
}

fn uncapitalized(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters.next().map(|c| c.to_ascii_lowercase());
    first.into_iter().chain(characters).collect()
}

/// Parses a text that contains only a finite number.
pub(super) fn number(text: &str) -> Option<Json> {
    /// Largest magnitude up to which every whole number is a double, 2⁵³.
    const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;
    if let Ok(whole) = text.parse() {
        return Some(Json::Integer(whole));
    }
    match text.parse::<f64>() {
        Ok(v) if v.fract() == 0.0 && v.abs() <= MAX_EXACT_INTEGER => Some(Json::Integer(v as i64)),
        Ok(v) if v.is_finite() => Some(Json::Float(v)),
        _ => None,
    }
}

struct Builder<'s, 'd> {
    source: &'s Arc<SourceFile>,
    diagnostics: &'d mut Diagnostics,
}

impl Builder<'_, '_> {
    fn place(&self, range: Range) -> Location {
        Location::new(self.source, range.start, range.end - range.start)
    }

    fn node(&mut self, value: ast::Value) -> Node {
        let location = self.place(value.range());
        let json = match value {
            ast::Value::NullKeyword(_) => Json::Null,
            ast::Value::BooleanLit(literal) => Json::Boolean(literal.value),
            ast::Value::NumberLit(literal) => self.number(literal.value, &location),
            ast::Value::StringLit(literal) => Json::String(literal.value.into_owned()),
            ast::Value::Array(array) => {
                let items = array.elements.into_iter();
                Json::Array(items.map(|item| self.node(item)).collect())
            }
            ast::Value::Object(object) => Json::Object(self.entries(object)),
        };
        Node { json, location }
    }

    fn number(&mut self, text: &str, location: &Location) -> Json {
        number(text).unwrap_or_else(|| {
            let message = format!("'{}' is not a finite number", shorten(text));
            self.diagnostics
                .push(Diagnostic::error(message).at(location));
            Json::Broken
        })
    }

    fn entries(&mut self, object: ast::Object) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::with_capacity(object.properties.len());
        let mut seen: HashMap<String, Location> = HashMap::new();
        for property in object.properties {
            let key_location = self.place(property.name.range());
            let key = match property.name {
                ObjectPropName::String(literal) => literal.value.into_owned(),
                ObjectPropName::Word(literal) => literal.value.to_owned(),
            };
            let node = self.node(property.value);
            if let Some(first) = seen.get(&key) {
                let message = format!("the key \"{}\" occurs twice", shorten(&key));
                let help = format!("the first is at {first}");
                let diagnostic = Diagnostic::error(message).help(help);
                self.diagnostics.push(diagnostic.at(&key_location));
                continue;
            }
            seen.insert(key.clone(), key_location.clone());
            entries.push(Entry {
                key,
                key_location,
                node,
            });
        }
        entries
    }
}
