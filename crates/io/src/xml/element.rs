//! XML elements with their locations, after parameters are substituted in their attributes.

use std::ops::Range;
use std::sync::Arc;

use roxmltree::Node;

use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile, suggest};
use crate::draft::Parameters;

/// An element.
pub(super) struct Element {
    /// Tag.
    pub(super) tag: String,
    /// Place of the tag.
    pub(super) location: Location,
    /// True if a substitution in the element failed. Its values are then meaningless.
    pub(super) broken: bool,
    attributes: Vec<Attribute>,
}

/// An attribute.
pub(super) struct Attribute {
    pub(super) name: String,
    /// Value after substitution.
    pub(super) value: String,
    pub(super) name_location: Location,
    /// Place of the value.
    pub(super) location: Location,
}

impl Attribute {
    /// Returns the place of a part of the value. If the value was substituted or escaped, returns
    /// the place of the whole value.
    pub(super) fn part(&self, range: Range<usize>) -> Location {
        if self.location.text() != self.value {
            return self.location.clone();
        }
        let start = self.location.span().0 + range.start;
        Location::new(self.location.source(), start, range.len())
    }
}

impl Element {
    /// Reads an element. Reports each failed substitution and leaves its text unchanged.
    pub(super) fn new(
        node: Node<'_, '_>,
        source: &Arc<SourceFile>,
        parameters: &mut Parameters,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let (mut attributes, mut broken) = (Vec::new(), false);
        for attribute in node.attributes() {
            let raw = attribute.value();
            let location = locate(source, attribute.range_value());
            let value = match parameters.substitute(raw, diagnostics) {
                Ok(value) => value.into_owned(),
                Err(failure) => {
                    broken = true;
                    let start = location.span().0 + failure.range.start;
                    let at = Location::new(source, start, failure.range.len());
                    parameters.report(failure, &at, diagnostics);
                    raw.to_owned()
                }
            };
            attributes.push(Attribute {
                name: attribute.name().to_owned(),
                value,
                name_location: locate(source, attribute.range_qname()),
                location,
            });
        }
        let tag = node.tag_name().name().to_owned();
        // The tag follows '<'.
        let location = Location::new(source, node.range().start + 1, tag.len());
        Element {
            tag,
            location,
            broken,
            attributes,
        }
    }

    /// Returns an attribute, if it is present.
    pub(super) fn get(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// Returns a required attribute; reports an error if it is missing.
    pub(super) fn require(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&Attribute> {
        let found = self.get(name);
        if found.is_none() {
            let message = format!("<{}> needs the attribute '{name}'", self.tag);
            let help = self
                .attributes
                .iter()
                .find_map(|a| suggest(&a.name, [name]));
            diagnostics.push(Diagnostic::error(message).help(help).at(&self.location));
        }
        found
    }

    /// Reports every attribute that is not in `known`.
    pub(super) fn allow(&self, known: &[&str], diagnostics: &mut Diagnostics) {
        for attribute in self
            .attributes
            .iter()
            .filter(|a| !known.contains(&a.name.as_str()))
        {
            let message = format!("<{}> has no attribute '{}'", self.tag, attribute.name);
            let help = suggest(&attribute.name, known.iter().copied())
                .unwrap_or_else(|| format!("it takes: {}", known.join(", ")));
            diagnostics.push(
                Diagnostic::error(message)
                    .help(help)
                    .at(&attribute.name_location),
            );
        }
    }
}

fn locate(source: &Arc<SourceFile>, range: Range<usize>) -> Location {
    Location::new(source, range.start, range.len())
}

/// Returns child elements; reports text between them.
pub(super) fn children<'a, 'i>(
    node: Node<'a, 'i>,
    source: &Arc<SourceFile>,
    diagnostics: &mut Diagnostics,
) -> Vec<Node<'a, 'i>> {
    for text in node.children().filter(|n| n.is_text()) {
        let content = text.text().unwrap_or("");
        let trimmed = content.trim();
        if !trimmed.is_empty() {
            let start = text.range().start + content.len() - content.trim_start().len();
            let length = trimmed.lines().next().unwrap_or("").len();
            let message = "text between elements has no meaning: remove it";
            diagnostics.push(Diagnostic::error(message).at(&locate(source, start..start + length)));
        }
    }
    node.children().filter(Node::is_element).collect()
}
