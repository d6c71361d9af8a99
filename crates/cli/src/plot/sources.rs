//! Sources of figures: images, arrays of meters, and statistics of renders.

use super::{Curves, Map, Series};
use crate::command_error::CommandError;
use io::Limits;
use io::diagnostic::shown;
use io::image::{ImageLayers, Layer, exr};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A row or column of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileLine {
    /// Row, from left to right.
    Row(usize),
    /// Column, from top to bottom.
    Column(usize),
}

pub(super) fn wrong(path: &Path, message: impl std::fmt::Display) -> CommandError {
    CommandError::Usage(format!("{}: {message}", shown(path)))
}

fn name_of(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |s| s.to_string_lossy().into_owned())
}

/// Returns the named channel, or by default the mean over all channels.
fn values(layer: &Layer, channel: Option<&str>) -> Result<Vec<f64>, String> {
    let known = || {
        let names: Vec<&str> = layer.channels.iter().map(|(n, _)| n.as_str()).collect();
        names.join(", ")
    };
    match channel {
        Some(name) => {
            let found = layer.channel(name);
            let found =
                found.ok_or_else(|| format!("no channel '{name}': the image has {}", known()))?;
            Ok(found.iter().map(|v| f64::from(*v)).collect())
        }
        None => {
            let count = layer.channels.len().max(1) as f64;
            let pixels = layer.channels.first().map_or(0, |(_, v)| v.len());
            let sum = |i: usize| {
                layer
                    .channels
                    .iter()
                    .map(|(_, v)| f64::from(v[i]))
                    .sum::<f64>()
            };
            Ok((0..pixels).map(|i| sum(i) / count).collect())
        }
    }
}

/// Returns the standard errors of the result of `values`. Channels of an image share paths, so the
/// errors of their mean are added up.
fn errors(image: &ImageLayers, layer: &str, channel: Option<&str>) -> Option<Vec<f64>> {
    let name = match layer {
        "" => "variance".to_owned(),
        _ => format!("variance.{layer}"),
    };
    let mut variance = image.layer(&name)?.clone();
    for (_, values) in &mut variance.channels {
        values.iter_mut().for_each(|v| *v = v.sqrt());
    }
    values(&variance, channel).ok()
}

fn layer_of<'a>(
    path: &Path,
    image: &'a ImageLayers,
    name: &str,
) -> Result<&'a Layer, CommandError> {
    image.layer(name).ok_or_else(|| {
        let names: Vec<&str> = image.layers.iter().map(|l| l.name.as_str()).collect();
        let known: Vec<&str> = names
            .into_iter()
            .filter(|n| !n.is_empty())
            .take(20)
            .collect();
        wrong(
            path,
            format!("no layer '{name}': the image has {}", known.join(", ")),
        )
    })
}

/// Makes curves of values along a line of pixels of several images.
pub fn profile(
    paths: &[PathBuf],
    line: ProfileLine,
    layer: &str,
    channel: Option<&str>,
    limits: Limits,
) -> Result<Curves, CommandError> {
    let mut series = Vec::new();
    for path in paths {
        let image = exr::read_within(path, limits)?;
        let (w, h) = (image.width, image.height);
        let (number, limit) = match line {
            ProfileLine::Row(y) => (y, h),
            ProfileLine::Column(x) => (x, w),
        };
        if number >= limit {
            return Err(wrong(
                path,
                format!("the image has only lines 0 to {}", limit - 1),
            ));
        }
        let values = values(layer_of(path, &image, layer)?, channel).map_err(|e| wrong(path, e))?;
        // With a single sample per pixel, errors are unknown: draw no band.
        let errors = errors(&image, layer, channel).filter(|e| e.iter().all(|e| e.is_finite()));
        let point = |k: usize| {
            let i = match line {
                ProfileLine::Row(y) => y * w + k,
                ProfileLine::Column(x) => k * w + x,
            };
            [k as f64, values[i], errors.as_ref().map_or(0.0, |e| e[i])]
        };
        let length = if matches!(line, ProfileLine::Row(_)) {
            w
        } else {
            h
        };
        series.push(Series {
            name: name_of(path),
            points: (0..length).map(point).collect(),
            guide: false,
        });
    }
    let (along, number) = match line {
        ProfileLine::Row(y) => ("column", format!("row {y}")),
        ProfileLine::Column(x) => ("row", format!("column {x}")),
    };
    Ok(Curves {
        title: format!("Profile along {number}"),
        x: format!("{along} (pixels)"),
        y: quantity(layer, channel),
        logarithmic: false,
        series,
    })
}

/// Makes a map of an image layer in false colours.
pub fn picture(
    path: &Path,
    layer: &str,
    channel: Option<&str>,
    logarithmic: bool,
    limits: Limits,
) -> Result<Map, CommandError> {
    let image = exr::read_within(path, limits)?;
    let values = values(layer_of(path, &image, layer)?, channel).map_err(|e| wrong(path, e))?;
    let edges = |n: usize| (0..=n).map(|i| i as f64).collect();
    // Maps start at the bottom, images at the top.
    let rows = values.chunks(image.width).rev();
    Ok(Map {
        title: quantity(layer, channel),
        x: ("column (pixels)".into(), edges(image.width)),
        y: ("row from the bottom (pixels)".into(), edges(image.height)),
        values: rows.flatten().copied().collect(),
        quantity: unit(layer).into(),
        logarithmic,
    })
}

/// Returns the unit of a quantity of rays, given the name of its layer by the integrator `aov`.
/// Returns an empty text for other layers.
fn unit(layer: &str) -> &'static str {
    match layer {
        "deflection" => "rad",
        "displacement" => "pixels",
        "arc_length"
        | "depth"
        | "exit_position"
        | "optical_length"
        | "optical_path_difference"
        | "position" => "scene units",
        _ => "",
    }
}

