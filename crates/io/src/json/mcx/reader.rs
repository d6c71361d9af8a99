//! Reading fields of input files, with names in any case, and reporting errors in them.

use super::super::tree::{Entry, Json, Node};
use super::super::values::{get, value};
use super::detectors::Recording;
use super::{SESSION, Settings, node, rays};
use crate::diagnostic::{Diagnostic, Diagnostics, lints};
use crate::input::Limits;
use crate::scene::{Numbers, Tensor, Value as Held};
use crate::schema::Type;
use serde_json::json;
use std::sync::Arc;
/// Reads fields and reports errors in them.
pub(super) struct Reader<'d> {
    /// Memory that a volume may take.
    pub limits: Limits,
    pub diagnostics: &'d mut Diagnostics,
}

impl Reader<'_> {
    pub(super) fn error(&mut self, at: &Node, message: impl Into<String>) {
        self.diagnostics
            .push(Diagnostic::error(message).at(&at.location));
    }

    /// Returns an optional number, with true as 1 and false as 0.
    pub(super) fn number_or(&mut self, node: &Node, key: &str, default: f64) -> f64 {
        let Some(value) = field(node, key) else {
            return default;
        };
        match (value.number(), &value.json) {
            (Some(v), _) => v,
            (None, Json::Boolean(v)) => f64::from(u8::from(*v)),
            _ => {
                self.error(value, format!("{key} must be a number"));
                default
            }
        }
    }

    /// Returns a required number; 0 after an error.
    pub(super) fn number(&mut self, node: &Node, key: &str) -> f64 {
        if field(node, key).is_none() {
            self.error(node, format!("{key} is missing"));
        }
        self.number_or(node, key, 0.0)
    }

    /// Reports an error if a field has a value that is not as it `must` be.
    pub(super) fn only(&mut self, node: &Node, key: &str, must: impl Fn(&Node) -> bool) {
        if let Some(value) = field(node, key).filter(|v| !must(v)) {
            let message = format!("morgana does not support this {key}: give LengthUnit");
            self.error(value, message);
        }
    }

    /// Reports an error for each field that is neither `read` nor `harmless` (without effect on the
    /// result).
    pub(super) fn known(&mut self, node: &Node, read: &[&str], harmless: &[&str]) {
        let Json::Object(entries) = &node.json else {
            return;
        };
        for entry in entries {
            let is = |name: &&str| entry.key.eq_ignore_ascii_case(name);
            if !read.iter().chain(harmless).any(is) {
                let message = format!(
                    "morgana does not support '{}', which may change the result: remove it",
                    entry.key
                );
                self.error(&entry.node, message);
            }
        }
    }

    /// Returns the first `N` numbers of a list, which must have at least `N`.
    pub(super) fn numbers<const N: usize>(&mut self, node: &Node, key: &str) -> Option<[f64; N]> {
        let Some(value) = field(node, key) else {
            self.error(node, format!("{key} is missing"));
            return None;
        };
        let found = numbers(value).and_then(|all| all.get(..N)?.try_into().ok());
        if found.is_none() {
            self.error(value, format!("{key} must be a list of {N} numbers"));
        }
        found
    }

    /// Returns rows of at least `least` numbers each. The field may also be a single row.
    pub(super) fn table(&mut self, node: &Node, key: &str, least: usize) -> Option<Vec<Vec<f64>>> {
        let Some(value) = field(node, key) else {
            self.error(node, format!("{key} is missing"));
            return None;
        };
        let found = rows(value).filter(|rows| {
            let enough = |row: &Vec<f64>| row.len() >= least && row.iter().all(|v| v.is_finite());
            !rows.is_empty() && rows.iter().all(enough)
        });
        if found.is_none() {
            let message = format!(
                "{key} must be a list of at least {least} numbers, or a list of these lists"
            );
            self.error(value, message);
        }
        found
    }

    /// Returns directions: rows of three numbers, and perhaps a focal length, which may be infinite
    /// or NaN.
    pub(super) fn directions(&mut self, node: &Node, key: &str) -> Option<Vec<Vec<f64>>> {
        let Some(value) = field(node, key) else {
            self.error(node, format!("{key} is missing"));
            return None;
        };
        let found = rows_by(value, rays::special).filter(|rows| {
            let right = |row: &Vec<f64>| row.len() >= 3 && row[..3].iter().all(|v| v.is_finite());
            !rows.is_empty() && rows.iter().all(right)
        });
        if found.is_none() {
            let message = format!(
                "{key} must be a list of three numbers, or a list of these lists; a fourth number is the focal length, which may also be \
                 \"_NaN_\", \"_Inf_\" or \"-_Inf_\""
            );
            self.error(value, message);
        }
        found
    }

    /// Returns an array that a program hands over. Small arrays come as lists of lists.
    pub(super) fn array(&mut self, node: &Node) -> Option<Arc<Tensor>> {
        match value(node, Some(Type::Tensor), self.diagnostics) {
            Some(Held::Tensor(array)) => Some(array),
            _ => None,
        }
    }

    /// Returns the table of media, with a row for each label.
    pub(super) fn media(&mut self, domain: &Node) -> Option<Arc<Tensor>> {
        let Some(media) = field(domain, "Media") else {
            self.error(domain, "Media is missing");
            return None;
        };
        match &media.json {
            Json::Tensor(table) => Some(table.clone()),
            Json::Array(rows) => self.rows(rows),
            _ => {
                self.error(
                    media,
                    "Media must be a list of {\"mua\", \"mus\", \"g\", \"n\"}",
                );
                None
            }
        }
    }

    /// Returns the table of media that are objects, or rows of four numbers.
    pub(super) fn rows(&mut self, rows: &[Node]) -> Option<Arc<Tensor>> {
        let names = ["mua", "mus", "g", "n"];
        let mut table = Vec::with_capacity(4 * rows.len());
        for row in rows {
            if matches!(row.json, Json::Object(_)) {
                self.known(row, &names, &["label", "name"]);
                table.extend(names.map(|name| self.number(row, name)));
            } else if let Some(numbers) = numbers(row).filter(|numbers| numbers.len() == 4) {
                table.extend(numbers);
            } else {
                self.error(
                    row,
                    "a medium must be {\"mua\", \"mus\", \"g\", \"n\"}, or these four numbers",
                );
                return None;
            }
        }
        let numbers = Numbers::Double(table);
        Tensor::new(vec![rows.len(), 4], numbers).map(Arc::new).ok()
    }

    pub(super) fn settings(&mut self, root: &Node, source: Option<&Node>) -> Settings {
        let nothing = node(json!({}), &root.location);
        let session = field(root, "Session").unwrap_or(&nothing);
        let forward = field(root, "Forward").unwrap_or(&nothing);
        let read = [
            "Photons",
            "DoMismatch",
            "DoNormalize",
            "DoPartialPath",
            "DoSaveRef",
            "DoSpecular",
            "BCFlags",
            "MaxDetPhoton",
            "MaxDetPhotons",
            "OutputType",
        ];
        self.known(session, &read, &SESSION);
        self.output(session);
        self.known(forward, &["T0", "T1", "Dt", "WeightWindows"], &[]);
        if self.number_or(session, "DoNormalize", 1.0) != 1.0 {
            self.error(
                session,
                "DoNormalize (isnormalized) must be 1: morgana reads fluence per joule",
            );
        }
        let photons = self.number_or(session, "Photons", 1e6);
        if photons.fract() != 0.0 {
            self.error(session, "Photons must be a whole number");
        }
        let refraction = self.number_or(session, "DoMismatch", 1.0) != 0.0;
        self.specular(session, refraction);
        let mirrors = self.sides(session, refraction);
        let most = self.number_or(session, "MaxDetPhotons", 1e6);
        let t0 = self.number_or(forward, "T0", 0.0);
        let t1 = self.number_or(forward, "T1", 5e-9);
        let dt = self.number_or(forward, "Dt", t1 - t0);
        if !(photons >= 1.0 && t0 >= 0.0 && t1 > t0 && dt > 0.0) {
            self.error(root, "Photons and Dt must be above 0, and T1 above T0");
        }
        let gates = ((t1 - t0) / dt).max(1.0);
        let whole = gates.round();
        if (gates - whole).abs() > 1e-6 * gates {
            let nearest = (t1 - t0) / whole;
            let message = format!(
                "from T0 to T1 (tstart to tend) it is {gates:.4} steps of Dt (tstep), no whole number of gates: \
                 give {nearest:e} s for {whole}"
            );
            self.error(forward, &message);
        }
        Settings {
            photons: photons as i64,
            refraction,
            mirrors,
            gates: [t0, t1, dt.min(t1 - t0)],
            weight_windows: self.number_or(forward, "WeightWindows", 0.0) != 0.0,
            measures_surface: self.number_or(session, "DoSaveRef", 0.0) != 0.0,
            recording: Recording {
                wanted: self.number_or(session, "DoPartialPath", 1.0) != 0.0,
                most: self.number_or(session, "MaxDetPhoton", most).max(1.0) as i64,
            },
            frequency: source.map_or(0.0, |source| self.frequency(source)),
        }
    }

    /// Returns the frequency in Hz at which a source is modulated, or 0.
    fn frequency(&mut self, source: &Node) -> f64 {
        let hertz = self.number_or(source, "Frequency", 0.0);
        if hertz >= 0.0 && hertz.is_finite() {
            return hertz;
        }
        let node = field(source, "Frequency").unwrap_or(source);
        let message =
            format!("Frequency is {hertz}, but must be the modulation in Hz: 1e8 for 100 MHz");
        self.error(node, message);
        0.0
    }
}

