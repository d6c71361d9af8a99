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
    /// A character that has no meaning in formulas.
    #[error("unexpected character '{0}' in the formula")]
    Character(char),
    /// Digits that do not form a number.
    #[error("'{0}' is not a number")]
    Number(String),
    /// The formula ends too early.
    #[error("the formula ends too early: expected {0}")]
    End(&'static str),
    /// A token other than the expected one.
    #[error("expected {expected}, found '{found}'")]
    Unexpected {
        /// Expected token.
        expected: &'static str,
        /// Token in the formula.
        found: String,
    },
    /// An unknown name.
    #[error("unknown name '{0}' in the formula")]
    UnknownName(String),
    /// A function that has a kink or a step.
    #[error("'{name}' has a kink or a step, but rays need a smooth index: {instead}")]
    NotSmooth {
        /// Name of the function.
        name: String,
        /// Advice on a smooth replacement.
        instead: &'static str,
    },
    /// A function without arguments in parentheses.
    #[error("'{0}' is a function: write its argument in parentheses")]
    NoArguments(String),
    /// A name that is not a function, followed by arguments.
    #[error("'{0}' is not a function: write * to multiply")]
    NotAFunction(String),
    /// A function with the wrong number of arguments.
    #[error("'{name}' takes {expected} argument{}, not {found}", if *expected == 1 { "" } else { "s" })]
    ArgumentCount {
        /// Name of the function.
        name: String,
        /// Number of arguments that the function takes.
        expected: usize,
        /// Number of arguments in the formula.
        found: usize,
    },
    /// A constant part without a finite value.
    #[error(
        "this constant part of the formula is not a finite number: check it for a division by 0, or for a root or logarithm of a negative number"
    )]
    NotFinite,
    /// An integer exponent beyond the limit.
    #[error("the exponent is too large: an integer exponent may be at most 1024")]
    Exponent,
    /// Too many characters.
    #[error("the formula is too long: it may have at most {0} characters")]
    TooLong(usize),
    /// Too many levels of parentheses, signs or powers.
    #[error("the formula is nested too deeply: use fewer levels of parentheses, signs and powers")]
    TooDeep,
    /// More simultaneous intermediate values than a program can hold.
    #[error("the formula needs too many intermediate values at once: shorten it")]
    TooComplicated,
    /// A parameter name that is taken, or that cannot be written in a formula.
    #[error("'{0}' cannot be the name of a parameter: {1}")]
    ParameterName(String, &'static str),
    /// A parameter without a finite value.
    #[error("the parameter '{0}' must be a finite number")]
    ParameterValue(String),
}
