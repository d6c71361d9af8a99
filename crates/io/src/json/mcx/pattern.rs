//! Images that modulate the light of sources: patterns and waves in space
//! (docs/guides/tissue-optics.md#input-of-mcx).

use super::super::tree::{Json, Node};
use super::source::Source;
use super::{Reader, field, jdata, numbers};
use crate::element::Element;
use crate::input;
use crate::scene::{Numbers, Tensor};
use glam::DVec3;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Pixels per period of a wave. Linear interpolation between pixel centres reduces the modulation
/// by (π/64)²/3 = 0.08 %.
const PIXELS_PER_PERIOD: f64 = 64.0;
/// Largest number of pixels of a wave.
const MAX_PIXELS: f64 = 4_194_304.0;

/// Relative irradiance across a source.
pub(super) struct Pattern {
    /// Sides of the parallelogram, in voxels.
    pub sides: [DVec3; 2],
    /// Image; columns run along the first side, rows along the second.
    pub image: Arc<Tensor>,
    pub filter: &'static str,
    /// Mean of the image.
    pub mean: f64,
}

/// Returns the pattern of a source of this kind, if it has one.
pub(super) fn of(
    kind: &str,
    source: &Source,
    node: &Node,
    reader: &mut Reader,
) -> Result<Option<Pattern>, String> {
    let found = match kind {
        "pattern" => {
            let image = given(source, node, reader)?;
            Pattern::new(source.sides(), image, "nearest")?
        }
        "fourier" | "fourierx" | "fourierx2d" => {
            let wave = Wave::of(kind, source);
            Pattern::new(wave.sides, wave.image()?, "bilinear")?
        }
        _ => return Ok(None),
    };
    Ok(Some(found))
}

impl Pattern {
    fn new(
        sides: [DVec3; 2],
        (size, values): ([usize; 2], Vec<f32>),
        filter: &'static str,
    ) -> Result<Self, String> {
        if let Some(wrong) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(format!(
                "the Pattern has the value {wrong}, but values must be at least 0"
            ));
        }
        let sum: f64 = values.iter().map(|v| f64::from(*v)).sum();
        if sum == 0.0 {
            return Err("all values of its Pattern are 0: give a value above 0".to_owned());
        }
        let mean = sum / values.len() as f64;
        let [columns, rows] = size;
        let image = Tensor::new(vec![rows, columns], Numbers::Single(values));
        let image = Arc::new(image.map_err(|e| e.to_string())?);
        Ok(Pattern {
            sides,
            image,
            filter,
            mean,
        })
    }
}

/// Returns the pattern from a file or a program: columns and rows, and values row by row.
fn given(
    source: &Source,
    node: &Node,
    reader: &mut Reader,
) -> Result<([usize; 2], Vec<f32>), String> {
    let [columns, rows] = [source.first[3], source.second[3]];
    let whole = |v: f64| v.fract() == 0.0 && (1.0..=65536.0).contains(&v);
    if !whole(columns) || !whole(rows) {
        return Err("the fourth numbers of Param1 and Param2 must be the numbers of columns and rows, at least 1".to_owned());
    }
    let size = [columns, rows].map(|v| v as usize);
    let Some(pattern) = field(node, "Pattern") else {
        return Err("it needs a Pattern".to_owned());
    };
    let stated = reader.number_or(node, "SrcNum", 1.0);
    if !whole(stated) {
        return Err(format!(
            "SrcNum must be its number of patterns, at least 1, but it is {stated}"
        ));
    }
    let patterns = Patterns::read(pattern, stated as usize, size, reader)?;
    let number = chosen(node, patterns.count, reader)?;
    Ok((size, patterns.one(number)))
}

/// Returns the pattern that a file selects by `PatternID`, counted from 0.
fn chosen(node: &Node, count: usize, reader: &mut Reader) -> Result<usize, String> {
    let id = reader.number_or(node, "PatternID", 0.0);
    match id {
        0.0 if count == 1 => Ok(0),
        0.0 => Err(format!(
            "it has {count} patterns (SrcNum): morgana mcx runs all of them; otherwise choose one by PatternID, from 1 to {count}"
        )),
        _ if id.fract() == 0.0 && (1.0..=count as f64).contains(&id) => Ok(id as usize - 1),
        _ => Err(format!(
            "PatternID must be the number of a pattern from 1 to {count}, but it is {id}"
        )),
    }
}

/// Patterns of equal size.
struct Patterns {
    count: usize,
    /// Values of all patterns; patterns run fastest, then columns.
    values: Vec<f32>,
}

