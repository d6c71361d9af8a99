//! Parameters of plugins: type, limits, default, help.

use glam::DVec3;
use serde_json::{Value, json};
use std::fmt;
use std::ops::{Bound, RangeBounds};

/// A parameter of a plugin.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name, as scenes write it.
    pub name: &'static str,
    /// Type of its values.
    pub value: Type,
    /// NumberRange of its numbers; unbounded for other types. [`Query`](crate::Query) refuses values outside.
    pub limits: NumberRange,
    /// Value where a scene does not give the parameter.
    pub default: Default,
    /// Meaning and unit, in a line.
    pub help: &'static str,
}

/// Type of a parameter's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// A number.
    Float,
    /// A whole number.
    Integer,
    /// True or false.
    Boolean,
    /// Any text.
    Text,
    /// A word of a list.
    Word(&'static [&'static str]),
    /// A number, or one of some words.
    NumberOrWord(&'static [&'static str]),
    /// A text with a list, of numbers or words separated by commas.
    List,
    /// A number, a colour or a spectrum.
    Spectrum,
    /// A position.
    Point,
    /// A direction or displacement.
    Vector,
    /// An affine map.
    Transform,
    /// An array of numbers in any number of axes.
    Tensor,
}

/// A range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    /// Lower end.
    pub low: Bound<f64>,
    /// Upper end.
    pub high: Bound<f64>,
}

impl NumberRange {
    /// All numbers.
    pub const NONE: NumberRange = NumberRange {
        low: Bound::Unbounded,
        high: Bound::Unbounded,
    };

    /// Positive numbers.
    pub const POSITIVE: NumberRange = NumberRange {
        low: Bound::Excluded(0.0),
        high: Bound::Unbounded,
    };

    /// Refractive indices: those of all substances, of metals and at all wavelengths, lie well within.
    pub const INDEX: NumberRange = NumberRange {
        low: Bound::Included(1e-3),
        high: Bound::Included(1e3),
    };
}

impl NumberRange {
    /// Returns whether a number lies within the range.
    pub fn contains(&self, number: f64) -> bool {
        RangeBounds::contains(self, &number)
    }
}

impl RangeBounds<f64> for NumberRange {
    fn start_bound(&self) -> Bound<&f64> {
        self.low.as_ref()
    }

    fn end_bound(&self) -> Bound<&f64> {
        self.high.as_ref()
    }
}

/// The limits as help texts state them, such as `> 0` or `0 to 1`.
impl fmt::Display for NumberRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at_most = |v: &f64| format!("at most {v}");
        match (&self.low, &self.high) {
            (Bound::Included(low), Bound::Included(high)) => write!(f, "{low} to {high}"),
            (low, high) => {
                let low = match low {
                    Bound::Included(v) => Some(format!("≥ {v}")),
                    Bound::Excluded(v) => Some(format!("> {v}")),
                    Bound::Unbounded => None,
                };
                let high = match high {
                    Bound::Included(v) => Some(at_most(v)),
                    Bound::Excluded(v) => Some(format!("< {v}")),
                    Bound::Unbounded => None,
                };
                let parts: Vec<String> = low.into_iter().chain(high).collect();
                f.write_str(&parts.join(" and "))
            }
        }
    }
}

/// Value of a parameter that a scene does not give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// None: the scene must give the parameter.
    Required,
    /// None: the parameter adds something, or another one takes its place.
    Absent,
    /// A value that depends on other things, in words.
    Computed(&'static str),
    /// A number; of a spectrum, the same at all wavelengths.
    Number(f64),
    /// True or false.
    Flag(bool),
    /// A text.
    Text(&'static str),
    /// A position, direction or displacement.
    Triple([f64; 3]),
    /// The identity.
    Identity,
}

impl Default {
    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Default::Number(number) => Some(number),
            _ => None,
        }
    }

    /// The text, if it is one.
    pub fn text(&self) -> Option<&'static str> {
        match *self {
            Default::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The position, direction or displacement, if it is one.
    pub fn triple(&self) -> Option<DVec3> {
        match *self {
            Default::Triple(triple) => Some(triple.into()),
            _ => None,
        }
    }

    /// The default as a value in a JSON scene, if it is one.
    pub fn json(&self) -> Option<Value> {
        match *self {
            Default::Required | Default::Absent | Default::Computed(_) => None,
            Default::Number(v) => Some(number_in_json(v)),
            Default::Flag(v) => Some(json!(v)),
            Default::Text(v) => Some(json!(v)),
            Default::Triple(v) => Some(v.map(number_in_json).to_vec().into()),
            Default::Identity => Some(json!([])),
        }
    }
}

/// A number in JSON; whole ones without a point, as people write them.
pub(super) fn number_in_json(number: f64) -> Value {
    if number.fract() == 0.0 && number.abs() < 1e15 {
        json!(number as i64)
    } else {
        json!(number)
    }
}

