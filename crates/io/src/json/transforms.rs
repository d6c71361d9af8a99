//! Transforms: the rows of a matrix, or parts that act in their order.

use super::tree::{Entry, Json, Node};
use super::values::{get, number, only, report, triple};
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};
use crate::draft::transforms;
use crate::scene::Value;
use glam::{DMat4, DVec3};

const PARTS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Multiplies parts such as `[{"scale": 2}, {"translate": [0, 0, 1]}]`.
pub(super) fn parts(items: &[Node], node: &Node, diagnostics: &mut Diagnostics) -> Option<Value> {
    let mut matrix = DMat4::IDENTITY;
    for item in items {
        matrix = part(item, diagnostics)? * matrix;
    }
    if !matrix.is_finite() {
        report(node, "the transform is not finite", diagnostics);
        return None;
    }
    Some(Value::Transform(matrix))
}

fn part(item: &Node, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let entry = match &item.json {
        Json::Object(entries) if entries.len() == 1 => &entries[0],
        _ => {
            let message = format!("expected one part of a transform: {}", PARTS.join(", "));
            report(item, message, diagnostics);
            return None;
        }
    };
    let value = &entry.node;
    let map = match entry.key.as_str() {
        "translate" => Ok(DMat4::from_translation(triple(value, diagnostics)?)),
        "scale" => transforms::scale(match value.number() {
            Some(factor) => DVec3::splat(factor),
            None => triple(value, diagnostics)?,
        }),
        "rotate" => rotate(value, diagnostics)?,
        "lookat" => look_at(value, diagnostics)?,
        "matrix" => return matrix(value, diagnostics),
        _ => return unknown(entry, diagnostics),
    };
    map.map_err(|message| report(value, message, diagnostics))
        .ok()
}

fn unknown(entry: &Entry, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let message = format!("a transform cannot contain \"{}\"", entry.key);
    let help =
        suggest(&entry.key, PARTS).unwrap_or_else(|| format!("parts are: {}", PARTS.join(", ")));
    let diagnostic = Diagnostic::error(message).help(help);
    diagnostics.push(diagnostic.at(&entry.key_location));
    None
}

fn rotate(value: &Node, diagnostics: &mut Diagnostics) -> Option<Result<DMat4, String>> {
    let entries = fields(value, &["axis", "angle"], diagnostics)?;
    let axis = triple(required(value, entries, "axis", diagnostics)?, diagnostics)?;
    let angle = number(required(value, entries, "angle", diagnostics)?, diagnostics)?;
    Some(transforms::rotate(axis, angle, diagnostics))
}

fn look_at(value: &Node, diagnostics: &mut Diagnostics) -> Option<Result<DMat4, String>> {
    let entries = fields(value, &["origin", "target", "up"], diagnostics)?;
    let origin = triple(
        required(value, entries, "origin", diagnostics)?,
        diagnostics,
    )?;
    let target = triple(
        required(value, entries, "target", diagnostics)?,
        diagnostics,
    )?;
    let up = match get(entries, "up") {
        Some(up) => triple(up, diagnostics)?,
        None => DVec3::ZERO,
    };
    let view = transforms::look_at(origin, target, up);
    Some(view.map_err(|message| format!("{message}: {}", transforms::VIEW)))
}

fn fields<'n>(
    value: &'n Node,
    known: &[&str],
    diagnostics: &mut Diagnostics,
) -> Option<&'n [Entry]> {
    let Json::Object(entries) = &value.json else {
        let message = format!("expected an object with {}", known.join(", "));
        report(value, message, diagnostics);
        return None;
    };
    only(entries, known, diagnostics);
    Some(entries)
}

fn required<'n>(
    value: &Node,
    entries: &'n [Entry],
    key: &str,
    diagnostics: &mut Diagnostics,
) -> Option<&'n Node> {
    let found = get(entries, key);
    if found.is_none() {
        report(value, format!("\"{key}\" is missing"), diagnostics);
    }
    found
}

/// Reads four rows of four numbers, or three rows of three numbers for a linear map.
pub(super) fn matrix(node: &Node, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let rows = match &node.json {
        Json::Array(rows) if matches!(rows.len(), 3 | 4) => rows,
        _ => return shape(node, diagnostics),
    };
    let mut numbers = Vec::with_capacity(16);
    for row in rows {
        match &row.json {
            Json::Array(items) if items.len() == rows.len() => {
                for item in items {
                    numbers.push(number(item, diagnostics)?);
                }
            }
            _ => return shape(row, diagnostics),
        }
    }
    let matrix = transforms::matrix(&numbers);
    matrix
        .map_err(|message| report(node, message, diagnostics))
        .ok()
}

fn shape(at: &Node, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let message = "expected a matrix: 4 rows of 4 numbers, or 3 rows of 3";
    report(at, message, diagnostics);
    None
}
