//! Conversion of sources to emitters.

use super::super::tree::{Json, Node};
use super::labels::Labels;
use super::pattern::{self, Pattern};
use super::source::{Source, wanted};
use super::{Place, Reader, field};
use crate::scene::Tensor;
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

/// Radius of a beam without width, and height of a slit without height, in voxels.
const MIN_WIDTH: f64 = 1e-6;
/// Largest cosine of the angle between a source's sides and its direction that counts as a right
/// angle.
const MAX_SKEW_COSINE: f64 = 1e-6;
/// Fields of a source that morgana reads.
const READ: [&str; 9] = [
    "Type", "Pos", "Dir", "Param1", "Param2", "Pattern", "Weight", "SrcNum", "ID",
];

/// An emitter, and the image that modulates its light.
pub(super) struct Emitter {
    pub plugin: Value,
    pub image: Option<Arc<Tensor>>,
}

/// Makes the emitters for the sources of a file, with a total power of 1; `None` after an error.
pub(super) fn emitters(
    node: &Node,
    place: &Place,
    labels: Option<&Labels>,
    reader: &mut Reader,
) -> Option<Vec<Emitter>> {
    let kind = match field(node, "Type").map(|kind| &kind.json) {
        Some(Json::String(kind)) => kind.to_ascii_lowercase(),
        _ => "pencil".to_owned(),
    };
    reader.known(node, &READ, &[]);
    if reader.number_or(node, "SrcNum", 1.0) != 1.0 {
        let message = "SrcNum must be 1: write a file for each pattern";
        reader.error(node, message);
        return None;
    }
    let mut sources = wanted(Source::all(node, place, labels, reader)?, node, reader)?;
    if sources.iter().any(|source| source.has_focus(&kind)) {
        let message = "morgana does not support a focus of the source, the fourth number of Dir: leave it out, or write a scene with a \
                       'fiber' that has a 'focus' (docs/guides/tissue-optics.md#sources)";
        reader.error(node, message);
        return None;
    }
    let kind = if kind == "pencilarray" {
        let beams = sources.iter().map(|source| source.beams(labels)).collect();
        let beams: Result<Vec<Vec<Source>>, String> = beams;
        let beams = beams.map_err(|message| reader.error(node, message)).ok()?;
        sources = beams.into_iter().flatten().collect();
        "pencil".to_owned()
    } else {
        kind
    };
    let mut patterns = Vec::with_capacity(sources.len());
    for source in &sources {
        let made = pattern::of(&kind, source, node, reader);
        let made =
            made.map_err(|message| reader.error(node, format!("source '{kind}': {message}")));
        patterns.push(made.ok()?);
    }
    let strength = |(source, pattern): (&Source, &Option<Pattern>)| {
        source.weight * pattern.as_ref().map_or(1.0, |p| p.mean)
    };
    let strengths: Vec<f64> = sources.iter().zip(&patterns).map(strength).collect();
    let total: f64 = strengths.iter().sum();
    let shares = strengths.iter().map(|s| s / total);
    let mut found = Vec::with_capacity(sources.len());
    for ((source, pattern), power) in sources.iter().zip(patterns).zip(shares) {
        let made = source.emitter(&kind, pattern, power, place.unit);
        let made =
            made.map_err(|message| reader.error(node, format!("source '{kind}': {message}")));
        found.push(made.ok()?);
    }
    Some(found)
}

impl Source {
    fn emitter(
        &self,
        kind: &str,
        pattern: Option<Pattern>,
        power: f64,
        unit: f64,
    ) -> Result<Emitter, String> {
        let plugin = match (kind, &pattern) {
            (_, Some(pattern)) => {
                let mut plugin = self.rectangle(pattern.sides, power, unit)?;
                plugin["texture"] = json!({
                    "type": "bitmap", "filter_type": pattern.filter, "wrap_mode": "clamp",
                });
                plugin
            }
            _ => self.plain(kind, power, unit)?,
        };
        let image = pattern.map(|pattern| pattern.image);
        Ok(Emitter { plugin, image })
    }