fn quantity(layer: &str, channel: Option<&str>) -> String {
    let what = if layer.is_empty() { "radiance" } else { layer };
    match channel {
        Some(channel) => format!("{what}, {channel}"),
        None => what.to_owned(),
    }
}

/// Makes curves of light over optical length or time, for whole images or one of their pixels.
pub fn histogram(
    paths: &[PathBuf],
    pixel: Option<[usize; 2]>,
    channel: Option<&str>,
    limits: Limits,
) -> Result<Curves, CommandError> {
    let mut series = Vec::new();
    let mut axis_name = String::new();
    for path in paths {
        let image = exr::read_within(path, limits)?;
        let axis = bins(&image).ok_or_else(|| {
            let need =
                "no bins of length or time: give the film a 'decomposition', and render to .exr";
            wrong(path, need)
        })?;
        axis_name = axis.name.clone();
        let index = match pixel {
            Some([x, y]) if x < image.width && y < image.height => Some(y * image.width + x),
            Some(_) => {
                let size = format!("the image has {} x {} pixels", image.width, image.height);
                return Err(wrong(path, size));
            }
            None => None,
        };
        let mut points = Vec::new();
        for bin in 0..axis.count {
            let mut sum = 0.0;
            for layer in image.layers.iter().filter(|layer| axis.is_of(bin, layer)) {
                let values = values(layer, channel).map_err(|e| wrong(path, e))?;
                sum += match index {
                    Some(i) => values[i],
                    None => values.iter().sum::<f64>() / values.len() as f64,
                };
            }
            let [a, b] = [bin, bin + 1].map(|i| axis.min + axis.width * i as f64);
            points.extend([[a, sum / axis.width, 0.0], [b, sum / axis.width, 0.0]]);
        }
        series.push(Series {
            name: name_of(path),
            points,
            guide: false,
        });
    }
    let whose = pixel.map_or("the whole image".to_owned(), |[x, y]| {
        format!("pixel ({x}, {y})")
    });
    let x = match axis_name.as_str() {
        "time" => "time",
        _ => "optical path length (scene units)",
    };
    Ok(Curves {
        title: format!("Light of {whose}"),
        x: x.into(),
        y: format!("radiance per unit of {axis_name}"),
        logarithmic: false,
        series,
    })
}

struct BinAxis {
    name: String,
    min: f64,
    width: f64,
    count: usize,
    /// Part name for all of the light, if other layers are components of it: `total` or `S0`.
    whole: Option<&'static str>,
}

impl BinAxis {
    /// Returns true if a layer is part of the light in a bin.
    fn is_of(&self, bin: usize, layer: &Layer) -> bool {
        let of_bin = layer.name.strip_prefix(&format!("{}.{bin:04}", self.name));
        let parts = of_bin.filter(|rest| rest.is_empty() || rest.starts_with('.'));
        parts.is_some_and(|parts| {
            let is_whole = |whole| parts.split('.').any(|part| part == whole);
            self.whole.is_none_or(is_whole)
        })
    }
}

/// Returns the bins in an image's attributes.
fn bins(image: &ImageLayers) -> Option<BinAxis> {
    let axes: Value = serde_json::from_str(image.attribute("decomposition")?).ok()?;
    let axes = axes.as_array()?;
    let axis = axes.iter().find(|a| a["bins"].is_u64())?;
    let wholes = [("tagged", "total"), ("stokes", "S0")];
    let whole = (wholes.iter()).find(|(name, _)| axes.iter().any(|a| a["name"] == *name));
    Some(BinAxis {
        name: axis["name"].as_str()?.to_owned(),
        min: axis["min"].as_f64()?,
        width: axis["width"].as_f64()?,
        count: usize::try_from(axis["bins"].as_u64()?).ok()?,
        whole: whole.map(|(_, whole)| *whole),
    })
}

/// Makes curves of relative standard errors over samples, from `--stats` files.
pub fn convergence(paths: &[PathBuf]) -> Result<Curves, CommandError> {
    let mut series: Vec<Series> = Vec::new();
    for path in paths {
        let text = io::input::read(path).map_err(|e| CommandError::Usage(e.to_string()))?;
        let stats: Value = serde_json::from_slice(&text).map_err(|e| wrong(path, e))?;
        let number = |key: &str| {
            let value = stats[key].as_f64();
            value.ok_or_else(|| {
                wrong(
                    path,
                    format!("no number '{key}': give a file that morgana render --stats wrote"),
                )
            })
        };
        let point = [
            number("spp")?,
            number("standard_error")? / number("mean")?,
            0.0,
        ];
        let name = stats["integrator"].as_str().unwrap_or("render").to_owned();
        match series.iter_mut().find(|s| s.name == name) {
            Some(s) => s.points.push(point),
            None => series.push(Series {
                name,
                points: vec![point],
                guide: false,
            }),
        }
    }
    for s in &mut series {
        s.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    // Add the convergence of independent samples as a guide.
    if let Some([n, e, _]) = series.first().and_then(|s| s.points.first()).copied() {
        let last = series
            .iter()
            .flat_map(|s| &s.points)
            .fold(n, |m, p| m.max(p[0]));
        let end = [last, e * (n / last).sqrt(), 0.0];
        series.push(Series {
            name: "1/√samples".into(),
            points: vec![[n, e, 0.0], end],
            guide: true,
        });
    }
    Ok(Curves {
        title: "Convergence".into(),
        x: "samples per pixel".into(),
        y: "relative standard error of the mean".into(),
        logarithmic: true,
        series,
    })
}
