//! Output of a session: names, quantities and formats of files, as MCX writes them.

use super::options::{CommandLine, set, take};
use super::photons::{Columns, Detector, Photons};
use crate::command_error::{CommandError, warn};
use io::Loaded;
use io::arrays::{Array, Context, list};
use io::element::Element;
use io::jdata::{JdataForm, PackedArray};
use io::volume::VolumeFrame;
use io::volume::jnifti::JniftiImage;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use transport::render::Measurement;

/// Quantity of the volume (option -O).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    /// Fluence rate per joule, in 1/(mm² s).
    Flux,
    /// Fluence per joule, in 1/mm².
    Fluence,
    /// Deposited energy of a voxel, per joule.
    Energy,
    /// Complex fluence rate of modulated light, per joule, in 1/(mm² s).
    Modulated,
}

/// Format of files (option -F).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Jnii,
    Bnii,
    Mc2,
}

/// Settings of the output.
pub(super) struct Session {
    /// Beginning of the names of all files.
    name: PathBuf,
    pub seed: u64,
    quantity: Quantity,
    format: Format,
    is_normalized: bool,
    saves_volume: bool,
    saves_reflectance: bool,
    /// Sides that detect light: −x, −y, −z, +x, +y, +z.
    faces: [bool; 6],
    /// Columns of detected photons, if they are written.
    columns: Option<Columns>,
    /// Rows of μ_a, μ_s, g and n.
    media: Vec<[f64; 4]>,
    /// Millimetres per voxel.
    unit: f64,
    /// Start of the first time gate and width of a gate, in seconds.
    gate: [f64; 2],
}

/// Values of the voxels of a run.
pub(super) struct RunVolume {
    /// Numbers of voxels along x, y, z.
    size: [usize; 3],
    /// Values with x fastest, then y, z, time gates, and the real and imaginary parts.
    values: Vec<f64>,
}

/// Results of all runs of an input.
#[derive(Default)]
pub(super) struct Report {
    pub photons: u64,
    /// Texts of the energy balances.
    pub balances: Vec<String>,
    pub volumes: Vec<RunVolume>,
    pub last: Option<(Loaded, Measurement)>,
}