    /// Makes an emitter without an image.
    fn plain(&self, kind: &str, power: f64, unit: f64) -> Result<Value, String> {
        let [p, q] = [self.first, self.second];
        match kind {
            "pencil" => Ok(self.disc("disc", MIN_WIDTH * unit, power, unit)),
            "disk" | "gaussian" if p[0] <= 0.0 => Err("the first number of Param1 must be its radius, above 0".to_owned()),
            "disk" if p[1] == 0.0 => Ok(self.disc("disc", p[0] * unit, power, unit)),
            "gaussian" if p[1] == 0.0 => Ok(self.disc("gaussian", p[0] * unit, power, unit)),
            "isotropic" => Ok(json!({
                "type": "point",
                "position": (self.position * unit).to_array(),
                "intensity": power / (4.0 * PI),
            })),
            "cone" if p[1] == 0.0 => self.cone(power, unit),
            "planar" => self.rectangle(self.sides(), power, unit),
            "slit" if q == [0.0; 4] => self.slit(power, unit),
            _ => Err(
                "sources are pencil, pencilarray, isotropic, cone, gaussian, disk, planar, pattern, fourier, fourierx, fourierx2d \
                 and slit, without second parameters that change their form; for others write a scene \
                 (docs/guides/tissue-optics.md#sources)"
                    .to_owned(),
            ),
        }
    }

    /// Returns the transform from an emitter's frame: it emits along +z, and its x is close to `x`.
    fn frame(&self, center: DVec3, x: DVec3, unit: f64) -> Value {
        let z = self.direction;
        let x = (x - z * x.dot(z)).normalize();
        let y = z.cross(x);
        matrix([x, y, z, center * unit])
    }

    fn disc(&self, profile: &str, radius: f64, power: f64, unit: f64) -> Value {
        let x = self.direction.any_orthonormal_vector();
        json!({
            "type": "collimated", "profile": profile, "radius": radius, "power": power,
            "to_world": self.frame(self.position, x, unit),
        })
    }

    /// Makes an emitter with constant intensity within a half angle.
    fn cone(&self, power: f64, unit: f64) -> Result<Value, String> {
        let angle = self.first[0];
        if !(angle > 0.0 && angle <= PI) {
            return Err(
                "the first number of Param1 must be its half angle, above 0 and at most pi radians"
                    .into(),
            );
        }
        let x = self.direction.any_orthonormal_vector();
        Ok(json!({
            "type": "spot", "cutoff_angle": angle.to_degrees(), "beam_width": angle.to_degrees(),
            "intensity": power / (2.0 * PI * (1.0 - angle.cos())),
            "to_world": self.frame(self.position, x, unit),
        }))
    }

    /// Makes an emitter of parallel light from a parallelogram, which must be a rectangle
    /// perpendicular to the light. Columns of an image run along its first side, rows along its
    /// second.
    fn rectangle(&self, [u, v]: [DVec3; 2], power: f64, unit: f64) -> Result<Value, String> {
        let square = u.dot(v).abs() <= MAX_SKEW_COSINE * u.length() * v.length();
        let across = [u, v]
            .iter()
            .all(|e| e.dot(self.direction).abs() <= MAX_SKEW_COSINE * e.length());
        if !square || !across || u.length() == 0.0 || v.length() == 0.0 {
            return Err("Param1 and Param2 must be perpendicular to one another and to Dir".into());
        }
        let z = self.direction;
        // Images run along the emitter's -x and -y.
        let x = -(u - z * u.dot(z)).normalize();
        let y = z.cross(x) * -z.cross(x).dot(v).signum();
        let center = self.position + 0.5 * (u + v);
        Ok(json!({
            "type": "collimated", "profile": "rectangle", "power": power,
            "width": u.length() * unit, "height": v.length() * unit,
            "to_world": matrix([x, y, z, center * unit]),
        }))
    }

    /// Makes an emitter of parallel light from a line perpendicular to the light.
    fn slit(&self, power: f64, unit: f64) -> Result<Value, String> {
        let line = DVec3::new(self.first[0], self.first[1], self.first[2]);
        if line.length() == 0.0 || line.dot(self.direction).abs() > MAX_SKEW_COSINE * line.length()
        {
            return Err(
                "Param1 must be the vector from one end of the line to the other, perpendicular to Dir".into(),
            );
        }
        Ok(json!({
            "type": "collimated", "profile": "rectangle", "power": power,
            "width": line.length() * unit, "height": MIN_WIDTH * unit,
            "to_world": self.frame(self.position + 0.5 * line, line, unit),
        }))
    }
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
