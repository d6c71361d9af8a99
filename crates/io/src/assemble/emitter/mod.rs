//! Emitters of the scene.

mod beam;
mod directional_area;
mod files;
mod spot;
mod sun;
mod sunsky;
mod volume;

use super::brightness::light;
use super::context::Context;
use super::medium;
use super::surface_texture::{Role, Vertices, texture};
use super::transforms::axis;
use crate::query::{Input, Query, misplaced_plugin, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use glam::DAffine3;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use transport::emitter::{Emitter, Environment, TexturedArea};
use transport::scene::Parts;
use transport::shape::Shape;

/// Plugins of emitters that belong inside a shape.
const ON_SHAPES: [&str; 2] = ["area", "directionalarea"];

/// Returns true for an emitter that belongs inside a shape.
pub(super) fn is_on_shape(object: &ObjectDescription) -> bool {
    object.kind == PluginKind::Emitter && ON_SHAPES.contains(&object.plugin.as_str())
}

/// Adds an emitter of the scene.
pub(super) fn add(object: &ObjectDescription, context: &mut Context) {
    if is_on_shape(object) {
        let name = &object.plugin;
        let message = format!("an emitter '{name}' belongs inside the shape that it covers");
        context.error_at(&object.location, message);
        return;
    }
    if object.plugin == "sunsky" {
        for (name, part) in sunsky::environments(object, context) {
            let id = object.id.as_ref().map(|id| format!("{id}_{name}"));
            let id = id.unwrap_or_else(|| name.to_owned());
            push(Emitter::Environment(part), object, Some(id), context);
        }
        return;
    }
    if let Some(emitter) = build(object, context) {
        push(emitter, object, object.id.clone(), context);
    }
}

/// Shape that has an emitter.
pub(super) struct Host<'a> {
    pub description: &'a ObjectDescription,
    /// Index of the object that the shape will become.
    pub index: usize,
    pub geometry: &'a Shape,
    /// Map from the local coordinates of the shape to the world.
    pub frame: DAffine3,
    pub vertices: &'a Vertices,
}

/// Adds the emitter of a shape. Returns its index if rays hit the emitter when they hit the shape.
pub(super) fn add_on_shape(
    object: &ObjectDescription,
    host: &Host,
    context: &mut Context,
) -> Option<usize> {
    match object.plugin.as_str() {
        "area" => add_area(object, host, context),
        "directionalarea" => {
            let emitter = directional_area::directional_area(object, host, context)?;
            let id = object.id.as_ref().or(host.description.id.as_ref());
            push(emitter, object, id.cloned(), context);
            None
        }
        _ => {
            misplaced_plugin(object, &ON_SHAPES, context.diagnostics);
            None
        }
    }
}

/// Adds the area emitter of a shape; returns its index.
fn add_area(object: &ObjectDescription, host: &Host, context: &mut Context) -> Option<usize> {
    let Host {
        description: shape,
        index,
        geometry,
        vertices,
        ..
    } = *host;
    let mut query = Query::new(object, context.diagnostics);
    let radiance = query.texture_or_spectrum("radiance");
    query.finish(&[]);
    let emitter = match radiance {
        Input::Spectrum(value) => Emitter::Area {
            object: index,
            radiance: light(&value, "radiance", object, context),
        },
        Input::Object(nested) => {
            let input = Input::Object(nested);
            let radiance = texture(input, Role::Emission, object, "radiance", vertices, context);
            let light = TexturedArea::new(index, geometry, radiance);
            Emitter::Textured(Arc::new(context.accept(&nested.location, light)?))
        }
    };
    let id = object.id.as_ref().or(shape.id.as_ref()).cloned();
    Some(push(emitter, object, id, context))
}

/// Adds an emitter with its id and place. Returns its number.
fn push(
    emitter: Emitter,
    object: &ObjectDescription,
    id: Option<String>,
    context: &mut Context,
) -> usize {
    context.emitters.push(emitter);
    context.emitter_ids.push(id);
    context.places.emitters.push(object.location.clone());
    context.emitters.len() - 1
}

