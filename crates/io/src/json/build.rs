//! Scenes that a program builds without any text.

use super::tree::{Entry, Json, Node};
use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile};
use crate::scene::Tensor;
use std::sync::Arc;

/// Largest number of elements of an array that is read as a list, such as a point or a matrix.
const MAX_LIST_LENGTH: usize = 16;

/// A value: one that JSON has, or an array of numbers.
#[derive(Clone, Debug)]
pub enum Item {
    /// Nothing.
    Null,
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Float(f64),
    /// A text.
    String(String),
    /// A list.
    Array(Vec<Item>),
    /// Dictionary with unique keys, in the given order.
    Object(Vec<(String, Item)>),
    /// An array of numbers.
    Tensor(Arc<Tensor>),
}

/// Makes the tree of a scene. Places of values are Python expressions such as
/// `scene["ball"]["radius"]`.
pub(super) fn tree(scene: Item, diagnostics: &mut Diagnostics) -> Node {
    tree_at(scene, "scene".into(), diagnostics)
}

/// Makes the tree of a value. Places in it begin with `place`.
pub(super) fn tree_at(scene: Item, place: String, diagnostics: &mut Diagnostics) -> Node {
    let mut places = Vec::new();
    list_places(&scene, place, &mut places);
    let source = SourceFile::places(&places);
    let mut builder = Builder {
        starts: places
            .iter()
            .scan(0, |end, place| {
                let start = *end;
                *end += place.len() + 1;
                Some((start, place.len()))
            })
            .collect::<Vec<_>>()
            .into_iter(),
        source: &source,
        diagnostics,
    };
    builder.node(scene)
}

/// Lists the places of values in the order in which [`Builder::node`] visits the values.
fn list_places(item: &Item, place: String, places: &mut Vec<String>) {
    places.push(place.clone());
    match item {
        Item::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                list_places(item, format!("{place}[{i}]"), places);
            }
        }
        Item::Object(entries) => {
            for (key, item) in entries {
                list_places(item, format!("{place}[{key:?}]"), places);
            }
        }
        _ => {}
    }
}

struct Builder<'s, 'd, I> {
    starts: I,
    source: &'s Arc<SourceFile>,
    diagnostics: &'d mut Diagnostics,
}

impl<I: Iterator<Item = (usize, usize)>> Builder<'_, '_, I> {
    fn node(&mut self, item: Item) -> Node {
        let (start, length) = self.starts.next().unwrap_or_default();
        let location = Location::new(self.source, start, length);
        let json = match item {
            Item::Null => Json::Null,
            Item::Boolean(v) => Json::Boolean(v),
            Item::Integer(v) => Json::Integer(v),
            Item::Float(v) => self.number(v, &location),
            Item::String(v) => Json::String(v),
            Item::Array(items) => Json::Array(items.into_iter().map(|i| self.node(i)).collect()),
            Item::Object(entries) => Json::Object(
                entries
                    .into_iter()
                    .map(|(key, item)| self.entry(key, item))
                    .collect(),
            ),
            Item::Tensor(tensor) if tensor.len() <= MAX_LIST_LENGTH && !tensor.is_complex() => {
                let mut numbers = tensor.iter();
                return self.nested(tensor.shape(), &mut numbers, &location);
            }
            Item::Tensor(tensor) => Json::Tensor(tensor),
        };
        Node { json, location }
    }

    fn entry(&mut self, key: String, item: Item) -> Entry {
        let node = self.node(item);
        Entry {
            key,
            key_location: node.location.clone(),
            node,
        }
    }

    fn nested(
        &mut self,
        shape: &[usize],
        numbers: &mut impl Iterator<Item = f64>,
        location: &Location,
    ) -> Node {
        let json = match shape {
            [] => self.number(numbers.next().unwrap_or_default(), location),
            [count, rest @ ..] => Json::Array(
                (0..*count)
                    .map(|_| self.nested(rest, numbers, location))
                    .collect(),
            ),
        };
        Node {
            json,
            location: location.clone(),
        }
    }

    fn number(&mut self, v: f64, location: &Location) -> Json {
        match v {
            v if !v.is_finite() => {
                let message = format!("{v} is not a finite number");
                self.diagnostics
                    .push(Diagnostic::error(message).at(location));
                Json::Broken
            }
            // JSON does not distinguish whole numbers from others.
            v if v as i64 as f64 == v => Json::Integer(v as i64),
            v => Json::Float(v),
        }
    }
}
