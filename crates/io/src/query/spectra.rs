//! Queries for spectra, given as values or by plugins that compute them.

use super::values::as_spectrum;
use super::{Input, Lookup, Query, unknown_plugin};
use crate::scene::{PluginKind, SpectrumValue, Value};
use crate::schema;

/// Names of the parameters that bound the range of wavelengths.
const ENDS: [&str; 2] = ["wavelength_min", "wavelength_max"];

/// Spectrum returned after an error.
const FALLBACK: SpectrumValue = SpectrumValue::Uniform(1.0);

impl<'a> Query<'a, '_> {
    /// Reads a spectrum, colour or plain number. If it is absent, returns the default of its row;
    /// without a default it is required. After an error, returns the default, or else 1.
    pub fn spectrum(&mut self, name: &str) -> SpectrumValue {
        match self.computed_spectrum(name) {
            Some(Input::Spectrum(value)) => value,
            Some(Input::Object(_)) => {
                self.error(
                    name,
                    format!("'{name}' is a constant: it cannot be a texture"),
                );
                FALLBACK
            }
            None => {
                let lookup = self.convert(name, "spectrum", as_spectrum);
                self.settle(name, "spectrum", lookup, self.uniform(name), FALLBACK)
            }
        }
    }

    /// Returns the default of a spectrum, from its row.
    fn uniform(&self, name: &str) -> Option<SpectrumValue> {
        self.row(name).default.number().map(SpectrumValue::Uniform)
    }

    /// Reads a spectrum, or a nested object of a kind. If it is absent, returns the default of its
    /// row; without a default it is required. After an error, returns the default, or else 1.
    pub(super) fn input(&mut self, kind: PluginKind, name: &str) -> Input<'a> {
        if let Some(input) = self.computed_spectrum(name) {
            return input;
        }
        if let Some(object) = self.stand_in(kind, name) {
            return Input::Object(object);
        }
        let expected = format!("{kind} or spectrum");
        let lookup: Lookup<'a, _> = self.convert(name, &expected, as_spectrum);
        Input::Spectrum(self.settle(name, "spectrum", lookup, self.uniform(name), FALLBACK))
    }

    /// Returns the spectrum that a plugin in the place of a parameter computes, if it is a plugin
    /// for spectra. In Mitsuba, spectra are textures, too.
    pub(super) fn computed_spectrum(&mut self, name: &str) -> Option<Input<'a>> {
        let object = &self.named_child(name)?.object;
        let known = schema::find(PluginKind::Spectrum, &object.plugin).is_some();
        let is_texture = schema::find(PluginKind::Texture, &object.plugin).is_some();
        match object.kind {
            PluginKind::Texture if known => {}
            PluginKind::Spectrum if !is_texture => {}
            _ => return None,
        }
        self.use_child(name);
        if known {
            return Some(self.nested(object, |q| q.computed()));
        }
        unknown_plugin(object, self.diagnostics);
        Some(Input::Spectrum(FALLBACK))
    }

    /// Computes the spectrum of this plugin.
    fn computed(&mut self) -> Input<'a> {
        let range = |q: &mut Self| ENDS.map(|name| q.float(name));
        Input::Spectrum(match self.object.plugin.as_str() {
            "d65" => return self.daylight(),
            "blackbody" => SpectrumValue::Blackbody {
                temperature: self.float("temperature"),
                scale: self.float("scale"),
                range: range(self),
            },
            "regular" => self.regular(),
            "irregular" => self.irregular(),
            "uniform" => {
                range(self);
                SpectrumValue::Uniform(self.float("value"))
            }
            "srgb" => {
                let unbounded = self.boolean("unbounded");
                let color = self.spectrum("color");
                let outside = |v: &f64| !(0.0..=1.0).contains(v);
                if !unbounded && color.values().iter().any(outside) {
                    let message = "a colour must lie in [0, 1] unless it is 'unbounded'";
                    self.error("color", message);
                }
                color
            }
            _ => self.raw(),
        })
    }

    /// Computes D65, or D65 times a colour or texture. White of a colour film is D65.
    fn daylight(&mut self) -> Input<'a> {
        let scale = self.float("scale");
        let texture = self.child(PluginKind::Texture);
        let coloured = self.has("color");
        if let Some(texture) = texture {
            if coloured || scale != 1.0 {
                let message = "'color' and 'scale' have no effect on a nested texture: scale that";
                self.error("type", message);
            }
            return Input::Object(texture);
        }
        if !coloured {
            return Input::Spectrum(SpectrumValue::D65(scale));
        }
        Input::Spectrum(match self.spectrum("color") {
            SpectrumValue::Rgb(rgb) => SpectrumValue::Rgb(rgb.map(|v| v * scale)),
            SpectrumValue::Uniform(v) => SpectrumValue::D65(v * scale),
            _ => {
                self.error("color", "'color' is an RGB value");
                FALLBACK
            }
        })
    }

    /// Reads values at equidistant wavelengths.
    fn regular(&mut self) -> SpectrumValue {
        let [min, max] = ENDS.map(|name| self.float(name));
        let values = self.numbers("values");
        if min >= max || values.len() < 2 {
            let message = "a regular spectrum has two values at least, from a 'wavelength_min' to a larger \
                           'wavelength_max'";
            self.error("values", message);
            return FALLBACK;
        }
        let step = (max - min) / (values.len() - 1) as f64;
        let pairs = values.iter().enumerate();
        SpectrumValue::Sampled(pairs.map(|(i, v)| (min + step * i as f64, *v)).collect())
    }

    /// Reads values at given wavelengths.
    fn irregular(&mut self) -> SpectrumValue {
        let (wavelengths, values) = (self.numbers("wavelengths"), self.numbers("values"));
        let increasing = wavelengths.is_sorted_by(|a, b| a < b);
        if wavelengths.len() != values.len() || values.len() < 2 || !increasing {
            let message = "an irregular spectrum has two 'wavelengths' at least, which increase, and as many \
                           'values'";
            self.error("values", message);
            return FALLBACK;
        }
        SpectrumValue::Sampled(wavelengths.into_iter().zip(values).collect())
    }

    /// Reads numbers without conversion.
    fn raw(&mut self) -> SpectrumValue {
        let lookup = self.convert("value", "float or vector", |value| match value {
            Value::Vector(v) | Value::Point(v) => Some(SpectrumValue::Rgb(v.to_array())),
            value => as_spectrum(value),
        });
        self.settle("value", "float", lookup, None, FALLBACK)
    }

    /// Reads a list of finite numbers from a text.
    pub(crate) fn numbers(&mut self, name: &str) -> Vec<f64> {
        let text = self.string(name);
        let words = text.split([' ', ',', '\t', '\n', '\r']);
        let words = words.filter(|word| !word.is_empty());
        let number = |word: &str| word.parse().ok().filter(|v: &f64| v.is_finite());
        let numbers: Option<Vec<f64>> = words.map(number).collect();
        numbers.unwrap_or_else(|| {
            self.error(name, format!("'{name}' is a list of numbers"));
            Vec::new()
        })
    }
}