impl Session {
    /// Reads the settings of the output, and removes those from the input that a scene does not
    /// have. Returns notes on settings without effect, too.
    ///
    /// # Errors
    /// Quantities and formats that morgana does not write.
    pub(super) fn take(
        root: &mut Value,
        path: Option<&Path>,
        line: &CommandLine,
    ) -> Result<(Self, Vec<String>), CommandError> {
        let mut notes = Vec::new();
        let unit = number(root, "Domain", "LengthUnit").unwrap_or(1.0);
        let media = media(root);
        let first = number(root, "Forward", "T0").unwrap_or(0.0);
        let last = number(root, "Forward", "T1").unwrap_or(5e-9);
        let width = number(root, "Forward", "Dt").unwrap_or(last - first);
        let mut nothing = serde_json::Map::new();
        let session = section(root, "Session");
        let session = session.unwrap_or(&mut nothing);
        let mut text = |key: &str| match take(session, key) {
            Some(Value::String(text)) => Some(text),
            _ => None,
        };
        let quantity = quantity(&text("OutputType").unwrap_or_else(|| "X".into()))?;
        let format = format(&text("OutputFormat").unwrap_or_else(|| "jnii".into()))?;
        let stem = path.and_then(Path::file_stem).unwrap_or("default".as_ref());
        let id = text("ID").filter(|id| !id.is_empty());
        let id = id.map_or_else(|| PathBuf::from(stem), PathBuf::from);
        let folder = line.root.clone().or_else(|| text("RootPath"));
        let mut flag = |key: &str, default: bool| {
            let value = take(session, key);
            value.map_or(default, |v| v.as_f64() != Some(0.0) && v != json!(false))
        };
        let is_normalized = flag("DoNormalize", true);
        let saves_volume = flag("DoSaveVolume", true);
        let [exit, momentum] = ["DoSaveExit", "DoDCS"].map(|key| flag(key, false));
        let saves_photons = flag("DoPartialPath", true) || exit || momentum;
        let saves_reflectance = flag("DoSaveRef", false);
        let mask = take(session, "SaveDataMask").unwrap_or(json!("DP"));
        let columns = Columns::of(&mask, exit, momentum)?;
        let seed = take(session, "RNGSeed").and_then(|v| v.as_i64());
        let seed = line.seed.or(seed).unwrap_or(0);
        if seed < 0 {
            notes.push("a negative seed counts as 0: equal seeds give equal files".to_owned());
        }
        if quantity == Quantity::Modulated && saves_reflectance {
            let message =
                "DoSaveRef (-X) does not go with OutputType (-O) R: records give modulated light";
            return Err(CommandError::Usage(message.into()));
        }
        let faces = faces(session);
        set(session, "DoPartialPath", json!(u8::from(saves_photons)));
        let needs_surface = saves_reflectance || (saves_photons && faces.contains(&true));
        set(session, "DoSaveRef", json!(u8::from(needs_surface)));
        if line.repeat > 1 {
            let photons = session
                .get("Photons")
                .and_then(Value::as_f64)
                .unwrap_or(1e6);
            set(
                session,
                "Photons",
                json!((photons * line.repeat as f64) as u64),
            );
        }
        let session = Session {
            name: folder.map_or(id.clone(), |folder| Path::new(&folder).join(&id)),
            seed: u64::try_from(seed).unwrap_or(0),
            quantity,
            format,
            is_normalized,
            saves_volume,
            saves_reflectance,
            faces,
            columns: saves_photons.then_some(columns),
            media,
            unit,
            gate: [first, width.min(last - first)],
        };
        Ok((session, notes))
    }

    /// Returns the path of a file with this end.
    pub(super) fn file(&self, end: &str) -> PathBuf {
        let mut name = self.name.clone().into_os_string();
        name.push(end);
        name.into()
    }

    /// Writes all files. Returns their names.
    pub(super) fn write(&self, report: &Report) -> Result<Vec<String>, CommandError> {
        let mut written = Vec::new();
        if self.saves_volume {
            let path = self.write_volume(&report.volumes)?;
            written.push(path.to_string_lossy().into_owned());
        }
        let (Some(columns), Some((loaded, measurement))) = (&self.columns, &report.last) else {
            return Ok(written);
        };
        let detectors = self.detectors(loaded, measurement);
        if detectors.is_empty() {
            return Ok(written);
        }
        if report.balances.len() > 1 {
            warn(
                "detected photons of several patterns are not written: choose one pattern by \
                 -j '{\"Optode\": {\"Source\": {\"PatternID\": 1}}}'",
            );
            return Ok(written);
        }
        let photons = Photons {
            columns,
            detectors,
            media: &self.media,
            size: self.size(loaded, measurement),
            unit: self.unit,
            particles: measurement.particles,
        };
        let path = match self.format {
            Format::Jnii => self.file("_detp.jdat"),
            Format::Bnii => self.file("_detp.jdb"),
            Format::Mc2 => self.file(".mch"),
        };
        match self.format {
            Format::Mc2 => photons.write_history(&path)?,
            Format::Jnii => photons.value()?.write(&path, JdataForm::Text)?,
            Format::Bnii => photons.value()?.write(&path, JdataForm::Binary)?,
        }
        written.push(path.to_string_lossy().into_owned());
        Ok(written)
    }

