//! Queries for numbers, booleans and texts.

use eikonal::Shown;
use std::ops::{Bound, RangeBounds};

use super::{Lookup, Query};
use crate::diagnostic::{Diagnostic, suggest};
use crate::scene::{PluginKind, Value};
use crate::schema::{self, Default, NumberRange, Parameter, Type};

fn as_float(value: &Value) -> Option<f64> {
    match value {
        Value::Float(v) => Some(*v),
        Value::Integer(v) => Some(*v as f64),
        _ => None,
    }
}

fn as_integer(value: &Value) -> Option<i64> {
    match value {
        Value::Integer(v) => Some(*v),
        _ => None,
    }
}

fn as_string(value: &Value) -> Option<String> {
    match value {
        Value::String(v) => Some(v.clone()),
        _ => None,
    }
}

impl<'a> Query<'a, '_> {
    /// Returns the row of the table for a parameter of this object: its limits and its default. A
    /// type that the table does not list takes the row of another type of its kind.
    pub(super) fn row(&self, name: &str) -> Parameter {
        let kind = self.object.kind;
        // Spectra may be written as textures.
        let plugin = schema::find(kind, &self.object.plugin)
            .or_else(|| schema::find(PluginKind::Spectrum, &self.object.plugin));
        let row = match plugin {
            Some(plugin) => plugin.parameter(name),
            None => schema::plugins(kind)
                .iter()
                .find_map(|plugin| plugin.parameter(name)),
        };
        row.copied().unwrap_or(Parameter::UNLISTED)
    }

    /// Returns the limits of a parameter, from its row.
    pub(crate) fn limits(&self, name: &str) -> NumberRange {
        self.row(name).limits
    }

    /// Reads a number within the limits of its row. If it is absent, returns the default of its
    /// row; without a default it is required. After an error, returns the default, or else 1.
    pub fn float(&mut self, name: &str) -> f64 {
        let row = self.row(name);
        self.float_within(name, row.limits, row.default.number())
    }

    /// Reads a number within the limits of its row. If it is absent or after an error, returns
    /// `default`, which may depend on other parameters.
    pub fn float_or(&mut self, name: &str, default: f64) -> f64 {
        self.float_within(name, self.row(name).limits, default)
    }

    /// Reads a number within the limits of its row, if it is given. After an error, returns the
    /// default of its row, or else 1.
    pub fn float_if_given(&mut self, name: &str) -> Option<f64> {
        self.has(name).then(|| self.float(name))
    }

    /// Reads a number within limits that may depend on other parameters. With the default `None` it
    /// is required. After an error, returns the default, or else 1.
    pub fn float_within(
        &mut self,
        name: &str,
        limits: impl RangeBounds<f64>,
        default: impl Into<Option<f64>>,
    ) -> f64 {
        let lookup = self.convert(name, "float", as_float);
        let lookup = self.in_range(name, lookup, limits, |v| Shown(*v).to_string());
        self.settle(name, "float", lookup, default.into(), 1.0)
    }

    /// Reads an integer within the limits of its row. If it is absent, returns the default of its
    /// row; without a default it is required. After an error, returns the default, or else 1.
    pub fn integer(&mut self, name: &str) -> i64 {
        let row = self.row(name);
        let default = row.default.number().map(|number| number as i64);
        self.integer_within(name, whole(row.limits), default)
    }

    /// Reads an integer within the limits of its row. If it is absent or after an error, returns
    /// `default`, which may depend on other parameters.
    pub fn integer_or(&mut self, name: &str, default: i64) -> i64 {
        self.integer_within(name, whole(self.row(name).limits), default)
    }

    /// Reads an integer within limits that may depend on other parameters. With the default `None`
    /// it is required. After an error, returns the default, or else 1.
    pub fn integer_within(
        &mut self,
        name: &str,
        limits: impl RangeBounds<i64>,
        default: impl Into<Option<i64>>,
    ) -> i64 {
        let lookup = self.convert(name, "integer", as_integer);
        let lookup = self.in_range(name, lookup, limits, i64::to_string);
        self.settle(name, "integer", lookup, default.into(), 1)
    }

    /// Reads a boolean. If it is absent, returns the default of its row; without a default it is
    /// required. After an error, returns the default, or else false.
    pub fn boolean(&mut self, name: &str) -> bool {
        let default = match self.row(name).default {
            Default::Flag(flag) => Some(flag),
            _ => None,
        };
        let lookup = self.boolean_lookup(name);
        self.settle(
            name,
            "boolean",
            lookup,
            default,
            default.unwrap_or_default(),
        )
    }

    /// Reads a boolean. If it is absent or after an error, returns `default`, which may depend on
    /// other parameters.
    pub fn boolean_or(&mut self, name: &str, default: bool) -> bool {
        let lookup = self.boolean_lookup(name);
        self.settle(name, "boolean", lookup, Some(default), default)
    }

    /// Reads a text. If it is absent, returns the default of its row; without a default it is
    /// required. After an error, returns the default, or else the empty text.
    pub fn string(&mut self, name: &str) -> String {
        let default = self.row(name).default.text().map(str::to_owned);
        let lookup = self.convert(name, "string", as_string);
        self.settle(name, "string", lookup, default, String::new())
    }

    /// Reads a parameter that is one of the words of its row in the table of parameters. If the
    /// parameter is absent, or after an error, returns the default of the row, or else the first
    /// word.
    pub fn word(&mut self, name: &str) -> &'static str {
        let row = self.row(name);
        let words = match row.value {
            Type::Word(words) | Type::NumberOrWord(words) => words,
            _ => &[""][..],
        };
        let default = row.default.text().unwrap_or(words[0]);
        let Lookup::Found(text, location) = self.convert(name, "string", as_string) else {
            return default;
        };
        if let Some(word) = words.iter().find(|word| **word == text) {
            return word;
        }
        let message = format!("'{name}' cannot be '{text}'");
        let help = suggest(&text, words.iter().copied())
            .unwrap_or_else(|| format!("it is one of: {}", words.join(", ")));
        self.diagnostics
            .push(Diagnostic::error(message).help(help).at(location));
        default
    }

    fn boolean_lookup(&mut self, name: &str) -> Lookup<'a, bool> {
        self.convert(name, "boolean", |value| match value {
            Value::Boolean(v) => Some(*v),
            _ => None,
        })
    }

    /// Reports a value outside its limits, and returns `Wrong` then.
    fn in_range<T: PartialOrd>(
        &mut self,
        name: &str,
        lookup: Lookup<'a, T>,
        range: impl RangeBounds<T>,
        show: impl Fn(&T) -> String,
    ) -> Lookup<'a, T> {
        match lookup {
            Lookup::Found(value, location) if !range.contains(&value) => {
                let (value, allowed) = (show(&value), describe(&range, &show));
                let message = format!("'{name}' is {value} but must be {allowed}");
                self.diagnostics
                    .push(Diagnostic::error(message).at(location));
                Lookup::Wrong
            }
            other => other,
        }
    }
}

/// Converts limits to a range of integers.
fn whole(limits: NumberRange) -> (Bound<i64>, Bound<i64>) {
    (limits.low.map(|v| v as i64), limits.high.map(|v| v as i64))
}

/// Returns a range in words, for example `at least 0 and less than 1`.
fn describe<T>(range: &impl RangeBounds<T>, show: impl Fn(&T) -> String) -> String {
    let low = match range.start_bound() {
        Bound::Included(v) => format!("at least {}", show(v)),
        Bound::Excluded(v) => format!("greater than {}", show(v)),
        Bound::Unbounded => String::new(),
    };
    let high = match range.end_bound() {
        Bound::Included(v) => format!("at most {}", show(v)),
        Bound::Excluded(v) => format!("less than {}", show(v)),
        Bound::Unbounded => String::new(),
    };
    let separator = if low.is_empty() || high.is_empty() {
        ""
    } else {
        " and "
    };
    format!("{low}{separator}{high}")
}

/// Parses a list of numbers; `None` if one is malformed.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split([',', ' ', ';']).filter(|w| !w.is_empty());
    words.map(|w| w.parse().ok()).collect()
}
