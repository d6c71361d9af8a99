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
    /// Type of the parameter's values.
    pub value: Type,
    /// Range of the parameter's numbers; unbounded for other types. [`Query`](crate::Query) refuses
    /// values outside.
    pub limits: NumberRange,
    /// Value if a scene does not give the parameter.
    pub default: Default,
    /// Meaning and unit, in one line.
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
    /// A word from a list.
    Word(&'static [&'static str]),
    /// A number, or one of these words.
    NumberOrWord(&'static [&'static str]),
    /// A text with a list of numbers or words, separated by commas.
    List,
    /// A number, a colour or a spectrum.
    Spectrum,
    /// A position.
    Point,
    /// A direction or displacement.
    Vector,
    /// An affine map.
    Transform,
    /// An array of numbers with any number of axes.
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

    /// Refractive indices. Indices of all substances, metals included, at all wavelengths lie well
    /// within this range.
    pub const INDEX: NumberRange = NumberRange {
        low: Bound::Included(1e-3),
        high: Bound::Included(1e3),
    };
}

impl NumberRange {
    /// Returns true if a number lies within the range.
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

/// Writes the limits as in help texts, such as `> 0` or `0 to 1`.
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
    /// None: the parameter is optional, or another one takes its place.
    Absent,
    /// A value that depends on other parameters or objects, described in words.
    Computed(&'static str),
    /// A number; for a spectrum, its value at all wavelengths.
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
    /// Returns the number, if the default is a number.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Default::Number(number) => Some(number),
            _ => None,
        }
    }

    /// Returns the text, if the default is a text.
    pub fn text(&self) -> Option<&'static str> {
        match *self {
            Default::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the position, direction or displacement, if the default is one.
    pub fn triple(&self) -> Option<DVec3> {
        match *self {
            Default::Triple(triple) => Some(triple.into()),
            _ => None,
        }
    }

    /// Returns the default as a value in a JSON scene, if it has one.
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

/// Converts a number to JSON. Whole numbers get no decimal point.
pub(super) fn number_in_json(number: f64) -> Value {
    if number.fract() == 0.0 && number.abs() < 1e15 {
        json!(number as i64)
    } else {
        json!(number)
    }
}

impl Parameter {
    /// Number that a scene must give. It stands for parameters of objects that the table does not
    /// list.
    pub(crate) const UNLISTED: Parameter = Self::new("", Type::Float, "").required();

    /// Returns true if a scene must give the parameter.
    pub fn is_required(&self) -> bool {
        self.default == Default::Required
    }

    /// Returns the help with the limits, and with the default if the default is described in words.
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

    /// Sets a number as the default.
    pub(super) const fn or(self, number: f64) -> Self {
        self.with(Default::Number(number))
    }

    /// Sets a position or direction as the default.
    pub(super) const fn or_triple(self, triple: [f64; 3]) -> Self {
        self.with(Default::Triple(triple))
    }

    /// Sets a text as the default.
    pub(super) const fn or_text(self, text: &'static str) -> Self {
        self.with(Default::Text(text))
    }

    /// Sets a default that depends on other parameters or objects, described in words.
    pub(super) const fn or_computed(self, words: &'static str) -> Self {
        self.with(Default::Computed(words))
    }

    /// Removes the default that the type has.
    pub(super) const fn or_nothing(self) -> Self {
        self.with(Default::Absent)
    }

    /// Makes the parameter one that a scene must give.
    pub(super) const fn required(self) -> Self {
        self.with(Default::Required)
    }

    const fn limited(self, limits: NumberRange) -> Self {
        Parameter { limits, ..self }
    }

    /// Limits the numbers to positive ones.
    pub(super) const fn positive(self) -> Self {
        self.limited(NumberRange::POSITIVE)
    }

    /// Limits the numbers to at least `low`.
    pub(super) const fn at_least(self, low: f64) -> Self {
        self.limited(NumberRange {
            low: Bound::Included(low),
            high: self.limits.high,
        })
    }

    /// Limits the numbers to more than `low`.
    pub(super) const fn above(self, low: f64) -> Self {
        self.limited(NumberRange {
            low: Bound::Excluded(low),
            high: self.limits.high,
        })
    }

    /// Limits the numbers to at most `high`.
    pub(super) const fn at_most(self, high: f64) -> Self {
        self.limited(NumberRange {
            low: self.limits.low,
            high: Bound::Included(high),
        })
    }

    /// Limits the numbers to less than `high`.
    pub(super) const fn below(self, high: f64) -> Self {
        self.limited(NumberRange {
            low: self.limits.low,
            high: Bound::Excluded(high),
        })
    }

    /// Limits the numbers to `low` to `high`, both included.
    pub(super) const fn within(self, low: f64, high: f64) -> Self {
        self.at_least(low).at_most(high)
    }

    /// Limits the numbers to [`NumberRange::INDEX`].
    pub(super) const fn as_index(self) -> Self {
        self.limited(NumberRange::INDEX)
    }
}

/// Defines functions that each make a parameter of one type.
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

/// Makes a parameter that is true or false.
pub(super) const fn boolean(name: &'static str, default: bool, help: &'static str) -> Parameter {
    Parameter::new(name, Type::Boolean, help).with(Default::Flag(default))
}

/// Makes a parameter for an affine map, by default the identity.
pub(super) const fn transform(name: &'static str, help: &'static str) -> Parameter {
    Parameter::new(name, Type::Transform, help).with(Default::Identity)
}

/// Makes a parameter that takes one of `words`; the first word is the default.
pub(super) const fn word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    Parameter::new(name, Type::Word(words), help).or_text(words[0])
}

/// Makes a parameter that takes a number or one of `words`; the first word is the default.
pub(super) const fn number_or_word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    Parameter::new(name, Type::NumberOrWord(words), help).or_text(words[0])
}

/// Makes a parameter for a refractive index: a number, or the name of a substance.
pub(super) const fn index(name: &'static str, help: &'static str) -> Parameter {
    let substances = Type::NumberOrWord(&super::substance::NAMES);
    Parameter::new(name, substances, help).as_index()
}

/// Map from local coordinates to the parent's coordinates.
pub(super) const TO_WORLD: Parameter = transform(
    "to_world",
    "transform from local coordinates to the coordinates of the parent; invertible",
);
