//! Numbers, flags and texts.

use eikonal::Shown;
use std::ops::{Bound, RangeBounds, RangeInclusive};

use super::{Lookup, Query};
use crate::diagnostic::{Diagnostic, suggest};
use crate::scene::Value;

/// The range of positive numbers, for [`Query::float_in`].
pub const POSITIVE: (Bound<f64>, Bound<f64>) = (Bound::Excluded(0.0), Bound::Unbounded);

/// The range of refractive indices, for [`Query::float_in`]: those of all substances, of metals and at all wavelengths, lie well
/// within.
pub const INDEX: RangeInclusive<f64> = 1e-3..=1e3;

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
    /// A number that must be there; after an error, 1.
    pub fn float(&mut self, name: &str) -> f64 {
        self.float_in(name, .., None)
    }

    /// A number, or `default` if it is not there.
    pub fn float_or(&mut self, name: &str, default: f64) -> f64 {
        self.float_in(name, .., default)
    }

    /// A number in a range, or `default` if it is not there; with the default `None` it must be
    /// there. After an error, the default, or else 1.
    pub fn float_in(
        &mut self,
        name: &str,
        range: impl RangeBounds<f64>,
        default: impl Into<Option<f64>>,
    ) -> f64 {
        let lookup = self.convert(name, "float", as_float);
        let lookup = self.in_range(name, lookup, range, |v| Shown(*v).to_string());
        self.settle(name, "float", lookup, default.into(), 1.0)
    }

    /// A whole number that must be there; after an error, 1.
    pub fn integer(&mut self, name: &str) -> i64 {
        self.integer_in(name, .., None)
    }

    /// A whole number, or `default` if it is not there.
    pub fn integer_or(&mut self, name: &str, default: i64) -> i64 {
        self.integer_in(name, .., default)
    }

    /// A whole number in a range, or `default` if it is not there; with the default `None` it must
    /// be there. After an error, the default, or else 1.
    pub fn integer_in(
        &mut self,
        name: &str,
        range: impl RangeBounds<i64>,
        default: impl Into<Option<i64>>,
    ) -> i64 {
        let lookup = self.convert(name, "integer", as_integer);
        let lookup = self.in_range(name, lookup, range, i64::to_string);
        self.settle(name, "integer", lookup, default.into(), 1)
    }

    /// True or false, or `default` if it is not there.
    pub fn boolean_or(&mut self, name: &str, default: bool) -> bool {
        let lookup = self.boolean_lookup(name);
        self.settle(name, "boolean", lookup, Some(default), default)
    }

    /// True or false, which must be given; after an error, false.
    pub fn boolean(&mut self, name: &str) -> bool {
        let lookup = self.boolean_lookup(name);
        self.settle(name, "boolean", lookup, None, false)
    }

    /// A text that must be there; after an error, the empty one.
    pub fn string(&mut self, name: &str) -> String {
        let lookup = self.convert(name, "string", as_string);
        self.settle(name, "string", lookup, None, String::new())
    }

    /// A text, or `default` if it is not there.
    pub fn string_or(&mut self, name: &str, default: &str) -> String {
        let lookup = self.convert(name, "string", as_string);
        self.settle(
            name,
            "string",
            lookup,
            Some(default.to_owned()),
            String::new(),
        )
    }

    /// One of a few words, the first of which is the default; returns its index in `words`.
    ///
    /// `words` must not be empty.
    pub fn one_of(&mut self, name: &str, words: &[&str]) -> usize {
        let Lookup::Found(text, location) = self.convert(name, "string", as_string) else {
            return 0;
        };
        self.listed(name, |plugin| plugin.allows(name, words));
        words
            .iter()
            .position(|word| *word == text)
            .unwrap_or_else(|| {
                let message = format!("'{name}' cannot be '{text}'");
                let help = suggest(&text, words.iter().copied())
                    .unwrap_or_else(|| format!("it is one of: {}", words.join(", ")));
                self.diagnostics
                    .push(Diagnostic::error(message).help(help).at(location));
                0
            })
    }

    fn boolean_lookup(&mut self, name: &str) -> Lookup<'a, bool> {
        self.convert(name, "boolean", |value| match value {
            Value::Boolean(v) => Some(*v),
            _ => None,
        })
    }

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

/// A range in words, for example `at least 0 and less than 1`.
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