impl Reader<'_> {
    /// Reports a setting for specular reflection that contradicts how morgana treats light that
    /// enters from outside. morgana reflects this light like all other light.
    fn specular(&mut self, session: &Node, refraction: bool) {
        let Some(node) = field(session, "DoSpecular") else {
            return;
        };
        match (self.number_or(session, "DoSpecular", 0.0) != 0.0, refraction) {
            (true, false) => self.error(
                node,
                "DoSpecular (isspecular) 1 reflects light that enters, which DoMismatch (isreflect) 0 lets pass straight on: give \
                 DoMismatch 1 or DoSpecular 0",
            ),
            (false, true) => {
                let message = "DoSpecular (isspecular) 0 changes nothing: light that enters from outside is reflected in part, and \
                               refracted, where the index jumps";
                let help = "start it in the medium to avoid that, or set DoMismatch (isreflect) to 0";
                let warning = lints::warning(lints::IGNORED, message).help(help.to_owned());
                self.diagnostics.push(warning.at(&node.location));
            }
            _ => {}
        }
    }

    /// Returns the sides of the volume that are mirrors (option --bc): −x, −y, −z, +x, +y, +z.
    /// Reports sides that do not act like all other faces of voxels, and are no mirrors either.
    fn sides(&mut self, session: &Node, refraction: bool) -> [bool; 6] {
        let mut mirrors = [false; 6];
        let Some(node) = field(session, "BCFlags") else {
            return mirrors;
        };
        let Json::String(flags) = &node.json else {
            self.error(node, "BCFlags must be a text of 6 or 12 letters");
            return mirrors;
        };
        for (i, letter) in flags.to_ascii_lowercase().chars().enumerate() {
            let advice = match (i, letter) {
                (0..6, '_') | (6..12, '0' | '1' | '_') => continue,
                (0..6, 'm') => {
                    mirrors[i] = true;
                    continue;
                }
                (0..6, 'r') if refraction => continue,
                (0..6, 'a') if !refraction => continue,
                (0..6, 'r' | 'a') => {
                    "sides act like all faces: set DoMismatch (isreflect) to 1 for r, or to 0 for a"
                }
                (0..6, 'c') => {
                    "for a layer without sides, give m if the volume and the source are symmetric about the side, or make the volume so \
                     wide that little light reaches its sides"
                }
                _ => "give six letters of _, r, a and m, and then six digits 0 or 1",
            };
            let message = format!(
                "BCFlags (bc): morgana does not support the letter '{letter}' at place {}: {advice}",
                i + 1
            );
            self.error(node, message);
            return mirrors;
        }
        mirrors
    }

    /// Warns that the output is fluence, and says where to find the quantity that MCX would output
    /// instead.
    fn output(&mut self, session: &Node) {
        let Some(node) = field(session, "OutputType") else {
            return;
        };
        let kind = match &node.json {
            Json::String(kind) => kind.to_lowercase(),
            _ => return self.error(node, "OutputType must be a text"),
        };
        let instead = match kind.as_str() {
            "f" | "fluence" => return,
            "x" | "flux" => {
                "for the fluence rate, divide 'fluence' by the width of a time gate in seconds"
            }
            "e" | "energy" => "for the energy density, read 'absorbed'",
            "r" | "rf" => {
                "for the complex fluence rate, divide 'fluence_in_phase' − i 'fluence_quadrature' by the width of a time gate in seconds"
            }
            _ => "morgana measures nothing else",
        };
        let message = format!(
            "OutputType (outputtype) has no effect: morgana reads the fluence per joule; {instead}"
        );
        self.diagnostics
            .push(lints::warning(lints::IGNORED, message).at(&node.location));
    }
}

