//! Distant sensors: the mean radiance that leaves a target in one direction.

use super::transforms::affine;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Aabb;
use glam::{DAffine3, DMat3, DVec3};
use transport::scene::Object;
use transport::sensor::Orthographic;

/// Radius of the disc that represents a point target, relative to the radius of the scene.
const POINT_RADIUS: f64 = 1e-6;
/// Distance of the sensor from the centre of the scene, relative to the radius of the scene.
const SENSOR_DISTANCE: f64 = 2.0;
/// Smallest sine of the angle between the rays and a flat target: rays along the target never hit
/// it.
const MIN_SINE: f64 = 1e-9;

/// Rays of a distant sensor.
pub(super) struct Distant {
    /// Unit direction of the rays.
    pub direction: DVec3,
    pub target: Target,
}

/// Region through which the rays of a distant sensor pass, if nothing bends them.
#[derive(Clone, Copy)]
pub(super) enum Target {
    /// Sphere around all shapes.
    Scene,
    Point(DVec3),
    /// Image of the square \[−1, 1\]² of the plane z = 0.
    Rectangle(DAffine3),
    /// Image of the unit disk of the plane z = 0.
    Disk(DAffine3),
}

impl Distant {
    /// Reads the direction and the target. `frame` is the map of `to_world`.
    pub(super) fn read(frame: &DAffine3, q: &mut Query) -> Self {
        let mut axis = frame.matrix3.z_axis;
        if q.has("direction") {
            axis = q.vector("direction");
            if q.has("to_world") {
                q.error("to_world", "give 'direction' or 'to_world', not both");
            }
        }
        let direction = axis.try_normalize().unwrap_or_else(|| {
            q.error("direction", "the direction must not be zero");
            DVec3::Z
        });
        let target = Target::read(q);
        if target.is_edge_on(direction) {
            q.error("target", "the rays of the sensor lie in the target's plane");
        }
        Distant { direction, target }
    }

    /// Returns the sensor, at a distance from all shapes.
    pub(super) fn sensor(&self, objects: &[Object]) -> Orthographic {
        let (center, radius) = bounding_sphere(objects);
        let direction = self.direction;
        let x = direction.any_orthonormal_vector();
        let across = [x, direction.cross(x)];
        let ([x, y], middle) = match self.target {
            Target::Scene => (across.map(|axis| axis * radius), center),
            Target::Point(point) => (across.map(|axis| axis * (POINT_RADIUS * radius)), point),
            Target::Rectangle(map) | Target::Disk(map) => {
                ([map.matrix3.x_axis, map.matrix3.y_axis], map.translation)
            }
        };
        let ahead = (middle - center).dot(direction) + SENSOR_DISTANCE * radius;
        let frame = DAffine3 {
            matrix3: DMat3::from_cols(x, y, direction),
            translation: middle - direction * ahead,
        };
        match self.target {
            Target::Rectangle(_) => Orthographic::new(frame, 1.0),
            // Planted error "targets of distant sensors square instead of round", found by morgana-io/io::distant::a_flat_target_counts_by_its_area:
            // _ => Orthographic::new(frame, 1.0),
            _ => Orthographic::round(frame),
        }
    }
}

impl Target {
    /// Reads a point or a shape; the whole scene without either, and after an error.
    fn read(q: &mut Query) -> Self {
        const NAME: &str = "target";
        let is_point = q.object().properties.iter().any(|p| p.name == NAME);
        if is_point {
            return Target::Point(q.point(NAME));
        }
        let Some(shape) = q.role(PluginKind::Shape, NAME) else {
            return Target::Scene;
        };
        let shape: &ObjectDescription = shape;
        let is_flat = ["rectangle", "disk"].contains(&shape.plugin.as_str());
        if !is_flat {
            misplaced_plugin(shape, &["rectangle", "disk"], q.diagnostics());
            return Target::Scene;
        }
        let mut nested = Query::new(shape, q.diagnostics());
        let matrix = nested.transform("to_world");
        let map = affine(matrix, "to_world", &mut nested);
        // Accept the side of the normals, which does not affect the mean.
        nested.boolean("flip_normals");
        nested.finish(&[]);
        if shape.plugin == "rectangle" {
            Target::Rectangle(map)
        } else {
            Target::Disk(map)
        }
    }

    /// Returns true if rays of a unit direction lie in the plane of the target, or if the target
    /// has no area.
    fn is_edge_on(&self, direction: DVec3) -> bool {
        match self {
            Target::Scene | Target::Point(_) => false,
            Target::Rectangle(map) | Target::Disk(map) => {
                let [x, y] = [map.matrix3.x_axis, map.matrix3.y_axis];
                let normal = x.cross(y);
                normal.dot(direction).abs() <= MIN_SINE * (x.length() * y.length())
            }
        }
    }
}

/// Returns the centre and the radius of the sphere around the bounding box of all shapes; the unit
/// sphere if there are none.
fn bounding_sphere(objects: &[Object]) -> (DVec3, f64) {
    let boxes = objects.iter().map(|o| o.shape.aabb());
    let all = boxes.fold(Aabb::EMPTY, Aabb::union);
    if all.is_empty() {
        return (DVec3::ZERO, 1.0);
    }
    (all.center(), 0.5 * (all.max - all.min).length())
}
