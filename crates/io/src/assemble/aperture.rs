//! Aperture of a sensor: an iris with blades, obscuration and vanes, or a bitmap.

use super::context::Context;
use super::surface_texture::transmittances;
use crate::diagnostic::Location;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, ObjectId, PluginKind};
use std::sync::Arc;
use transport::sensor::{ApertureShape, Iris};

/// Name of the nested bitmap.
const PICTURE: &str = "aperture";
/// Parameters that describe an aperture other than an unobstructed disc.
pub(super) const SHAPES: [&str; 7] = [
    "blades",
    "blade_angle",
    "obscuration",
    "vanes",
    "vane_width",
    "vane_angle",
    PICTURE,
];

/// Aperture as described by a sensor.
pub(super) struct Opening {
    shape: Shape,
    /// Object number of the sensor.
    sensor: ObjectId,
    /// Place of the sensor in the scene file.
    location: Location,
}

/// Outline of an aperture: an iris, or the bitmap of an arbitrary one.
enum Shape {
    Iris(Iris),
    Picture(Arc<ObjectDescription>),
}

impl Opening {
    /// Reads the parameters of an aperture. Reports a bitmap that is given together with parameters
    /// of an iris.
    pub(super) fn read(sensor: &ObjectDescription, q: &mut Query) -> Self {
        let picture = q.role(PluginKind::Texture, PICTURE).cloned();
        let iris = iris(q);
        let shape = match picture {
            Some(picture) => {
                for name in SHAPES.into_iter().filter(|name| *name != PICTURE) {
                    if q.has(name) {
                        let message =
                            format!("give a picture of the aperture, or '{name}', not both");
                        q.error(name, message);
                    }
                }
                Shape::Picture(picture)
            }
            None => Shape::Iris(iris),
        };
        Opening {
            shape,
            sensor: sensor.number,
            location: sensor.location.clone(),
        }
    }

    /// Returns the aperture, built on first use; `None` after an error.
    pub(super) fn aperture(&self, context: &mut Context) -> Option<ApertureShape> {
        if let Some(made) = context.assets.apertures.get(&self.sensor) {
            return Some(made.clone());
        }
        let aperture = match &self.shape {
            Shape::Iris(iris) => context.accept(&self.location, ApertureShape::new(*iris)),
            Shape::Picture(bitmap) => picture(bitmap, context),
        }?;
        context
            .assets
            .apertures
            .insert(self.sensor, aperture.clone());
        Some(aperture)
    }
}

/// Reads the parameters of an iris.
fn iris(q: &mut Query) -> Iris {
    let open = Iris::default();
    let mut iris = Iris {
        obscuration: q.float("obscuration"),
        ..open
    };
    if part(q, "blades", &["blade_angle"]) {
        // After an error, continue with a valid number of blades: one error is enough.
        iris.blades = q.integer("blades").max(3) as u32;
        iris.blade_angle = q.float("blade_angle").to_radians();
    }
    if part(q, "vanes", &["vane_width", "vane_angle"]) {
        iris.vanes = q.integer("vanes") as u32;
        iris.vane_width = q.float("vane_width");
        iris.vane_angle = q.float("vane_angle").to_radians();
    }
    iris
}

/// Returns true if the iris has the part `name`. Reports any of its `details` that are given
/// without it.
fn part(q: &mut Query, name: &str, details: &[&str]) -> bool {
    let is_there = q.has(name);
    for detail in details {
        if !is_there && q.has(detail) {
            q.error(detail, format!("'{detail}' needs '{name}', their number"));
        }
    }
    is_there
}

/// Builds an aperture from a bitmap, which must be square; `None` after an error.
fn picture(bitmap: &ObjectDescription, context: &mut Context) -> Option<ApertureShape> {
    if bitmap.plugin != "bitmap" {
        misplaced_plugin(bitmap, &["bitmap"], context.diagnostics);
        return None;
    }
    let ([width, height], shares) = transmittances(bitmap, context)?;
    if width != height {
        let message = format!(
            "a picture of an aperture covers the square around it: it must be as wide as high, but it has {width} x {height} pixels"
        );
        context.error_at(&bitmap.location, message);
        return None;
    }
    context.accept(&bitmap.location, ApertureShape::picture(width, &shares))
}
