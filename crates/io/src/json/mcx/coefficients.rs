//! Volumes of coefficients: each voxel has numbers of its own instead of a label.

use super::super::tree::{Json, Node};
use super::labels::Labels;
use super::{node, push};
use crate::element::Element;
use crate::error::Problem;
use crate::input::Limits;
use crate::scene::{Numbers, Tensor};
use serde_json::{Value, json};
use std::sync::Arc;

/// Peak memory per voxel in bytes: numbers as read (16), labels and their parts (14), extinction,
/// albedo and mean cosine, each as read and in the scene (3 × 8).
const BYTES_PER_VOXEL: u64 = 16 + 14 + 24;
/// Maximum number of different indices in a volume.
const MAX_INDICES: usize = 255;

/// Layout of the voxels in a file (`MediaFormat`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MediaFormat {
    /// Labels of 8 bits.
    Byte,
    /// Labels of 16 bits.
    Short,
    /// Labels of 32 bits.
    Integer,
    /// Absorption; all else from medium 1.
    MuaFloat,
    /// Absorption and scattering; all else from medium 1.
    MuamusFloat,
    /// Absorption and scattering per voxel edge in half precision; all else from medium 1.
    MuamusHalf,
    /// Absorption, scattering, mean cosine and index.
    AsgnFloat,
    /// The four properties as fractions of 255 of the way from medium 1 to medium 2.
    AsgnByte,
    /// Absorption and scattering as fractions of 65535 of the way from medium 1 to medium 2.
    MuamusShort,
}

/// All formats with their names and numbers in MCX.
const FORMATS: [(MediaFormat, &str, f64); 9] = [
    (MediaFormat::Byte, "byte", 1.0),
    (MediaFormat::Short, "short", 2.0),
    (MediaFormat::Integer, "integer", 4.0),
    (MediaFormat::AsgnFloat, "asgn_float", 96.0),
    (MediaFormat::MuamusFloat, "muamus_float", 100.0),
    (MediaFormat::MuaFloat, "mua_float", 101.0),
    (MediaFormat::MuamusHalf, "muamus_half", 102.0),
    (MediaFormat::AsgnByte, "asgn_byte", 103.0),
    (MediaFormat::MuamusShort, "muamus_short", 104.0),
];

impl MediaFormat {
    /// Returns the format with a name or a number.
    pub(super) fn of(value: &Node) -> Option<Self> {
        let is = |(_, name, number): &&(MediaFormat, &str, f64)| match &value.json {
            Json::String(text) => text.eq_ignore_ascii_case(name),
            _ => value.number() == Some(*number),
        };
        FORMATS.iter().find(is).map(|(format, ..)| *format)
    }

    /// Returns the type of a number in a file.
    pub(super) fn element(self) -> Element {
        match self {
            MediaFormat::Byte | MediaFormat::AsgnByte => Element::U8,
            MediaFormat::Short | MediaFormat::MuamusShort => Element::U16,
            MediaFormat::Integer => Element::U32,
            MediaFormat::MuamusHalf => Element::F16,
            MediaFormat::MuaFloat | MediaFormat::MuamusFloat | MediaFormat::AsgnFloat => {
                Element::F32
            }
        }
    }

    /// Returns the number of numbers of a voxel.
    pub(super) fn channels(self) -> usize {
        match self {
            MediaFormat::Byte
            | MediaFormat::Short
            | MediaFormat::Integer
            | MediaFormat::MuaFloat => 1,
            MediaFormat::MuamusFloat | MediaFormat::MuamusHalf | MediaFormat::MuamusShort => 2,
            MediaFormat::AsgnFloat | MediaFormat::AsgnByte => 4,
        }
    }

    /// Returns true for formats of labels.
    pub(super) fn is_labels(self) -> bool {
        matches!(
            self,
            MediaFormat::Byte | MediaFormat::Short | MediaFormat::Integer
        )
    }
}

/// Media of a file's table, and the unit of length.
pub(super) struct Base<'a> {
    /// Rows of μ_a, μ_s, g and n.
    pub media: &'a Tensor,
    /// Millimetres per voxel.
    pub unit: f64,
    /// Phase function of all voxels, instead of their mean cosine.
    pub phase: Option<&'a Value>,
    pub limits: Limits,
}

