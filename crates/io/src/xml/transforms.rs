//! `<transform>` and the elements in it.

use glam::{DMat4, DVec3};

use super::element::Element;
use super::numbers::{self, report};
use super::properties::{triple, xyz};
use super::tags;
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};
use crate::draft::transforms;

/// Reads an element of a transform.
pub(super) fn part(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    match element.tag.as_str() {
        "translate" => {
            element.allow(&["value", "x", "y", "z"], diagnostics);
            xyz(element, 0.0, diagnostics).map(DMat4::from_translation)
        }
        "scale" => {
            element.allow(&["value", "x", "y", "z"], diagnostics);
            scale(element, diagnostics)
        }
        "rotate" => rotate(element, diagnostics),
        "lookat" | "lookAt" => look_at(element, diagnostics),
        "matrix" => matrix(element, diagnostics),
        other => {
            let message = format!("a transform cannot contain <{other}>");
            let help = suggest(other, tags::TRANSFORMS)
                .unwrap_or_else(|| format!("parts are: {}", tags::TRANSFORMS.join(", ")));
            diagnostics.push(Diagnostic::error(message).help(help).at(&element.location));
            None
        }
    }
}

fn scale(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let factors = xyz(element, 1.0, diagnostics)?;
    accept(transforms::scale(factors), element, diagnostics)
}

fn rotate(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["value", "x", "y", "z", "angle"], diagnostics);
    let axis = xyz(element, 0.0, diagnostics);
    let angle = element.require("angle", diagnostics);
    let angle = angle.and_then(|attribute| numbers::float(attribute, diagnostics));
    let map = transforms::rotate(axis?, angle?, diagnostics);
    accept(map, element, diagnostics)
}

fn look_at(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["origin", "target", "up"], diagnostics);
    let origin = element.require("origin", diagnostics);
    let origin = origin.and_then(|attribute| triple(attribute, diagnostics));
    let target = element.require("target", diagnostics);
    let target = target.and_then(|attribute| triple(attribute, diagnostics));
    let up = match element.get("up") {
        Some(attribute) => triple(attribute, diagnostics)?,
        None => DVec3::ZERO,
    };
    let view = transforms::look_at(origin?, target?, up);
    view.map_err(|message| {
        let diagnostic = Diagnostic::error(message).help(transforms::VIEW.to_owned());
        diagnostics.push(diagnostic.at(&element.location));
    })
    .ok()
}

fn matrix(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["value"], diagnostics);
    let attribute = element.require("value", diagnostics)?;
    let values = numbers::floats(attribute, diagnostics)?;
    transforms::matrix(&values)
        .map_err(|message| report(attribute, &message, diagnostics))
        .ok()
}

/// Reports the reason why a map was refused.
fn accept(
    map: Result<DMat4, String>,
    element: &Element,
    diagnostics: &mut Diagnostics,
) -> Option<DMat4> {
    map.map_err(|message| diagnostics.push(Diagnostic::error(message).at(&element.location)))
        .ok()
}
