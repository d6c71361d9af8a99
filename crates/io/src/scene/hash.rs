//! Fingerprints of scenes: equal if and only if description and data files are equal.

use std::collections::HashMap;
use std::fmt;

use super::{
    FileRegistry, ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue, Tensor,
    Value,
};
use crate::error::FileError;

/// Fingerprint of a scene and its data files (BLAKE3). Displays as 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SceneHash([u8; 32]);

impl SceneHash {
    /// Returns the bytes.
    pub fn bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl SceneHash {
    /// Derives the fingerprint of the scene without its flow.
    pub(crate) fn undisturbed(self) -> Self {
        SceneHash(*blake3::keyed_hash(&self.0, b"undisturbed").as_bytes())
    }
}

impl SceneDescription {
    /// Returns the fingerprint of the resolved description and of the contents of `files`.
    ///
    /// The fingerprint does not depend on the text of the scene file: its comments, layout, order
    /// of parameters, and notation and types of numbers. It also does not depend on the file format
    /// (XML or JSON), the division into included files, or the scene's folder.
    ///
    /// # Errors
    ///
    /// Returns an error if a data file cannot be read.
    pub fn hash(&self, files: &FileRegistry) -> Result<SceneHash, FileError> {
        let mut writer = Writer {
            hasher: blake3::Hasher::new(),
            seen: HashMap::new(),
        };
        writer.object(&self.root);
        for (name, hash) in files.content_hashes()? {
            writer.text(name);
            writer.hasher.update(hash.as_bytes());
        }
        Ok(SceneHash(*writer.hasher.finalize().as_bytes()))
    }
}

/// Feeds the hasher with an unambiguous serialisation: each text and list includes its length.
struct Writer {
    hasher: blake3::Hasher,
    seen: HashMap<ObjectId, u64>,
}

impl Writer {
    fn object(&mut self, object: &ObjectDescription) {
        // Hash each object once: shared objects could otherwise multiply exponentially.
        let next = self.seen.len() as u64;
        if let Some(&number) = self.seen.get(&object.number) {
            self.text("same");
            return self.number(number);
        }
        self.seen.insert(object.number, next);
        self.text(object.kind.tag());
        self.text(&object.plugin);
        self.optional(object.id.as_deref());
        let mut properties: Vec<_> = object.properties.iter().collect();
        properties.sort_by(|a, b| a.name.cmp(&b.name));
        self.number(properties.len() as u64);
        for property in properties {
            self.text(&property.name);
            self.value(&property.value);
        }
        self.number(object.children.len() as u64);
        for child in &object.children {
            // A role that is only the name of the kind carries no information.
            let role = child.name.as_deref();
            self.optional(role.filter(|name| PluginKind::of_key(name).is_none()));
            self.object(&child.object);
        }
    }

    /// Hashes a value. Values that no plugin distinguishes have equal hashes: a whole number and a
    /// float, a point and a vector.
    fn value(&mut self, value: &Value) {
        match value {
            Value::Integer(v) if *v as f64 as i64 == *v => self.tagged("number", &[*v as f64]),
            Value::Integer(v) => {
                self.text("integer");
                self.number(*v as u64);
            }
            Value::Float(v) | Value::Spectrum(SpectrumValue::Uniform(v)) => {
                self.tagged("number", &[*v]);
            }
            Value::Boolean(v) => self.tagged("boolean", &[f64::from(u8::from(*v))]),
            Value::String(v) => {
                self.text("string");
                self.text(v);
            }
            Value::Spectrum(SpectrumValue::EqualEnergy(v)) => self.tagged("equal energy", &[*v]),
            Value::Spectrum(SpectrumValue::Rgb(v)) => self.tagged("rgb", v),
            Value::Spectrum(SpectrumValue::Sampled(pairs)) => {
                let numbers: Vec<f64> = pairs.iter().flat_map(|(w, v)| [*w, *v]).collect();
                self.tagged("spectrum", &numbers);
            }
            Value::Spectrum(SpectrumValue::File(name)) => {
                self.text("spectrum file");
                self.text(name);
            }
            Value::Spectrum(SpectrumValue::D65(v)) => self.tagged("d65", &[*v]),
            Value::Spectrum(SpectrumValue::Blackbody {
                temperature,
                scale,
                range: [min, max],
            }) => self.tagged("blackbody", &[*temperature, *scale, *min, *max]),
            Value::Point(v) | Value::Vector(v) => self.tagged("point", &v.to_array()),
            Value::Transform(v) => self.tagged("transform", &v.to_cols_array()),
            Value::Tensor(v) => self.tensor(v),
        }
    }

    fn tagged(&mut self, tag: &str, values: &[f64]) {
        self.text(tag);
        self.number(values.len() as u64);
        // Adding 0 converts −0 to 0.
        values.iter().for_each(|v| self.number((v + 0.0).to_bits()));
    }

    fn tensor(&mut self, tensor: &Tensor) {
        self.text("array");
        self.number(tensor.shape().len() as u64);
        tensor.shape().iter().for_each(|n| self.number(*n as u64));
        // Hash in blocks: the hasher is slow with single numbers.
        let mut bytes = Vec::with_capacity(1 << 16);
        for v in tensor.iter() {
            bytes.extend((v + 0.0).to_bits().to_le_bytes());
            if bytes.len() == bytes.capacity() {
                self.hasher.update(&bytes);
                bytes.clear();
            }
        }
        self.hasher.update(&bytes);
    }

    fn optional(&mut self, text: Option<&str>) {
        self.number(u64::from(text.is_some()));
        self.text(text.unwrap_or(""));
    }

    fn text(&mut self, text: &str) {
        self.number(text.len() as u64);
        self.hasher.update(text.as_bytes());
    }

    fn number(&mut self, number: u64) {
        self.hasher.update(&number.to_le_bytes());
    }
}
