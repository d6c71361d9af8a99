//! Conversion of sources to emitters.

use super::super::tree::{Json, Node};
use super::across::{Across, MAX_SKEW_COSINE, MIN_WIDTH, NO_LINE, frame};
use super::labels::Labels;
use super::pattern::{self, Pattern};
use super::rays::Rays;
use super::source::{Source, wanted};
use super::{Place, Reader, field};
use crate::scene::Tensor;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

/// Smallest and largest standard deviation of an angle, in radians, and of a slope.
const MIN_DEVIATION: f64 = 1e-6;
const MAX_DEVIATION: f64 = 10.0;
/// Fields of a source that morgana reads.
const READ: [&str; 12] = [
    "Type",
    "Pos",
    "Dir",
    "Param1",
    "Param2",
    "Pattern",
    "PatternID",
    "Weight",
    "SrcNum",
    "ID",
    "AngleInverseCDF",
    "Frequency",
];
/// Sources whose light MCX focuses.
const FOCUSED: [&str; 10] = [
    "gaussian",
    "planar",
    "pattern",
    "fourier",
    "disk",
    "ring",
    "fourierx",
    "fourierx2d",
    "slit",
    "pencilarray",
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
    if kind != "pattern" && reader.number_or(node, "SrcNum", 1.0) != 1.0 {
        let message = "SrcNum must be 1: only sources of the Type pattern have several patterns";
        reader.error(node, message);
        return None;
    }
    let mut sources = wanted(Source::all(node, place, labels, reader)?, node, reader)?;
    for source in &mut sources {
        // MCX ignores the focus of other sources.
        if !FOCUSED.contains(&&*kind) && !matches!(source.rays, Rays::Angles(..)) {
            source.rays = Rays::Parallel;
        }
    }
    if kind == "pencilarray" && sources.iter().any(|s| s.rays != Rays::Parallel) {
        let message = "a pencilarray has no focus: set the fourth number of Dir to 0, and leave out AngleInverseCDF";
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
        let (plugin, image) = match pattern {
            Some(pattern) => {
                let across = Across::parallelogram(self, pattern.sides, unit)?;
                let mut plugin = across.emitter(&self.rays, power, unit);
                plugin["texture"] = json!({
                    "type": "bitmap", "filter_type": pattern.filter, "wrap_mode": "clamp",
                });
                (plugin, Some(pattern.image))
            }
            None => (self.plain(kind, power, unit)?, None),
        };
        Ok(Emitter { plugin, image })
    }

    /// Makes an emitter without an image.
    fn plain(&self, kind: &str, power: f64, unit: f64) -> Result<Value, String> {
        let point = || Across::point(self, unit);
        let (across, rays) = match kind {
            "isotropic" if self.rays == Rays::Parallel => {
                return Ok(json!({
                    "type": "point",
                    "position": (self.position * unit).to_array(),
                    "intensity": power / (4.0 * PI),
                }));
            }
            "cone" if self.rays == Rays::Parallel && self.second_of_first() == 0.0 => {
                return self.cone(power, unit);
            }
            "cone" if self.rays == Rays::Parallel => {
                let angle = self.half_angle()?.to_degrees();
                (point(), Rays::quantiles(vec![0.0, angle.min(180.0)]))
            }
            "arcsine" if self.rays == Rays::Parallel => {
                (point(), Rays::quantiles(vec![0.0, 180.0]))
            }
            "zgaussian" if self.rays == Rays::Parallel => {
                let width = self.first[0];
                if !(MIN_DEVIATION..=MAX_DEVIATION).contains(&width) {
                    return Err(format!(
                        "the first number of Param1 must be the standard deviation of its angle, {MIN_DEVIATION} to {MAX_DEVIATION} radians, but it is {width}"
                    ));
                }
                (point(), Rays::gaussian(width))
            }
            "pencil" | "isotropic" | "cone" | "arcsine" | "zgaussian" => {
                (point(), self.rays.clone())
            }
            "disk" | "ring" | "gaussian" => (Across::round(self, kind, unit)?, self.rays.clone()),
            "planar" => (
                Across::parallelogram(self, self.sides(), unit)?,
                self.rays.clone(),
            ),
            "slit" => (Across::slit(self, unit)?, self.rays.clone()),
            "line" if self.rays == Rays::Parallel => return self.line(power, unit),
            "line" => return Err("a line has its own angles: leave out AngleInverseCDF".to_owned()),
            _ => {
                return Err(
                    "sources are pencil, pencilarray, isotropic, cone, arcsine, zgaussian, gaussian, disk, ring, planar, pattern, fourier, \
                     fourierx, fourierx2d, slit and line; for others write a scene (docs/guides/tissue-optics.md#sources)"
                        .to_owned(),
                );
            }
        };
        if kind == "slit"
            && let Some(slopes) = self.slopes()?
        {
            return Ok(across.with_slopes(slopes, power));
        }
        Ok(across.emitter(&rays, power, unit))
    }

    /// Returns the second number of `Param1`.
    fn second_of_first(&self) -> f64 {
        self.first[1]
    }

    /// Returns the half angle of a cone, in radians.
    fn half_angle(&self) -> Result<f64, String> {
        let angle = self.first[0];
        if angle > 0.0 && angle <= PI {
            Ok(angle)
        } else {
            Err(
                "the first number of Param1 must be its half angle, above 0 and at most pi radians"
                    .into(),
            )
        }
    }

    /// Makes an emitter with constant intensity within a half angle.
    fn cone(&self, power: f64, unit: f64) -> Result<Value, String> {
        let angle = self.half_angle()?;
        let x = self.direction.any_orthonormal_vector();
        Ok(json!({
            "type": "spot", "cutoff_angle": angle.to_degrees(), "beam_width": angle.to_degrees(),
            "intensity": power / (2.0 * PI * (1.0 - angle.cos())),
            "to_world": frame(self.direction, x, self.position * unit),
        }))
    }

    /// Makes an emitter of light perpendicular to a line, in all directions or within an angle from
    /// the plane of the line and the direction.
    fn line(&self, power: f64, unit: f64) -> Result<Value, String> {
        let angle = self.second[0];
        let is_wedge = angle > 0.0;
        if !(0.0..=PI).contains(&angle) {
            return Err(format!(
                "the first number of Param2 must be the half angle of its wedge, 0 (none) to pi radians, but it is {angle}"
            ));
        }
        let line = self.sides()[0];
        let along = line.try_normalize().ok_or(NO_LINE)?;
        let across = self.direction.reject_from_normalized(along);
        let z = if across.length() > MAX_SKEW_COSINE {
            across.normalize()
        } else if is_wedge {
            return Err("Param1 of a wedge must not be parallel to Dir".to_owned());
        } else {
            along.any_orthonormal_vector()
        };
        let edge = if is_wedge { angle.to_degrees() } else { 180.0 };
        Ok(json!({
            "type": "fiber", "angular_profile": "fan", "cutoff_angle": edge.min(180.0),
            "profile": "rectangle", "width": line.length() * unit, "height": MIN_WIDTH * unit,
            "power": power,
            "to_world": frame(z, along, (self.position + 0.5 * line) * unit),
        }))
    }

    /// Returns the standard deviations of the slopes of a broadened slit, along the line and across
    /// it; `None` without broadening.
    fn slopes(&self) -> Result<Option<[f64; 2]>, String> {
        let [across, along, ..] = self.second;
        if across <= 0.0 && along <= 0.0 {
            return Ok(None);
        }
        if self.rays != Rays::Parallel {
            return Err(
                "Param2 broadens the slit, which a focus or AngleInverseCDF replaces: set Param2 to 0"
                    .to_owned(),
            );
        }
        let line = self.sides()[0];
        if line.dot(self.direction).abs() > MAX_SKEW_COSINE * line.length() {
            return Err("Param1 of a broadened slit must be perpendicular to Dir".to_owned());
        }
        Ok(Some([along, across].map(|v| v.max(MIN_DEVIATION))))
    }
}