    /// Returns the tables of detected photons with the numbers of their detectors. Sides of the
    /// volume have the number −1, as in MCX.
    fn detectors<'a>(&self, loaded: &Loaded, measurement: &'a Measurement) -> Vec<Detector<'a>> {
        let named = loaded.instruments.iter().zip(&measurement.records);
        named
            .filter_map(|(instrument, table)| {
                let table = table.as_ref()?;
                if instrument.name == SURFACE {
                    return self.faces.contains(&true).then_some(Detector {
                        number: -1.0,
                        table,
                        faces: Some(self.faces),
                    });
                }
                Some(Detector {
                    number: instrument.name.strip_prefix("detector")?.parse().ok()?,
                    table,
                    faces: None,
                })
            })
            .collect()
    }

    /// Returns the volume of a run, as it is written; `None` if it is not written.
    pub(super) fn volume(
        &self,
        loaded: &Loaded,
        measurement: &Measurement,
    ) -> Result<Option<RunVolume>, CommandError> {
        if !self.saves_volume {
            return Ok(None);
        }
        let mut size = [0; 3];
        let mut values = Vec::new();
        for &(name, sign) in self.quantity.readings() {
            let array = self.reading(name, loaded, measurement, true)?;
            let scale = sign * self.scale(measurement);
            size = self::size(&array);
            values.extend(array.data.iter().map(|v| v * scale));
        }
        if self.saves_reflectance {
            self.add_reflectance(loaded, measurement, size, &mut values);
        }
        Ok(Some(RunVolume { size, values }))
    }

    /// Writes the volumes of all runs to one file.
    fn write_volume(&self, volumes: &[RunVolume]) -> Result<PathBuf, CommandError> {
        let Some(RunVolume { size, values }) = volumes.first() else {
            return Err(CommandError::Runtime("the input has no volume".into()));
        };
        let [x, y, z] = *size;
        let parts = self.quantity.readings().len();
        let of_part = values.len() / parts;
        let gates = of_part / (x * y * z).max(1);
        let path = match self.format {
            Format::Jnii => self.file(".jnii"),
            Format::Bnii => self.file(".bnii"),
            Format::Mc2 => self.file(".mc2"),
        };
        let mut shape = vec![x, y, z, gates, volumes.len()];
        if parts > 1 {
            shape.push(parts);
        }
        let of_all: Vec<f64> = match self.format {
            // Patterns run fastest.
            Format::Mc2 => (0..values.len())
                .flat_map(|i| volumes.iter().map(move |volume| volume.values[i]))
                .collect(),
            _ => (0..parts)
                .flat_map(|part| {
                    let range = part * of_part..(part + 1) * of_part;
                    let volumes = volumes.iter();
                    volumes.flat_map(move |volume| volume.values[range.clone()].iter().copied())
                })
                .collect(),
        };
        let packed = PackedArray::new(Element::F32, shape, true, of_all);
        let packed = packed.map_err(|e| CommandError::Runtime(e.to_string()))?;
        if self.format == Format::Mc2 {
            io::atomic::write_bytes(&path, &packed.bytes)?;
            return Ok(path);
        }
        let edges = [x, y, z].map(|n| n as f64 * self.unit);
        let name = self.name.to_string_lossy();
        let image = JniftiImage {
            values: packed,
            frame: VolumeFrame::of_box([glam::DVec3::ZERO, edges.into()], [x, y, z]),
            steps: &[self.gate[1], 1.0, 1.0][..if parts > 1 { 3 } else { 2 }],
            unit: Some("mm"),
            name: &name,
            description: self.quantity.description(),
        };
        let form = match self.format {
            Format::Bnii => JdataForm::Binary,
            _ => JdataForm::Text,
        };
        image.into_value().write(&path, form)?;
        Ok(path)
    }

    /// Returns the number of voxels along x, y, z.
    fn size(&self, loaded: &Loaded, measurement: &Measurement) -> [usize; 3] {
        let reading = self.reading("fluence", loaded, measurement, false);
        reading.map_or([0; 3], |array| size(&array))
    }

    /// Returns a reading of the voxels, whose last axes are `[gate, z, y, x]` or `[z, y, x]`. Without
    /// `values` it has no elements.
    fn reading(
        &self,
        name: &str,
        loaded: &Loaded,
        measurement: &Measurement,
        values: bool,
    ) -> Result<Array, CommandError> {
        let context = Context {
            instruments: &loaded.instruments,
            measurement,
            channels: &loaded.channel_names,
            meter: None,
        };
        let is_it = |other: &str| other == name || other.strip_prefix("cells.") == Some(name);
        let found = list(&context, &|name| values && is_it(name)).into_iter();
        let mut found = found.filter(|array| is_it(&array.name) && array.shape.len() >= 3);
        found.next().ok_or_else(|| {
            CommandError::Runtime(match self.quantity {
                Quantity::Modulated => {
                    "OutputType (-O) R needs the Frequency of the modulation, in Optode.Source"
                        .into()
                }
                _ => "the input has no volume".into(),
            })
        })
    }

    /// Returns the factor from the reading to the written values.
    fn scale(&self, measurement: &Measurement) -> f64 {
        let voxel = self.unit.powi(3);
        let photons = measurement.particles as f64;
        match (self.quantity, self.is_normalized) {
            (Quantity::Flux | Quantity::Modulated, true) => 1.0 / self.gate[1],
            (Quantity::Fluence, true) => 1.0,
            (Quantity::Energy, true) => voxel,
            // MCX adds up lengths in voxels.
            (Quantity::Flux | Quantity::Fluence | Quantity::Modulated, false) => {
                photons * voxel / self.unit
            }
            (Quantity::Energy, false) => photons * voxel,
        }
    }

    /// Replaces the values of the voxels of label 0 that light enters when it leaves: by the
    /// negative power per area of a voxel's face.
    fn add_reflectance(
        &self,
        loaded: &Loaded,
        measurement: &Measurement,
        size: [usize; 3],
        values: &mut [f64],
    ) {
        let per_weight = match self.quantity {
            Quantity::Energy => 1.0,
            _ => self.unit.powi(-2),
        };
        let scale = match self.quantity {
            Quantity::Energy => self.scale(measurement) / self.unit.powi(3),
            _ => self.scale(measurement),
        };
        let named = loaded.instruments.iter().zip(&measurement.records);
        let tables = named.filter(|(instrument, _)| instrument.name == SURFACE);
        let places: usize = size.iter().product();
        let gates = values.len() / places;
        let mut reflected = vec![0.0; values.len()];
        for table in tables.filter_map(|(_, table)| table.as_ref()) {
            for (i, weight) in table.weight.iter().enumerate() {
                if table.side[i] != 0.0 {
                    continue;
                }
                let part = |list: &[f64]| [0, 1, 2].map(|axis| list[3 * i + axis]);
                let (at, along) = (part(&table.position), part(&table.direction));
                let voxel = [0, 1, 2].map(|a| (at[a] / self.unit + EXIT * along[a]).floor());
                let inside = (0..3).all(|a| voxel[a] >= 0.0 && voxel[a] < size[a] as f64);
                let time = table.optical_length[i] / LIGHT - self.gate[0];
                let gate = (time / self.gate[1]).floor();
                let gate = if gates == 1 { 0.0 } else { gate };
                if inside && gate >= 0.0 && gate < gates as f64 {
                    let [x, y, z] = voxel.map(|v| v as usize);
                    let place = x + size[0] * (y + size[1] * z);
                    reflected[gate as usize * places + place] += weight * per_weight * scale;
                }
            }
        }
        for (value, power) in values.iter_mut().zip(reflected) {
            if power > 0.0 {
                *value = -power;
            }
        }
    }
}