impl Patterns {
    /// Reads patterns with a number of columns and rows. `stated` is the number of patterns, or 1 if
    /// an array may state another number.
    fn read(
        pattern: &Node,
        stated: usize,
        [columns, rows]: [usize; 2],
        reader: &mut Reader,
    ) -> Result<Self, String> {
        const UNREADABLE: &str = "its Pattern cannot be read";
        let of_shape = |shape: &[usize]| match *shape {
            [count, _, _] if stated == 1 => count,
            _ => stated,
        };
        let (count, values) = match &pattern.json {
            Json::Tensor(_) | Json::Array(_) => {
                let array = reader.array(pattern).ok_or(UNREADABLE)?;
                let count = of_shape(array.shape());
                (count, transposed(&array, [count, columns, rows])?)
            }
            _ if jdata::is_one(pattern) => {
                let array = jdata::array(pattern, reader).ok_or(UNREADABLE)?.tensor;
                let values = array.iter().map(|v| v as f32).collect();
                (of_shape(array.shape()), values)
            }
            _ => (stated, listed(pattern, reader)?),
        };
        if values.len() == count * columns * rows {
            return Ok(Patterns { count, values });
        }
        let (several, by) = match count {
            1 => (String::new(), "Param1 and Param2"),
            _ => (format!("{count} x "), "SrcNum, Param1 and Param2"),
        };
        Err(format!(
            "its Pattern has {} values, but {by} state {several}{columns} x {rows}",
            values.len()
        ))
    }

    /// Returns the values of a pattern, row by row.
    fn one(self, number: usize) -> Vec<f32> {
        if self.count == 1 {
            return self.values;
        }
        let values = self.values.into_iter().skip(number);
        values.step_by(self.count).collect()
    }
}

/// Returns the values of an array `[column, row]` or `[pattern, column, row]`; patterns run fastest,
/// then columns.
fn transposed(tensor: &Tensor, [count, columns, rows]: [usize; 3]) -> Result<Vec<f32>, String> {
    let all = [count, columns, rows];
    let is_right = tensor.shape() == all || (count == 1 && tensor.shape() == [columns, rows]);
    if !is_right {
        let stated = if count == 1 { &all[1..] } else { &all[..] };
        return Err(format!(
            "its Pattern has the shape {:?}, but Param1, Param2 and SrcNum state {stated:?}",
            tensor.shape()
        ));
    }
    let value = |i: usize| {
        let (pattern, pixel) = (i % count, i / count);
        tensor.get((pattern * columns + pixel % columns) * rows + pixel / columns) as f32
    };
    Ok((0..tensor.len()).map(value).collect())
}

/// Returns values that are listed, or stored in a file in single precision.
fn listed(pattern: &Node, reader: &mut Reader) -> Result<Vec<f32>, String> {
    reader.known(pattern, &["Nx", "Ny", "Nz", "Data"], &[]);
    let Some(data) = field(pattern, "Data") else {
        return Err("its Pattern needs Data".to_owned());
    };
    if let Some(values) = numbers(data) {
        return Ok(values.iter().map(|v| *v as f32).collect());
    }
    let Json::String(name) = &data.json else {
        return Err("Data of its Pattern must be numbers, or the name of a file".to_owned());
    };
    let path = data.location.source().directory().join(name);
    let bytes = input::read(&path).map_err(|e| e.to_string())?;
    let mut values = Vec::with_capacity(bytes.len() / 4);
    Element::F32.decode(&bytes, &mut |v| values.push(v as f32));
    Ok(values)
}

/// A wave ½ (1 + M cos 2π(f · (x, y) + φ)), or with a product of two sines instead of the cosine.
struct Wave {
    sides: [DVec3; 2],
    frequencies: [f64; 2],
    phases: [f64; 2],
    modulation: f64,
    is_product: bool,
}

impl Wave {
    fn of(kind: &str, source: &Source) -> Self {
        let [p, q] = [source.first, source.second];
        if kind == "fourier" {
            return Wave {
                sides: source.sides(),
                frequencies: [p[3].floor(), q[3].floor()],
                phases: [p[3] - p[3].floor(), 0.0],
                modulation: 1.0 - (q[3] - q[3].floor()),
                is_product: false,
            };
        }
        let [first, _] = source.sides();
        let second = source.direction.cross(first.normalize_or_zero()) * p[3];
        let is_product = kind == "fourierx2d";
        Wave {
            sides: [first, second],
            frequencies: [q[0], q[1]],
            phases: if is_product {
                [q[2], q[3]]
            } else {
                [q[2], 0.0]
            },
            modulation: if is_product { 1.0 } else { 1.0 - q[3] },
            is_product,
        }
    }

    /// Returns columns and rows, and the values at pixel centres.
    fn image(&self) -> Result<([usize; 2], Vec<f32>), String> {
        if self.modulation.abs() > 1.0 {
            return Err("its modulation must be between 0 and 1".to_owned());
        }
        let size = self
            .frequencies
            .map(|f| (f.abs() * PIXELS_PER_PERIOD).ceil().max(1.0));
        if size[0] * size[1] > MAX_PIXELS {
            return Err(format!(
                "at {PIXELS_PER_PERIOD} pixels per period its image would have {} x {} pixels, more than {MAX_PIXELS}",
                size[0], size[1]
            ));
        }
        let [columns, rows] = size.map(|n| n as usize);
        let value = |i: usize| {
            let x = ((i % columns) as f64 + 0.5) / size[0];
            let y = ((i / columns) as f64 + 0.5) / size[1];
            self.at([x, y]) as f32
        };
        Ok(([columns, rows], (0..columns * rows).map(value).collect()))
    }

    fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let [f, g] = self.frequencies;
        let [a, b] = self.phases;
        let wave = if self.is_product {
            (TAU * (f * x + a)).sin() * (TAU * (g * y + b)).sin()
        } else {
            (TAU * (f * x + g * y + a)).cos()
        };
        0.5 * (1.0 + self.modulation * wave)
    }
}
