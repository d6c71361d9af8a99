//! Numbers in attributes.

use std::ops::Range;

use super::element::Attribute;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::draft::shorten;

/// Reads a finite number.
pub(super) fn float(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<f64> {
    let [value] = floats(attribute, diagnostics)?[..] else {
        report(attribute, "expected one number", diagnostics);
        return None;
    };
    Some(value)
}

/// Reads finite numbers separated by commas or blanks.
pub(super) fn floats(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<Vec<f64>> {
    let mut values = Vec::new();
    for range in tokens(&attribute.value) {
        values.push(token(attribute, range, diagnostics)?);
    }
    Some(values)
}

/// Reads the number at `range` of the attribute.
pub(super) fn token(
    attribute: &Attribute,
    range: Range<usize>,
    diagnostics: &mut Diagnostics,
) -> Option<f64> {
    let text = &attribute.value[range.clone()];
    let message = match text.parse::<f64>() {
        Ok(value) if value.is_finite() => return Some(value),
        Ok(_) => format!("'{}' is not a finite number", shorten(text)),
        Err(_) => format!("'{}' is not a number", shorten(text)),
    };
    diagnostics.push(Diagnostic::error(message).at(&attribute.part(range)));
    None
}

/// Reads a whole number.
pub(super) fn integer(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<i64> {
    let value = attribute.value.trim().parse();
    if value.is_err() {
        let message = format!("'{}' is not a whole number", shorten(&attribute.value));
        report(attribute, &message, diagnostics);
    }
    value.ok()
}

/// Reads `true` or `false`.
pub(super) fn boolean(attribute: &Attribute, diagnostics: &mut Diagnostics) -> Option<bool> {
    match attribute.value.trim() {
        "true" | "True" => Some(true),
        "false" | "False" => Some(false),
        other => {
            let message = format!("expected 'true' or 'false', found '{}'", shorten(other));
            report(attribute, &message, diagnostics);
            None
        }
    }
}

/// Reports `message` at the attribute's value.
pub(super) fn report(attribute: &Attribute, message: &str, diagnostics: &mut Diagnostics) {
    diagnostics.push(Diagnostic::error(message).at(&attribute.location));
}

/// Returns the ranges of the parts between commas and blanks.
pub(super) fn tokens(text: &str) -> Vec<Range<usize>> {
    let is_separator = |c: char| c == ',' || c.is_whitespace();
    let mut ranges = Vec::new();
    let mut start = None;
    for (i, c) in text.char_indices() {
        match (is_separator(c), start) {
            (true, Some(from)) => {
                ranges.push(from..i);
                start = None;
            }
            (false, None) => start = Some(i),
            _ => {}
        }
    }
    ranges.extend(start.map(|from| from..text.len()));
    ranges
}
