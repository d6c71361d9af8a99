//! Files of detected photons.

use crate::command_error::CommandError;
use io::element::Element;
use io::jdata::{JdataValue, PackedArray};
use io::{FileError, atomic};
use std::io::Write;
use std::path::Path;
use transport::meter::RecordTable;

/// Letters of the columns, in the order of their bits.
const LETTERS: &str = "DSPMXVW";
/// Names of the columns in JData files.
const NAMES: [&str; 7] = ["detid", "nscat", "ppath", "mom", "p", "v", "w0"];
/// Bit of the column of weights. It is always written, because weights of photons differ.
const WEIGHT: u32 = 64;
/// Distance from a side of the volume, in voxels, at which light leaves through the side.
const FACE: f64 = 1e-6;
/// Size of the header of a history file, in bytes.
const HEADER: usize = 64;

/// Requested columns (option -w), as bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Columns(u32);

impl Columns {
    /// Reads letters, or the sum of bits. `exit` adds positions and directions, and `momentum`
    /// momentum transfers.
    ///
    /// # Errors
    /// Unknown letters.
    pub(super) fn of(
        mask: &serde_json::Value,
        exit: bool,
        momentum: bool,
    ) -> Result<Self, CommandError> {
        let mut bits = WEIGHT;
        if let Some(sum) = mask.as_u64() {
            bits |= sum as u32 & 127;
        }
        for letter in mask.as_str().unwrap_or("").to_ascii_uppercase().chars() {
            let bit = LETTERS.find(letter).ok_or_else(|| {
                CommandError::Usage(format!(
                    "SaveDataMask (-w) {letter}: give letters of D (detector), S (scattering events), P (path lengths), M \
                     (momentum transfer), X (position), V (direction) and W (weight)"
                ))
            })?;
            bits |= 1 << bit;
        }
        bits |= if exit { 16 + 32 } else { 0 };
        bits |= if momentum { 8 } else { 0 };
        Ok(Columns(bits))
    }

    fn has(self, column: usize) -> bool {
        self.0 >> column & 1 == 1
    }
}

/// Records of a detector.
pub(super) struct Detector<'a> {
    /// Number of the detector; −1 for sides of the volume.
    pub number: f64,
    pub table: &'a RecordTable,
    /// Sides of the volume of which records count, if not all do.
    pub faces: Option<[bool; 6]>,
}

/// Detected photons of all detectors.
pub(super) struct Photons<'a> {
    pub columns: &'a Columns,
    pub detectors: Vec<Detector<'a>>,
    /// Rows of μ_a, μ_s, g and n.
    pub media: &'a [[f64; 4]],
    /// Number of voxels along x, y, z.
    pub size: [usize; 3],
    /// Millimetres per voxel.
    pub unit: f64,
    /// Number of photons of the run.
    pub particles: u64,
}