/// Returns the number of voxels along x, y, z of a reading `[..., z, y, x]`.
fn size(array: &Array) -> [usize; 3] {
    match array.shape[..] {
        [.., z, y, x] => [x, y, z],
        _ => [0; 3],
    }
}

/// Name of the meter of all light that leaves.
const SURFACE: &str = "surface";
/// Distance behind a face, in voxels, at which light is in the next voxel.
const EXIT: f64 = 1e-3;
/// Speed of light in millimetres per second.
const LIGHT: f64 = 2.997_924_58e11;

impl Quantity {
    fn description(self) -> &'static str {
        match self {
            Quantity::Flux => "fluence rate per joule (1/(mm^2 s))",
            Quantity::Fluence => "fluence per joule (1/mm^2)",
            Quantity::Energy => "deposited energy of a voxel per joule",
            Quantity::Modulated => {
                "complex fluence rate per joule (1/(mm^2 s)): real parts, then imaginary parts"
            }
        }
    }

    /// Returns the readings with their signs: the real part, and the imaginary part if there is one.
    /// Light that lags by φ has the phase −φ in MCX.
    fn readings(self) -> &'static [(&'static str, f64)] {
        match self {
            Quantity::Flux | Quantity::Fluence => &[("fluence", 1.0)],
            Quantity::Energy => &[("absorbed", 1.0)],
            Quantity::Modulated => &[("fluence_in_phase", 1.0), ("fluence_quadrature", -1.0)],
        }
    }
}