impl Base<'_> {
    fn medium(&self, label: usize) -> Result<[f64; 4], Problem> {
        let row = self.media.rows::<4>()?;
        row.get(label).copied().ok_or_else(|| {
            Problem::Malformed(format!("this MediaFormat needs a medium {label} in Media"))
        })
    }
}

/// Coefficients of all voxels. Voxels of equal index have equal labels; label 0 is outside.
pub(super) struct Coefficients {
    pub labels: Labels,
    /// Index of each label from 1 on.
    indices: Vec<f64>,
    extinction: Vec<f32>,
    albedo: Vec<f32>,
    scattering: Scattering,
}

/// Distribution of the scattering angle.
enum Scattering {
    /// Phase function of all voxels.
    Phase(Value),
    /// Henyey–Greenstein with a constant mean cosine.
    Uniform(f64),
    /// Henyey–Greenstein with a mean cosine for each voxel.
    Voxels(Vec<f32>),
}

impl Coefficients {
    /// Converts the numbers of voxels. `numbers` has all numbers of a voxel next to each other, and
    /// x fastest. Voxels that are not numbers are outside; in formats of integers and of half
    /// precision, voxels whose numbers are all 0 are outside, too.
    ///
    /// # Errors
    /// Numbers beyond their range, more than 255 indices, and too much memory.
    pub(super) fn new(
        format: MediaFormat,
        size: [usize; 3],
        numbers: &[f32],
        base: &Base,
    ) -> Result<Self, Problem> {
        let count = numbers.len() / format.channels();
        base.limits.check(count as u64, BYTES_PER_VOXEL, 0)?;
        let first = base.medium(1)?;
        let second = match format {
            MediaFormat::AsgnByte | MediaFormat::MuamusShort => base.medium(2)?,
            _ => first,
        };
        let scattering = match (base.phase, format.channels()) {
            (Some(phase), _) => Scattering::Phase(phase.clone()),
            (None, 4) => Scattering::Voxels(Vec::with_capacity(count)),
            _ if first[2] == 1.0 => Scattering::Uniform(0.0),
            _ => Scattering::Uniform(first[2]),
        };
        let mut found = Coefficients {
            labels: Labels {
                size,
                data: Vec::with_capacity(count),
            },
            indices: Vec::new(),
            extinction: Vec::with_capacity(count),
            albedo: Vec::with_capacity(count),
            scattering,
        };
        for (i, voxel) in numbers.chunks_exact(format.channels()).enumerate() {
            let row = row(format, voxel, [first, second], base.unit);
            let row = row.map(|row| checked(row, i, size)).transpose()?;
            found.add(row)?;
        }
        Ok(found)
    }

    /// Adds a voxel; `None` is outside.
    fn add(&mut self, row: Option<[f64; 4]>) -> Result<(), Problem> {
        let [mu_a, mu_s, g, n] = row.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        // With g = 1 scattering does not change the direction, unless a phase function replaces g.
        let is_straight = g == 1.0 && !matches!(self.scattering, Scattering::Phase(_));
        let (mu_s, g) = if is_straight { (0.0, 0.0) } else { (mu_s, g) };
        let total = mu_a + mu_s;
        let label = match row {
            Some(_) => self.label(n)?,
            None => 0,
        };
        self.labels.data.push(label as f32);
        self.extinction.push(total as f32);
        let albedo = if total > 0.0 { mu_s / total } else { 0.0 };
        self.albedo.push(albedo as f32);
        if let Scattering::Voxels(numbers) = &mut self.scattering {
            numbers.push(g as f32);
        }
        Ok(())
    }

    /// Returns the label of an index.
    fn label(&mut self, n: f64) -> Result<usize, Problem> {
        if let Some(known) = self.indices.iter().position(|other| *other == n) {
            return Ok(known + 1);
        }
        if self.indices.len() == MAX_INDICES {
            return Err(Problem::Unsupported(format!(
                "a volume with more than {MAX_INDICES} refractive indices: round them, or give a smooth index as the 'ior' of a \
                 medium (docs/scene/ior.md)"
            )));
        }
        self.indices.push(n);
        Ok(self.indices.len())
    }

