//! Errors in formulas, and their places.

use std::ops::Range;
use thiserror::Error;

/// Reason why a text is not a formula, and the place of the error.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{kind}")]
pub struct FormulaError {
    /// Kind of error.
    pub kind: FormulaErrorKind,
    /// Range of bytes in the formula to which the error refers.
    pub span: Range<usize>,
}

/// Kinds of errors in a formula.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FormulaErrorKind {
    /// A character that has no meaning here.
    #[error("a formula has no '{0}'")]
    Character(char),
    /// Digits that do not form a number.
    #[error("'{0}' is not a number")]
    Number(String),
    /// The formula ends too early.
    #[error("the formula ends where {0} is expected")]
    End(&'static str),
    /// A token other than the expected one.
    #[error("expected {expected}, found '{found}'")]
    Unexpected {
        /// Expected token.
        expected: &'static str,
        /// Token found instead.
        found: String,
    },
    /// An unknown name.
    #[error("the formula knows no '{0}'")]
    UnknownName(String),
    /// A function that has a kink or a step.
    #[error("'{name}' is not smooth, and rays need smooth indices: {instead}")]
    NotSmooth {
        /// Name of the function.
        name: String,
        /// Advice on what to use instead.
        instead: &'static str,
    },
    /// A function without arguments in parentheses.
    #[error("'{0}' is a function: write its argument in parentheses")]
    NoArguments(String),
    /// A name that is not a function, followed by arguments.
    #[error("'{0}' is no function: write * to multiply")]
    NotAFunction(String),
    /// A function with the wrong number of arguments.
    #[error("'{name}' takes {expected} argument{}, not {found}", if *expected == 1 { "" } else { "s" })]
    ArgumentCount {
        /// Name of the function.
        name: String,
        /// Number of arguments that it takes.
        expected: usize,
        /// Number of arguments found.
        found: usize,
    },
    /// A constant part without a finite value.
    #[error("this part of the formula is constant, but has no finite value")]
    NotFinite,
    /// An integer exponent beyond the limit.
    #[error("exponents of whole numbers may be at most 1024")]
    Exponent,
    /// Too many characters.
    #[error("a formula may have at most {0} characters")]
    TooLong(usize),
    /// Too many levels of parentheses, signs or powers.
    #[error("the formula is nested too deeply")]
    TooDeep,
    /// More simultaneous intermediate values than a program can hold.
    #[error("the formula needs too many intermediate values: shorten it")]
    TooComplicated,
    /// A parameter name that is taken, or that cannot be written in a formula.
    #[error("'{0}' cannot be the name of a parameter: {1}")]
    ParameterName(String, &'static str),
    /// A parameter without a finite value.
    #[error("the parameter '{0}' must be a finite number")]
    ParameterValue(String),
}
