//! Drawable content of scenes: surfaces, media, emitters and the view of the sensor.

use super::{Failure, not_found};
use crate::server::{Body, Response};
use eikonal::Aabb;
use glam::DVec3;
use io::Loaded;
use serde_json::{Value, json};
use transport::Scene;
use transport::emitter::{Class, Emitter};
use transport::scene::{AMBIENT, Object};
use transport::sensor::Sensor;
use transport::shape::Shape;

/// Number of triangles above which a shape is shown as its box.
const MAX_TRIANGLES: usize = 2_000_000;

/// Describes everything except the triangles of the surfaces.
pub(super) fn describe(loaded: &Loaded) -> Value {
    let scene = loaded.scene();
    let objects = scene.objects().iter();
    let bounds = objects
        .clone()
        .fold(Aabb::EMPTY, |all, o| all.union(o.shape.aabb()));
    let film = scene.film();
    json!({
        "objects": objects.map(|object| about_object(scene, object)).collect::<Vec<_>>(),
        "media": scene.media().iter().enumerate().map(|(i, medium)| json!({
            "name": medium.name,
            "ambient": i == AMBIENT,
            "graded": !medium.index.is_constant(),
            "scatters": !medium.is_transparent(),
        })).collect::<Vec<_>>(),
        "emitters": (0..scene.emitters().len()).map(|i| about_emitter(loaded, i)).collect::<Vec<_>>(),
        "sensor": about_sensor(scene),
        "film": [film.width, film.height],
        "bounds": (bounds.min.cmple(bounds.max).all()).then(|| [bounds.min, bounds.max].map(|x| x.to_array())),
        "warnings": warnings(loaded),
    })
}

fn warnings(loaded: &Loaded) -> Vec<String> {
    let text = loaded.warnings.render(io::diagnostic::Style::detect(false));
    text.lines().map(str::to_owned).collect()
}

fn about_object(scene: &Scene, object: &Object) -> Value {
    let aabb = object.shape.aabb();
    json!({
        "name": object.name,
        "bounds": [aabb.min.to_array(), aabb.max.to_array()],
        "interior": object.interior().map(|id| scene.medium(id).name.as_str()),
        "medium": object.interior(),
        "emitter": object.emitter,
        "transparent": matches!(object.bsdf, transport::bsdf::Bsdf::Null | transport::bsdf::Bsdf::Dielectric(_)),
        "box": is_large(&object.shape),
    })
}

fn is_large(shape: &Shape) -> bool {
    match shape {
        Shape::Mesh(mesh) => mesh.triangles().len() > MAX_TRIANGLES,
        Shape::VoxelFaces(faces) => 2 * faces.count() > MAX_TRIANGLES,
        _ => false,
    }
}

fn about_emitter(loaded: &Loaded, i: usize) -> Value {
    let emitter = &loaded.scene().emitters()[i];
    json!({
        "name": loaded.emitter_names.get(i),
        "kind": emitter.kind(),
        "position": target(loaded.scene(), i).map(|x| x.to_array()),
        "area": emitter.class() == Class::Area,
    })
}

/// Returns a point of an emitter for connections: its position, or the centre of the first surface
/// that it covers.
pub(super) fn target(scene: &Scene, i: usize) -> Option<DVec3> {
    let emitter: &Emitter = scene.emitters().get(i)?;
    let covered = || {
        scene
            .objects()
            .iter()
            .find(|object| object.emitter == Some(i))
    };
    let middle = || covered().map(|object| object.shape.sample_area([0.5; 2]).position);
    emitter.position().or_else(middle)
}

/// Describes rays through the corners of the picture, clockwise from the top left, and through its
/// centre.
fn about_sensor(scene: &Scene) -> Value {
    let film = scene.film();
    let [w, h] = [film.width, film.height].map(|n| n as f64);
    let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h], [0.5 * w, 0.5 * h]];
    let rays = corners.map(|corner| {
        let ray = scene.sensor().ray(film.image(corner), [0.5; 2]);
        json!({ "origin": ray.origin.to_array(), "direction": ray.direction.to_array() })
    });
    match scene.sensor() {
        Sensor::Absent(_) => Value::Null,
        _ => json!({ "rays": rays }),
    }
}

/// Returns the triangles of an object: the numbers of vertices and of triangles as two uint32, then
/// coordinates as float32 and vertices of triangles as uint32, all little-endian.
pub(super) fn mesh(loaded: &Loaded, object: &str) -> Result<Response, Failure> {
    let objects = loaded.scene().objects();
    let object = object.parse().ok().and_then(|i: usize| objects.get(i));
    let object = object.ok_or_else(|| not_found("object"))?;
    if is_large(&object.shape) {
        return Err(not_found("mesh of so few triangles that it is drawn"));
    }
    let mesh = object.shape.tessellation();
    let counts = [mesh.positions.len(), mesh.triangles.len()].map(|n| n as u32);
    let coordinates = mesh.positions.iter().flat_map(|x| x.as_vec3().to_array());
    let corners = mesh.triangles.iter().flatten();
    let mut bytes: Vec<u8> = counts.iter().flat_map(|n| n.to_le_bytes()).collect();
    bytes.extend(coordinates.flat_map(f32::to_le_bytes));
    bytes.extend(corners.flat_map(|i| i.to_le_bytes()));
    Ok(Response {
        body: Body::Bytes(bytes.into()),
        ..Response::floats(Vec::new())
    })
}