    /// Adds labels and media to the object `tissue`, with edges of the volume in millimetres;
    /// `None` if there are no voxels.
    pub(super) fn add_to(self, tissue: &mut Node, edges: [f64; 3]) -> Option<()> {
        let [x, y, z] = self.labels.size;
        let grid = |data: Vec<f32>| {
            let value = json!({
                "type": "gridvolume", "filter_type": "nearest", "to_world": [{"scale": edges}],
            });
            let mut grid = node(value, &tissue.location);
            let data = Tensor::new(vec![z, y, x], Numbers::Single(data)).ok()?;
            push(&mut grid, "data", Json::Tensor(Arc::new(data)));
            Some(grid.json)
        };
        let henyey_greenstein = |g: Json| {
            let mut phase = node(json!({"type": "hg"}), &tissue.location);
            push(&mut phase, "g", g);
            phase
        };
        let phase = match self.scattering {
            Scattering::Phase(phase) => node(phase, &tissue.location),
            Scattering::Uniform(g) => henyey_greenstein(Json::Float(g)),
            Scattering::Voxels(numbers) => henyey_greenstein(grid(numbers)?),
        };
        let [extinction, albedo] = [grid(self.extinction)?, grid(self.albedo)?];
        let mut media = Vec::with_capacity(self.indices.len());
        for n in self.indices {
            let medium = json!({"type": "heterogeneous", "ior": n});
            let mut medium = node(medium, &tissue.location);
            push(&mut medium, "sigma_t", extinction.clone());
            push(&mut medium, "albedo", albedo.clone());
            push(&mut medium, "phase", phase.json.clone());
            media.push(medium.json);
        }
        for (i, medium) in media.into_iter().enumerate() {
            push(tissue, &(i + 1).to_string(), medium);
        }
        push(tissue, "data", Json::Tensor(self.labels.into_tensor()?));
        Some(())
    }
}

/// Returns μ_a, μ_s, g and n of a voxel per millimetre; `None` outside.
fn row(
    format: MediaFormat,
    voxel: &[f32],
    [first, second]: [[f64; 4]; 2],
    unit: f64,
) -> Option<[f64; 4]> {
    let [_, mu_s, g, n] = first;
    let at = |i: usize| f64::from(voxel[i]);
    let mixed = |i: usize, range: f64| first[i] + at(i) / range * (second[i] - first[i]);
    if voxel.iter().any(|v| v.is_nan()) {
        return None;
    }
    let is_zero = voxel.iter().all(|v| *v == 0.0);
    match format {
        MediaFormat::AsgnByte | MediaFormat::MuamusShort | MediaFormat::MuamusHalf if is_zero => {
            None
        }
        MediaFormat::Byte | MediaFormat::Short | MediaFormat::Integer => None,
        MediaFormat::MuaFloat => Some([at(0), mu_s, g, n]),
        MediaFormat::MuamusFloat => Some([at(0), at(1), g, n]),
        MediaFormat::MuamusHalf => Some([at(0) / unit, at(1) / unit, g, n]),
        MediaFormat::AsgnFloat => Some([at(0), at(1), at(2), at(3)]),
        MediaFormat::AsgnByte => Some([0, 1, 2, 3].map(|i| mixed(i, 255.0))),
        MediaFormat::MuamusShort => Some([mixed(0, 65535.0), mixed(1, 65535.0), g, n]),
    }
}

/// Checks the ranges of a voxel's numbers.
fn checked(row: [f64; 4], index: usize, size: [usize; 3]) -> Result<[f64; 4], Problem> {
    let [mu_a, mu_s, g, n] = row;
    let wrong = match row {
        _ if !(mu_a >= 0.0 && mu_a.is_finite()) => ("mua", mu_a, "at least 0"),
        _ if !(mu_s >= 0.0 && mu_s.is_finite()) => ("mus", mu_s, "at least 0"),
        _ if !(g > -1.0 && g <= 1.0) => ("g", g, "above -1 and at most 1"),
        _ if !crate::schema::NumberRange::INDEX.contains(n) => ("n", n, "from 0.001 to 1000"),
        _ => return Ok(row),
    };
    let place = crate::volume::place(size, 1, index);
    Err(Problem::Malformed(format!(
        "{} is {} at {place}, but must be {}",
        wrong.0, wrong.1, wrong.2
    )))
}
