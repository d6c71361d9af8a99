//! Drawable content of scenes: surfaces, media, emitters and the view of the sensor.

use super::{Failure, not_found};
use crate::described::DescribedScene;
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

/// Number of points along each side of a plane in which the page looks up an index.
const INDEX_POINTS: usize = 96;

/// Describes everything except the triangles of the surfaces.
pub(super) fn describe(described: &DescribedScene) -> Value {
    let loaded = &*described.loaded;
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
            "region": region(scene, i).map(|aabb| [aabb.min, aabb.max].map(|x| x.to_array())),
            "scatters": !medium.is_transparent(),
        })).collect::<Vec<_>>(),
        "emitters": (0..scene.emitters().len()).map(|i| about_emitter(loaded, i)).collect::<Vec<_>>(),
        "sensor": about_sensor(scene),
        "film": [film.width, film.height],
        "bounds": (bounds.min.cmple(bounds.max).all()).then(|| [bounds.min, bounds.max].map(|x| x.to_array())),
        "parameters": described.changeable(),
        "warnings": warnings(loaded),
    })
}

/// Returns a box around a medium; `None` for a medium that fills nothing.
fn region(scene: &Scene, medium: usize) -> Option<Aabb> {
    let aabb = scene.regions().get(medium)?.aabb;
    let is_finite = aabb.min.is_finite() && aabb.max.is_finite();
    (is_finite && aabb.min.cmplt(aabb.max).all()).then_some(aabb)
}

/// Returns the index of a medium in three planes through the middle of its region, across x, y and
/// z. Each has 96 × 96 points in the middles of equal cells: for x, along y and then z; for y, along
/// z and then x; for z, along x and then y. NaN stands for points outside the medium.
pub(super) fn index(loaded: &Loaded, medium: &str) -> Result<Response, Failure> {
    let scene = loaded.scene();
    let medium = medium.parse().ok().filter(|i| *i < scene.media().len());
    let medium = medium.ok_or_else(|| not_found("medium"))?;
    let aabb = region(scene, medium).ok_or_else(|| not_found("region of the medium"))?;
    let size = aabb.max - aabb.min;
    let mut values = Vec::with_capacity(3 * INDEX_POINTS * INDEX_POINTS);
    for axis in 0..3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        for (j, i) in (0..INDEX_POINTS).flat_map(|j| (0..INDEX_POINTS).map(move |i| (j, i))) {
            let mut x = aabb.center();
            for (along, k) in [(u, i), (v, j)] {
                x[along] = aabb.min[along] + size[along] * (k as f64 + 0.5) / INDEX_POINTS as f64;
            }
            let is_inside = scene.medium_at(x) == medium;
            values.push(if is_inside {
                scene.n(medium, x) as f32
            } else {
                f32::NAN
            });
        }
    }
    Ok(Response::floats(values))
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