impl Parameter {
    /// Any number that must be given: stands for parameters of objects that the table does not list.
    pub(crate) const UNLISTED: Parameter = Self::new("", Type::Float, "").required();

    /// Returns whether a scene must give the parameter.
    pub fn is_required(&self) -> bool {
        self.default == Default::Required
    }

    /// The help with the limits, and with a default that is no plain value.
    pub fn description(&self) -> String {
        let limits = self.limits.to_string();
        let mut text = match (self.help, limits.as_str()) {
            (help, "") => help.to_owned(),
            ("", limits) => limits.to_owned(),
            (help, limits) => format!("{help}, {limits}"),
        };
        if let Default::Computed(words) = self.default {
            text += &format!("; default: {words}");
        }
        text
    }

    const fn new(name: &'static str, value: Type, help: &'static str) -> Self {
        Parameter {
            name,
            value,
            limits: NumberRange::NONE,
            default: Default::Absent,
            help,
        }
    }

    const fn with(self, default: Default) -> Self {
        Parameter { default, ..self }
    }

    /// The parameter with a number as its default.
    pub(super) const fn or(self, number: f64) -> Self {
        self.with(Default::Number(number))
    }

    /// The parameter with a position or direction as its default.
    pub(super) const fn or_triple(self, triple: [f64; 3]) -> Self {
        self.with(Default::Triple(triple))
    }

    /// The parameter with a text as its default.
    pub(super) const fn or_text(self, text: &'static str) -> Self {
        self.with(Default::Text(text))
    }

    /// The parameter with a default that depends on other things, in words.
    pub(super) const fn or_computed(self, words: &'static str) -> Self {
        self.with(Default::Computed(words))
    }

    /// The parameter without a default, though its type has one.
    pub(super) const fn or_nothing(self) -> Self {
        self.with(Default::Absent)
    }

    /// The parameter as one that a scene must give.
    pub(super) const fn required(self) -> Self {
        self.with(Default::Required)
    }

    const fn limited(self, limits: NumberRange) -> Self {
        Parameter { limits, ..self }
    }

    /// The parameter with positive numbers only.
    pub(super) const fn positive(self) -> Self {
        self.limited(NumberRange::POSITIVE)
    }

    /// The parameter with numbers from `low` on.
    pub(super) const fn at_least(self, low: f64) -> Self {
        self.limited(NumberRange {
            low: Bound::Included(low),
            high: self.limits.high,
        })
    }

    /// The parameter with numbers greater than `low`.
    pub(super) const fn above(self, low: f64) -> Self {
        self.limited(NumberRange {
            low: Bound::Excluded(low),
            high: self.limits.high,
        })
    }

    /// The parameter with numbers up to `high`.
    pub(super) const fn at_most(self, high: f64) -> Self {
        self.limited(NumberRange {
            low: self.limits.low,
            high: Bound::Included(high),
        })
    }

    /// The parameter with numbers less than `high`.
    pub(super) const fn below(self, high: f64) -> Self {
        self.limited(NumberRange {
            low: self.limits.low,
            high: Bound::Excluded(high),
        })
    }

    /// The parameter with numbers from `low` to `high`, both included.
    pub(super) const fn within(self, low: f64, high: f64) -> Self {
        self.at_least(low).at_most(high)
    }

    /// The parameter with refractive indices only.
    pub(super) const fn as_index(self) -> Self {
        self.limited(NumberRange::INDEX)
    }
}

/// Shorthands of one type each.
macro_rules! typed {
    ($($function:ident: $value:ident;)*) => {$(
        pub(super) const fn $function(name: &'static str, help: &'static str) -> Parameter {
            Parameter::new(name, Type::$value, help)
        }
    )*};
}

typed! {
    float: Float;
    integer: Integer;
    text: Text;
    list: List;
    spectrum: Spectrum;
    point: Point;
    vector: Vector;
    tensor: Tensor;
}

/// A flag.
pub(super) const fn boolean(name: &'static str, default: bool, help: &'static str) -> Parameter {
    Parameter::new(name, Type::Boolean, help).with(Default::Flag(default))
}

/// An affine map, the identity by default.
pub(super) const fn transform(name: &'static str, help: &'static str) -> Parameter {
    Parameter::new(name, Type::Transform, help).with(Default::Identity)
}

/// A word of a list, whose first word is the default.
pub(super) const fn word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    Parameter::new(name, Type::Word(words), help).or_text(words[0])
}

/// A number, or one of some words, the first of which is the default.
pub(super) const fn number_or_word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    Parameter::new(name, Type::NumberOrWord(words), help).or_text(words[0])
}

/// An index of refraction: a number, or the name of a substance.
pub(super) const fn index(name: &'static str, help: &'static str) -> Parameter {
    let substances = Type::NumberOrWord(&super::substance::NAMES);
    Parameter::new(name, substances, help).as_index()
}

/// A map from local coordinates to the world.
pub(super) const TO_WORLD: Parameter = transform(
    "to_world",
    "from local coordinates to the parent's, invertible",
);