fn quantity(name: &str) -> Result<Quantity, CommandError> {
    match name.to_ascii_uppercase().chars().next() {
        Some('X') => Ok(Quantity::Flux),
        Some('F') => Ok(Quantity::Fluence),
        Some('E') => Ok(Quantity::Energy),
        Some('R') => Ok(Quantity::Modulated),
        _ => Err(CommandError::Usage(format!(
            "OutputType (-O) {name}: give X (fluence rate), F (fluence), E (deposited energy) or R (complex fluence rate of modulated light); for derivatives use \
             'derivatives' of a scene (docs/guides/inverse-problems.md), for path lengths the columns of detected photons (-w)"
        ))),
    }
}

fn format(name: &str) -> Result<Format, CommandError> {
    match name.to_ascii_lowercase().as_str() {
        "jnii" => Ok(Format::Jnii),
        "bnii" => Ok(Format::Bnii),
        "mc2" => Ok(Format::Mc2),
        _ => Err(CommandError::Usage(format!(
            "OutputFormat (-F) {name}: give jnii, bnii or mc2; morgana convert writes other formats from .jnii"
        ))),
    }
}

/// Returns the sides that detect light, from the last six letters of `BCFlags`.
fn faces(session: &serde_json::Map<String, Value>) -> [bool; 6] {
    let flags = session
        .iter()
        .find(|(key, _)| key.eq_ignore_ascii_case("BCFlags"));
    let flags = flags.and_then(|(_, value)| value.as_str()).unwrap_or("");
    std::array::from_fn(|i| flags.as_bytes().get(6 + i) == Some(&b'1'))
}

fn section<'a>(root: &'a mut Value, name: &str) -> Option<&'a mut serde_json::Map<String, Value>> {
    let entries = root.as_object_mut()?;
    let key = entries
        .keys()
        .find(|k| k.eq_ignore_ascii_case(name))?
        .clone();
    entries.get_mut(&key)?.as_object_mut()
}

fn number(root: &mut Value, name: &str, key: &str) -> Option<f64> {
    let entries = section(root, name)?;
    let found = entries.iter().find(|(k, _)| k.eq_ignore_ascii_case(key));
    found.and_then(|(_, value)| value.as_f64())
}

/// Returns the media of the input; without those that are not tables of four numbers.
fn media(root: &mut Value) -> Vec<[f64; 4]> {
    let rows = section(root, "Domain").and_then(|domain| {
        let found = domain.iter().find(|(k, _)| k.eq_ignore_ascii_case("Media"));
        found.and_then(|(_, value)| value.as_array().cloned())
    });
    let row = |row: &Value| match row {
        Value::Object(_) => Some(["mua", "mus", "g", "n"].map(|k| row[k].as_f64().unwrap_or(0.0))),
        Value::Array(items) => {
            let numbers: Vec<f64> = items.iter().filter_map(Value::as_f64).collect();
            numbers.try_into().ok()
        }
        _ => None,
    };
    rows.unwrap_or_default().iter().filter_map(row).collect()
}