/// Maximum number of characters of an emitter's name, before a number is appended. The name becomes
/// part of channel names in files.
const MAX_NAME_LENGTH: usize = 60;

/// Returns the names of emitters: their ids, the names of the media that emit, or their kinds.
/// Numbers make them unique, and dots are replaced.
pub(super) fn names(ids: &[Option<String>], parts: &Parts) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(parts.emitters.len());
    let mut taken = HashSet::new();
    // Count on from the last number of each name: thousands of emitters may share a name.
    let mut next: HashMap<String, usize> = HashMap::new();
    for (i, emitter) in parts.emitters.iter().enumerate() {
        let own = ids.get(i).and_then(Option::as_deref);
        let medium = match emitter {
            Emitter::Volume(volume) => volume.medium().map(|id| parts.media[id].name.as_str()),
            _ => None,
        };
        let id = own.or(medium).unwrap_or(emitter.kind());
        let stem: String = id.replace('.', "_").chars().take(MAX_NAME_LENGTH).collect();
        let number = next.entry(stem.clone()).or_insert(1);
        let mut name = stem.clone();
        while !taken.insert(name.clone()) {
            *number += 1;
            name = format!("{stem}_{number}");
        }
        names.push(name);
    }
    names
}

/// Builds an emitter with an image, or returns it if it was built before; `None` after an error.
fn once(
    object: &ObjectDescription,
    context: &mut Context,
    build: fn(&ObjectDescription, &mut Context) -> Option<Emitter>,
) -> Option<Emitter> {
    context.once(
        |assets| &mut assets.emitters,
        object.number,
        |context| build(object, context),
    )
}

/// Builds an emitter other than an area emitter; `None` after an error.
fn build(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    match object.plugin.as_str() {
        "envmap" => return once(object, context, files::envmap),
        "projector" => return once(object, context, files::projector),
        "spot" => return spot::spot(object, context),
        "ies" => return files::luminaire(object, context),
        "collimated" => return beam::collimated(object, context),
        "fiber" => return beam::fiber(object, context),
        "volumelight" => return volume::volumelight(object, context),
        _ => {}
    }
    let mut q = Query::new(object, context.diagnostics);
    let inside = q.child(PluginKind::Medium).cloned();
    let (origin, axis) = axis(&mut q)?;
    let emitter = match object.plugin.as_str() {
        "point" => {
            instead_of_transform("position", &mut q);
            let position = q.point_or("position", origin);
            let intensity = q.spectrum("intensity");
            q.finish(&[]);
            Emitter::Point {
                position,
                intensity: light(&intensity, "intensity", object, context),
            }
        }
        "directional" => {
            let irradiance = q.spectrum("irradiance");
            instead_of_transform("direction", &mut q);
            let direction = q.vector_or("direction", axis).try_normalize();
            if direction.is_none() {
                q.error("direction", "the direction must not be zero");
            }
            q.finish(&[]);
            Emitter::Directional {
                direction: direction?,
                irradiance: light(&irradiance, "irradiance", object, context),
            }
        }
        "constant" => {
            let radiance = q.spectrum("radiance");
            q.finish(&[]);
            let radiance = light(&radiance, "radiance", object, context);
            Emitter::Environment(Environment::Constant(radiance))
        }
        _ => {
            unknown_plugin(object, context.diagnostics);
            return None;
        }
    };
    check_medium(inside, context);
    Some(emitter)
}

/// Checks the medium that an emitter names. The medium around an emitter follows from the shapes
/// around it, so the name, which Mitsuba needs, has no effect.
fn check_medium(named: Option<Arc<ObjectDescription>>, context: &mut Context) {
    if let Some(named) = named {
        medium::medium(&named, context);
    }
}

/// Reports a parameter that is given together with `to_world`, which it replaces as in Mitsuba.
fn instead_of_transform(name: &str, q: &mut Query) {
    if q.has(name) && q.has("to_world") {
        q.error(name, format!("give '{name}' or 'to_world', not both"));
    }
}
