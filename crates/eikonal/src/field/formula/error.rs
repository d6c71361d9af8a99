//! What can be wrong with a formula, and where.

use std::ops::Range;
use thiserror::Error;

/// Why a text is no formula.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{kind}")]
pub struct FormulaError {
    /// What is wrong.
    pub kind: FormulaErrorKind,
    /// The bytes of the formula that are meant.
    pub span: Range<usize>,
}

/// What is wrong with a formula.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FormulaErrorKind {
    /// A character that has no meaning here.
    #[error("a formula has no '{0}'")]
    Character(char),
    /// Digits that make no number.
    #[error("'{0}' is not a number")]
    Number(String),
    /// The formula ends too early.
    #[error("the formula ends where {0} is expected")]
    End(&'static str),
    /// Something else than what must follow.
    #[error("expected {expected}, found '{found}'")]
    Unexpected {
        /// What must follow.
        expected: &'static str,
        /// What does.
        found: String,
    },
    /// A name that stands for nothing.
    #[error("the formula knows no '{0}'")]
    UnknownName(String),
    /// A function that has a kink or a step.
    #[error("'{name}' is not smooth, and rays need smooth indices: {instead}")]
    NotSmooth {
        /// Its name.
        name: String,
        /// What to use.
        instead: &'static str,
    },
    /// A function without arguments in parentheses.
    #[error("'{0}' is a function: write its argument in parentheses")]
    NoArguments(String),
    /// A value that is called like a function.
    #[error("'{0}' is no function: write * to multiply")]
    NotAFunction(String),
    /// A function with the wrong number of arguments.
    #[error("'{name}' takes {expected} argument{}, not {found}", if *expected == 1 { "" } else { "s" })]
    ArgumentCount {
        /// Its name.
        name: String,
        /// How many it takes.
        expected: usize,
        /// How many are there.
        found: usize,
    },
    /// A constant part without a finite value.
    #[error("this part of the formula is constant, but has no finite value")]
    NotFinite,
    /// A whole power beyond the limit.
    #[error("exponents of whole numbers may be at most 1024")]
    Exponent,
    /// Too many characters.
    #[error("a formula may have at most {0} characters")]
    TooLong(usize),
    /// Too many levels of parentheses, signs or powers.
    #[error("the formula is nested too deeply")]
    TooDeep,
    /// More values at once than a program holds.
    #[error("the formula needs too many intermediate values: shorten it")]
    TooComplicated,
    /// A parameter whose name is taken, or that cannot be written in a formula.
    #[error("'{0}' cannot be the name of a parameter: {1}")]
    ParameterName(String, &'static str),
    /// A parameter without a finite value.
    #[error("the parameter '{0}' must be a finite number")]
    ParameterValue(String),
}
