//! Queries for points, vectors, spectra, transforms and paths.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::{Lookup, Query};
use crate::diagnostic::Location;
use crate::scene::{FileRegistry, SpectrumValue, Tensor, Value};

fn as_triple(value: &Value) -> Option<DVec3> {
    match value {
        Value::Point(v) | Value::Vector(v) => Some(*v),
        _ => None,
    }
}

/// Converts a value to a spectrum. A plain number counts as a uniform spectrum.
pub(super) fn as_spectrum(value: &Value) -> Option<SpectrumValue> {
    match value {
        Value::Spectrum(v) => Some(v.clone()),
        Value::Float(v) => Some(SpectrumValue::Uniform(*v)),
        Value::Integer(v) => Some(SpectrumValue::Uniform(*v as f64)),
        _ => None,
    }
}

fn as_transform(value: &Value) -> Option<DMat4> {
    match value {
        Value::Transform(v) => Some(*v),
        _ => None,
    }
}

impl Query<'_, '_> {
    /// Reads a position. If it is absent, returns the default of its row; without a default it is
    /// required. After an error, returns the default, or else the origin.
    pub fn point(&mut self, name: &str) -> DVec3 {
        self.triple(name, "point", DVec3::ZERO)
    }

    /// Reads a direction or displacement. If it is absent, returns the default of its row; without
    /// a default it is required. After an error, returns the default, or else the z axis.
    pub fn vector(&mut self, name: &str) -> DVec3 {
        self.triple(name, "vector", DVec3::Z)
    }

    /// Reads three coordinates, as a point or as a vector.
    fn triple(&mut self, name: &str, expected: &str, harmless: DVec3) -> DVec3 {
        let default = self.row(name).default.triple();
        let lookup = self.convert(name, expected, as_triple);
        self.settle(name, expected, lookup, default, harmless)
    }

    /// Reads a position. If it is absent or after an error, returns `default`, which may depend on
    /// other parameters.
    pub fn point_or(&mut self, name: &str, default: DVec3) -> DVec3 {
        let lookup = self.convert(name, "point", as_triple);
        self.settle(name, "point", lookup, Some(default), default)
    }

    /// Reads a direction or displacement. If it is absent or after an error, returns `default`,
    /// which may depend on other parameters.
    pub fn vector_or(&mut self, name: &str, default: DVec3) -> DVec3 {
        let lookup = self.convert(name, "vector", as_triple);
        self.settle(name, "vector", lookup, Some(default), default)
    }

    /// Reads a transform. If it is absent or after an error, returns the identity.
    pub fn transform(&mut self, name: &str) -> DMat4 {
        let lookup = self.convert(name, "transform", as_transform);
        self.settle(
            name,
            "transform",
            lookup,
            Some(DMat4::IDENTITY),
            DMat4::IDENTITY,
        )
    }

    /// Reads an array of real numbers, if there is one.
    pub fn tensor(&mut self, name: &str) -> Option<Arc<Tensor>> {
        let tensor = self.complex_tensor(name)?;
        if tensor.is_complex() {
            let message =
                "the array has complex numbers, which only sound of a 'frequency' may have";
            self.error(name, message);
            return None;
        }
        Some(tensor)
    }

    /// Reads an array of numbers, which may be complex, if there is one.
    pub(crate) fn complex_tensor(&mut self, name: &str) -> Option<Arc<Tensor>> {
        let lookup = self.convert(name, "array", |value| match value {
            Value::Tensor(v) => Some(v.clone()),
            _ => None,
        });
        match lookup {
            Lookup::Found(tensor, _) => Some(tensor),
            _ => None,
        }
    }

    /// Reads an array of numbers that is required.
    pub(crate) fn required_tensor(&mut self, name: &str) -> Option<Arc<Tensor>> {
        if !self.has(name) {
            self.missing(name, "array");
        }
        self.tensor(name)
    }

    /// Reads the path of a data file, which is required, and adds the path to `files`. A relative
    /// path starts at the folder of the file in which it is written, or at one of the folders that
    /// `files` searches. After an error, returns the empty path.
    pub fn path(&mut self, name: &str, files: &mut FileRegistry) -> PathBuf {
        let lookup = self.convert(name, "string", |value| match value {
            Value::String(v) => Some(v.clone()),
            _ => None,
        });
        let Lookup::Found(written, location) = lookup else {
            let written = self.settle(name, "string", lookup, None, String::new());
            return PathBuf::from(written);
        };
        resolve(&written, location, files)
    }
}

/// Returns the path of a data file from its name at some place in a scene file, and adds the path
/// to `files`. A relative path starts at the folder of the scene file, or at one of the folders
/// that `files` searches.
pub(crate) fn resolve(written: &str, location: &Location, files: &mut FileRegistry) -> PathBuf {
    files.resolve(written, location.source().directory())
}