/// Returns rows of numbers. The node may also be a single row.
pub(super) fn rows(node: &Node) -> Option<Vec<Vec<f64>>> {
    rows_by(node, Node::number)
}

/// Returns rows of numbers, each read by `number`. The node may also be a single row.
fn rows_by(node: &Node, number: fn(&Node) -> Option<f64>) -> Option<Vec<Vec<f64>>> {
    let row = |node: &Node| match &node.json {
        Json::Array(items) => items.iter().map(number).collect(),
        _ => numbers(node),
    };
    match &node.json {
        Json::Tensor(tensor) => {
            let columns = *tensor.shape().last().filter(|n| **n > 0)?;
            let all: Vec<f64> = tensor.iter().collect();
            Some(all.chunks_exact(columns).map(<[f64]>::to_vec).collect())
        }
        Json::Array(items) if items.iter().all(|item| item.number().is_none()) => {
            items.iter().map(row).collect()
        }
        _ => Some(vec![row(node)?]),
    }
}

/// Returns the value of a key, whatever the case of its letters.
pub(super) fn field<'n>(node: &'n Node, key: &str) -> Option<&'n Node> {
    let Json::Object(entries) = &node.json else {
        return None;
    };
    let same = |entry: &&Entry| entry.key.eq_ignore_ascii_case(key);
    get(entries, key).or_else(|| entries.iter().find(same).map(|entry| &entry.node))
}

/// Returns the numbers of a list or an array.
pub(super) fn numbers(node: &Node) -> Option<Vec<f64>> {
    match &node.json {
        Json::Array(items) => items.iter().map(Node::number).collect(),
        Json::Tensor(tensor) => Some(tensor.iter().collect()),
        _ => None,
    }
}