impl Photons<'_> {
    /// Returns the number of media without the outside.
    fn media_count(&self) -> usize {
        self.media.len().saturating_sub(1).max(1)
    }

    /// Returns the number of numbers of a column.
    fn width(&self, column: usize) -> usize {
        match column {
            1..=3 => self.media_count(),
            4 | 5 => 3,
            _ => 1,
        }
    }

    /// Returns the rows of all columns, photon by photon.
    fn rows(&self) -> Vec<[Vec<f64>; 7]> {
        let mut rows = Vec::new();
        for Detector {
            number,
            table,
            faces,
        } in &self.detectors
        {
            for i in 0..table.particle.len() {
                let position = [0, 1, 2].map(|axis| table.position[3 * i + axis]);
                let direction = [0, 1, 2].map(|axis| table.direction[3 * i + axis]);
                let is_wanted = faces.is_none_or(|faces| self.is_on(faces, position));
                if table.side[i] != 0.0 || !is_wanted {
                    continue;
                }
                let media = |values: &[f64], scale: f64| self.by_medium(table, values, i, scale);
                let weight = table.weight[i] * table.particles as f64 / transmitted(table, i);
                rows.push([
                    vec![*number],
                    media(&table.scatterings, 1.0),
                    media(&table.path_length, 1.0 / self.unit),
                    media(&table.momentum_transfer, 1.0),
                    position.map(|x| x / self.unit).to_vec(),
                    direction.to_vec(),
                    vec![weight],
                ]);
            }
        }
        rows
    }

    /// Returns true if a position is on one of the chosen sides of the volume: −x, −y, −z, +x, +y,
    /// +z.
    fn is_on(&self, faces: [bool; 6], position: [f64; 3]) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= FACE * self.unit;
        (0..3).any(|axis| {
            let end = self.size[axis] as f64 * self.unit;
            faces[axis] && near(position[axis], 0.0) || faces[axis + 3] && near(position[axis], end)
        })
    }

    /// Returns the values of a record by medium, from medium 1 on.
    fn by_medium(&self, table: &RecordTable, values: &[f64], i: usize, scale: f64) -> Vec<f64> {
        let mut found = vec![0.0; self.media_count()];
        let count = table.regions.len();
        for (r, region) in table.regions.iter().enumerate() {
            let label = region.name.rsplit("label ").next();
            let label = label.and_then(|label| label.parse::<usize>().ok());
            if let Some(sum) = label.and_then(|l| found.get_mut(l.wrapping_sub(1))) {
                *sum += values[i * count + r] * scale;
            }
        }
        found
    }

    /// Returns the tree of a JData file.
    ///
    /// # Errors
    /// Too many numbers.
    pub(super) fn value(&self) -> Result<JdataValue, CommandError> {
        let rows = self.rows();
        let mut data = Vec::new();
        for column in (0..NAMES.len()).filter(|c| self.columns.has(*c)) {
            let element = if column < 2 {
                Element::U32
            } else {
                Element::F32
            };
            let shape = vec![rows.len(), self.width(column)];
            let numbers = rows.iter().flat_map(|row| row[column].iter().copied());
            // MCX has the number −1 as an unsigned integer.
            let unsigned = |v: f64| if v < 0.0 { f64::from(u32::MAX) } else { v };
            let numbers = numbers.map(|v| {
                if element == Element::U32 {
                    unsigned(v)
                } else {
                    v
                }
            });
            let packed = PackedArray::new(element, shape, false, numbers);
            let packed = packed.map_err(|e| CommandError::Runtime(e.to_string()))?;
            data.push((NAMES[column].to_owned(), JdataValue::Packed(packed)));
        }
        let number = |v: usize| JdataValue::Number(v as f64);
        let medium = |[mua, mus, g, n]: &[f64; 4]| {
            JdataValue::object(
                [("mua", mua), ("mus", mus), ("g", g), ("n", n)]
                    .map(|(k, v)| (k, JdataValue::Number(*v))),
            )
        };
        let info = JdataValue::object([
            ("Version", number(1)),
            ("MediaNum", number(self.media_count())),
            ("DetNum", number(self.detector_count())),
            ("ColumnNum", number(self.width_of_row())),
            ("TotalPhoton", JdataValue::Number(self.particles as f64)),
            ("DetectedPhoton", number(rows.len())),
            ("SavedPhoton", number(rows.len())),
            ("LengthUnit", JdataValue::Number(self.unit)),
            ("SeedByte", number(0)),
            ("Normalizer", number(1)),
            ("Repeat", number(1)),
            ("SrcNum", number(1)),
            ("SaveDetFlag", number(self.columns.0 as usize)),
            ("TotalSource", number(1)),
            (
                "Media",
                JdataValue::List(self.media.iter().map(medium).collect()),
            ),
        ]);
        let content =
            JdataValue::object([("Info", info), ("PhotonData", JdataValue::Object(data))]);
        Ok(JdataValue::object([("MCXData", content)]))
    }

    fn detector_count(&self) -> usize {
        self.detectors.iter().filter(|d| d.number > 0.0).count()
    }

    fn width_of_row(&self) -> usize {
        let columns = (0..NAMES.len()).filter(|c| self.columns.has(*c));
        columns.map(|column| self.width(column)).sum()
    }

    /// Writes a history file (.mch): a header of 64 bytes, and a row of numbers for each photon.
    ///
    /// # Errors
    /// All errors of [`atomic::write`].
    pub(super) fn write_history(&self, path: &Path) -> Result<(), FileError> {
        let rows = self.rows();
        let mut header = b"MCXH".to_vec();
        let mut word = |v: u64| header.extend((v.min(u64::from(u32::MAX)) as u32).to_le_bytes());
        for v in [
            1,
            self.media_count(),
            self.detector_count(),
            self.width_of_row(),
        ] {
            word(v as u64);
        }
        word(self.particles);
        word(rows.len() as u64);
        word(rows.len() as u64);
        word(u64::from((self.unit as f32).to_bits()));
        word(0);
        word(u64::from(1f32.to_bits()));
        for v in [1, 1, u64::from(self.columns.0), 1] {
            word(v);
        }
        header.resize(HEADER, 0);
        atomic::write(path, |file| {
            file.write_all(&header)?;
            for row in &rows {
                for column in (0..NAMES.len()).filter(|c| self.columns.has(*c)) {
                    for v in &row[column] {
                        file.write_all(&(*v as f32).to_le_bytes())?;
                    }
                }
            }
            Ok(())
        })
    }
}

/// Returns the fraction of light that absorption along a record's path leaves. Regions of unknown
/// absorption count as transparent.
fn transmitted(table: &RecordTable, i: usize) -> f64 {
    let count = table.regions.len();
    let regions = table.regions.iter().enumerate();
    let depth: f64 = regions
        .map(|(r, region)| {
            let absorption = region.absorption.as_ref().and_then(|a| a.first());
            let path = table.path_length[i * count + r];
            absorption.map_or(0.0, |a| if path > 0.0 { a * path } else { 0.0 })
        })
        .sum();
    (-depth).exp()
}
