//! Parts of planes from which light of sources starts.

use super::rays::Rays;
use super::source::Source;
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Radius of a beam without width, and height of a slit without height, in voxels.
pub(super) const MIN_WIDTH: f64 = 1e-6;
/// Largest cosine of the angle between two directions that counts as a right angle.
pub(super) const MAX_SKEW_COSINE: f64 = 1e-6;
/// Message for a line without length.
pub(super) const NO_LINE: &str = "Param1 must be the vector from one end of the line to the other";

/// Part of a plane from which light starts.
pub(super) struct Across {
    /// Fields of an emitter.
    fields: Value,
    /// Direction of the light in the emitter's frame, unless the direction is +z.
    axis: Option<[f64; 3]>,
}

impl Across {
    /// Makes a disc with practically no width.
    pub(super) fn point(source: &Source, unit: f64) -> Self {
        disc(source, "disc", MIN_WIDTH * unit, unit)
    }

    /// Makes a disc, a ring or a Gaussian around the position.
    pub(super) fn round(source: &Source, kind: &str, unit: f64) -> Result<Self, String> {
        let [radius, second, from, to] = source.first;
        if radius <= 0.0 {
            return Err("the first number of Param1 must be its radius, above 0".to_owned());
        }
        if kind == "gaussian" {
            let radius = waist(source, radius, second)?;
            return Ok(disc(source, "gaussian", radius * unit, unit));
        }
        if kind == "ring" && (from > 0.0 || to > 0.0) {
            return Err(
                "morgana does not support sectors of a ring: set the third and fourth numbers of Param1 to 0".to_owned(),
            );
        }
        if !(0.0..radius).contains(&second) {
            return Err(format!(
                "the second number of Param1, its inner radius, must be at least 0 and below the first, {radius}, but it is {second}"
            ));
        }
        let mut across = disc(source, "disc", radius * unit, unit);
        if second > 0.0 {
            across.fields["inner_radius"] = json!(second * unit);
        }
        Ok(across)
    }

    /// Makes a parallelogram from its sides. Columns of an image run along its first side, rows along
    /// its second.
    pub(super) fn parallelogram(
        source: &Source,
        [u, v]: [DVec3; 2],
        unit: f64,
    ) -> Result<Self, String> {
        let z = source.direction;
        let area = u.cross(v);
        if area.length() <= MAX_SKEW_COSINE * u.length() * v.length() || area.length() == 0.0 {
            return Err(
                "Param1 and Param2 must be two sides of a parallelogram, neither 0 nor parallel to one another"
                    .to_owned(),
            );
        }
        let is_square = u.dot(v).abs() <= MAX_SKEW_COSINE * u.length() * v.length();
        let across = |e: &DVec3| e.dot(z).abs() <= MAX_SKEW_COSINE * e.length();
        let is_across = [u, v].iter().all(across);
        let normal = if is_across {
            z
        } else {
            area.normalize() * 1f64.copysign(area.dot(z))
        };
        // Images run along the emitter's -x and -y.
        let x = -(u - normal * u.dot(normal)).normalize();
        let y = normal.cross(x) * -normal.cross(x).dot(v).signum();
        let center = source.position + 0.5 * (u + v);
        let height = if is_square {
            v.length()
        } else {
            v.dot(y).abs()
        };
        let mut fields = json!({
            "profile": "rectangle", "width": u.length() * unit, "height": height * unit,
            "to_world": matrix([x, y, normal, center * unit]),
        });
        if !is_square {
            fields["skew"] = json!(-v.dot(x) * unit);
        }
        let local = [x, y, normal].map(|axis| axis.dot(z));
        Ok(Across {
            fields,
            axis: (!is_across).then_some(local),
        })
    }

    /// Makes a line.
    pub(super) fn slit(source: &Source, unit: f64) -> Result<Self, String> {
        let line = source.sides()[0];
        let along = line.try_normalize().ok_or(NO_LINE)?;
        let cosine = along.dot(source.direction);
        let is_across = cosine.abs() <= MAX_SKEW_COSINE;
        let z = if is_across {
            source.direction
        } else {
            let across = source.direction.reject_from_normalized(along);
            if across.length() > MAX_SKEW_COSINE {
                across.normalize()
            } else {
                along.any_orthonormal_vector()
            }
        };
        let local = [cosine, 0.0, z.dot(source.direction)];
        Ok(Across {
            fields: json!({
                "profile": "rectangle",
                "width": line.length() * unit, "height": MIN_WIDTH * unit,
                "to_world": frame(z, line, (source.position + 0.5 * line) * unit),
            }),
            axis: (!is_across).then_some(local),
        })
    }

    /// Makes the emitter of light with the given directions.
    pub(super) fn emitter(&self, rays: &Rays, power: f64, unit: f64) -> Value {
        self.with(rays.emitter(self.axis, unit), power)
    }

    /// Makes the emitter of light with normal slopes along x and y of the emitter.
    pub(super) fn with_slopes(&self, slopes: [f64; 2], power: f64) -> Value {
        let slopes = json!({"type": "fiber", "angular_profile": "slopes", "slopes": slopes});
        self.with(slopes, power)
    }

    /// Adds the power and the fields of the part of a plane to an emitter.
    fn with(&self, mut emitter: Value, power: f64) -> Value {
        emitter["power"] = json!(power);
        if let (Value::Object(emitter), Value::Object(fields)) = (&mut emitter, &self.fields) {
            emitter.extend(fields.clone());
        }
        emitter
    }
}

/// Returns the radius of a Gaussian beam where it starts. A focused beam with a wavelength has its
/// waist at the focus.
fn waist(source: &Source, radius: f64, wavelength: f64) -> Result<f64, String> {
    match source.rays {
        Rays::Focus(distance) if wavelength > 0.0 => {
            let range = PI * radius * radius / wavelength;
            Ok(radius * (distance / range).hypot(1.0))
        }
        _ if wavelength < 0.0 => Err(format!(
            "the second number of Param1, its wavelength, must be at least 0, but it is {wavelength}"
        )),
        _ => Ok(radius),
    }
}

fn disc(source: &Source, profile: &str, radius: f64, unit: f64) -> Across {
    let x = source.direction.any_orthonormal_vector();
    Across {
        fields: json!({
            "profile": profile, "radius": radius,
            "to_world": frame(source.direction, x, source.position * unit),
        }),
        axis: None,
    }
}

/// Returns the transform from an emitter's frame: it emits along +z, its x is close to `x`, and its
/// origin is at `center`.
pub(super) fn frame(z: DVec3, x: DVec3, center: DVec3) -> Value {
    let x = (x - z * x.dot(z)).normalize();
    let y = z.cross(x);
    matrix([x, y, z, center])
}

/// Returns a transform whose matrix has these columns.
fn matrix([x, y, z, t]: [DVec3; 4]) -> Value {
    json!([{"matrix": [
        [x.x, y.x, z.x, t.x],
        [x.y, y.y, z.y, t.y],
        [x.z, y.z, z.z, t.z],
        [0.0, 0.0, 0.0, 1.0],
    ]}])
}
