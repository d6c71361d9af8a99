//! `<transform>` and the elements in it.

use glam::{DMat3, DMat4, DVec3};

use super::element::Element;
use super::numbers::{self, report};
use super::properties::{triple, xyz};
use super::tags;
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};

/// Reads one element of a transform.
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
        "lookat" | "lookAt" => look_at_element(element, diagnostics),
        "matrix" => matrix(element, diagnostics),
        other => {
            let message = format!("<{other}> is no part of a transform");
            let help = suggest(other, tags::TRANSFORMS)
                .unwrap_or_else(|| format!("parts are: {}", tags::TRANSFORMS.join(", ")));
            diagnostics.push(Diagnostic::error(message).help(help).at(&element.location));
            None
        }
    }
}

fn scale(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    let factors = xyz(element, 1.0, diagnostics)?;
    if factors.min_element() == 0.0 || factors.x * factors.y * factors.z == 0.0 {
        let message = "a scale of zero cannot be undone";
        diagnostics.push(Diagnostic::error(message).at(&element.location));
        return None;
    }
    Some(DMat4::from_scale(factors))
}

fn rotate(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["value", "x", "y", "z", "angle"], diagnostics);
    let axis = xyz(element, 0.0, diagnostics);
    let angle = element.require("angle", diagnostics);
    let angle = angle.and_then(|attribute| numbers::float(attribute, diagnostics));
    let Some(axis) = axis?.try_normalize() else {
        let message = "the axis of a rotation must not be zero";
        diagnostics.push(Diagnostic::error(message).at(&element.location));
        return None;
    };
    Some(DMat4::from_axis_angle(axis, angle?.to_radians()))
}

fn look_at_element(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["origin", "target", "up"], diagnostics);
    let origin = element.require("origin", diagnostics);
    let origin = origin.and_then(|attribute| triple(attribute, diagnostics));
    let target = element.require("target", diagnostics);
    let target = target.and_then(|attribute| triple(attribute, diagnostics));
    let up = match element.get("up") {
        Some(attribute) => triple(attribute, diagnostics)?,
        None => DVec3::ZERO,
    };
    let result = look_at(origin?, target?, up);
    if result.is_none() {
        let message = "'origin', 'target' and 'up' do not define a direction of view";
        let help = "'target' must differ from 'origin', and 'up' must not be parallel to the view";
        let diagnostic = Diagnostic::error(message).help(help.to_owned());
        diagnostics.push(diagnostic.at(&element.location));
    }
    result
}

/// The map from camera to world: the camera looks along +z, with y up and x to the left.
/// An `up` of zero leaves the choice to us.
fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let direction = (target - origin).try_normalize()?;
    let up = if up == DVec3::ZERO {
        direction.any_orthonormal_vector()
    } else {
        up
    };
    let left = up.try_normalize()?.cross(direction);
    // Nearly parallel vectors leave only rounding errors.
    let left = if left.length() < 1e-9 {
        None
    } else {
        left.try_normalize()
    }?;
    let rotation = DMat3::from_cols(left, direction.cross(left), direction);
    Some(DMat4::from_translation(origin) * DMat4::from_mat3(rotation))
}

fn matrix(element: &Element, diagnostics: &mut Diagnostics) -> Option<DMat4> {
    element.allow(&["value"], diagnostics);
    let attribute = element.require("value", diagnostics)?;
    let values = numbers::floats(attribute, diagnostics)?;
    let matrix = if let Ok(rows) = <[f64; 16]>::try_from(values.as_slice()) {
        DMat4::from_cols_array(&rows).transpose()
    } else if let Ok(rows) = <[f64; 9]>::try_from(values.as_slice()) {
        DMat4::from_mat3(DMat3::from_cols_array(&rows).transpose())
    } else {
        let message = format!(
            "expected 9 or 16 numbers (row by row), found {}",
            values.len()
        );
        report(attribute, &message, diagnostics);
        return None;
    };
    let determinant = matrix.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        report(attribute, "the matrix cannot be inverted", diagnostics);
        return None;
    }
    Some(matrix)
}
