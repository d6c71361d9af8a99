//! Sources as emitters.

use super::super::tree::{Json, Node};
use super::labels::Labels;
use super::{Place, Reader, field, numbers};
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A beam without width, and a slit without height, in voxels.
const THIN: f64 = 1e-4;
/// How far sources in the volume are moved, of the way to the centre of the voxel that holds them: MCX starts photons in that voxel.
const INWARD: f64 = 1e-4;
/// How far the plane of a source may lean, as a sine.
const LEAN: f64 = 1e-6;

/// What a file says of its source.
struct Source {
    /// In voxels from the corner of the volume, inside of the voxel that holds it.
    position: DVec3,
    direction: DVec3,
    first: [f64; 4],
    second: [f64; 4],
}

/// The emitter of power 1 that a source is; `None` after an error.
pub(super) fn emitter(
    node: &Node,
    place: &Place,
    labels: Option<&Labels>,
    reader: &mut Reader,
) -> Option<Value> {
    let kind = match field(node, "Type").map(|kind| &kind.json) {
        Some(Json::String(kind)) => kind.to_ascii_lowercase(),
        _ => "pencil".to_owned(),
    };
    let read = ["Type", "Pos", "Dir", "Param1", "Param2"];
    reader.known(node, &read, &["SrcNum"]);
    if reader.number_or(node, "SrcNum", 1.0) != 1.0 {
        reader.error(node, "SrcNum is 1: each source is rendered by itself");
    }
    if matches!(&field(node, "Pos").map(|p| &p.json), Some(Json::Array(items)) if items.iter().any(|i| i.number().is_none()))
    {
        reader.error(
            node,
            "several sources in one file are not read: render each by itself",
        );
        return None;
    }
    let source = Source::of(node, place, labels, reader)?;
    let unit = place.unit;
    let made = match kind.as_str() {
        "pencil" => Ok(source.disc("disc", THIN * unit, unit)),
        "disk" | "gaussian" if source.first[0] <= 0.0 => {
            Err("Param1 begins with its radius".to_owned())
        }
        "disk" if source.first[1] == 0.0 => Ok(source.disc("disc", source.first[0] * unit, unit)),
        "gaussian" if source.first[1] == 0.0 => {
            Ok(source.disc("gaussian", source.first[0] * unit, unit))
        }
        "isotropic" => Ok(json!({
            "type": "point",
            "position": (source.position * unit).to_array(),
            "intensity": 1.0 / (4.0 * PI),
        })),
        "cone" if source.first[1] == 0.0 => source.cone(unit),
        "planar" => source.rectangle(unit),
        "slit" if source.second == [0.0; 4] => source.slit(unit),
        _ => Err(
            "sources are pencil, isotropic, cone, gaussian, disk, planar and slit, without second parameters that change their form"
                .to_owned(),
        ),
    };
    made.map_err(|message| reader.error(node, format!("source '{kind}': {message}")))
        .ok()
}

impl Source {
    fn of(
        node: &Node,
        place: &Place,
        labels: Option<&Labels>,
        reader: &mut Reader,
    ) -> Option<Self> {
        let [position, direction] = ["Pos", "Dir"].map(|key| reader.numbers::<3>(node, key));
        let position = DVec3::from(place.of(position?)) / place.unit;
        let Some(direction) = DVec3::from(direction?).try_normalize() else {
            reader.error(node, "Dir is a direction");
            return None;
        };
        let focus = field(node, "Dir")
            .and_then(numbers)
            .and_then(|v| v.get(3).copied());
        if focus.is_some_and(|f| f != 0.0) {
            reader.error(
                node,
                "sources with a focus (the fourth number of Dir) are not read",
            );
            return None;
        }
        let inside = labels.is_some_and(|l| l.at(position.to_array()) > 0.0);
        let four = |key| {
            let found = field(node, key).and_then(numbers).unwrap_or_default();
            std::array::from_fn(|i| found.get(i).copied().unwrap_or(0.0))
        };
        Some(Source {
            position: if inside {
                position.lerp(position.floor() + 0.5, INWARD)
            } else {
                position
            },
            direction,
            first: four("Param1"),
            second: four("Param2"),
        })
    }

    /// From the frame of an emitter, which shines along +z, with its x near a direction.
    fn frame(&self, center: DVec3, x: DVec3, unit: f64) -> Value {
        let z = self.direction;
        let x = (x - z * x.dot(z)).normalize();
        let y = z.cross(x);
        let t = center * unit;
        json!([{"matrix": [
            [x.x, y.x, z.x, t.x],
            [x.y, y.y, z.y, t.y],
            [x.z, y.z, z.z, t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]}])
    }

    fn disc(&self, profile: &str, radius: f64, unit: f64) -> Value {
        let x = self.direction.any_orthonormal_vector();
        json!({
            "type": "collimated", "profile": profile, "radius": radius, "power": 1.0,
            "to_world": self.frame(self.position, x, unit),
        })
    }

    /// The same intensity within a half angle.
    fn cone(&self, unit: f64) -> Result<Value, String> {
        let angle = self.first[0];
        if !(angle > 0.0 && angle <= PI) {
            return Err("Param1 begins with its half angle in radians, up to pi".into());
        }
        let x = self.direction.any_orthonormal_vector();
        Ok(json!({
            "type": "spot", "cutoff_angle": angle.to_degrees(), "beam_width": angle.to_degrees(),
            "intensity": 1.0 / (2.0 * PI * (1.0 - angle.cos())),
            "to_world": self.frame(self.position, x, unit),
        }))
    }

    /// Parallel light from a parallelogram, which must be a rectangle across it.
    fn rectangle(&self, unit: f64) -> Result<Value, String> {
        let side = |p: &[f64; 4]| DVec3::new(p[0], p[1], p[2]);
        let [u, v] = [side(&self.first), side(&self.second)];
        let square = u.dot(v).abs() <= LEAN * u.length() * v.length();
        let across = [u, v]
            .iter()
            .all(|e| e.dot(self.direction).abs() <= LEAN * e.length());
        if !square || !across || u.length() == 0.0 || v.length() == 0.0 {
            return Err("Param1 and Param2 must be perpendicular to one another and to Dir".into());
        }
        Ok(json!({
            "type": "collimated", "profile": "rectangle", "power": 1.0,
            "width": u.length() * unit, "height": v.length() * unit,
            "to_world": self.frame(self.position + 0.5 * (u + v), u, unit),
        }))
    }

    /// Parallel light from a line across it.
    fn slit(&self, unit: f64) -> Result<Value, String> {
        let line = DVec3::new(self.first[0], self.first[1], self.first[2]);
        if line.length() == 0.0 || line.dot(self.direction).abs() > LEAN * line.length() {
            return Err(
                "Param1 is the line from one end to the other, perpendicular to Dir".into(),
            );
        }
        Ok(json!({
            "type": "collimated", "profile": "rectangle", "power": 1.0,
            "width": line.length() * unit, "height": THIN * unit,
            "to_world": self.frame(self.position + 0.5 * line, line, unit),
        }))
    }
}
