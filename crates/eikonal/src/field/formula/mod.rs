//! Formulas of the index in coordinates: parser, compiler, and evaluation with derivatives, for
//! points and for boxes (docs/theory.md#formulas).

mod compile;
mod error;
mod function;
mod graph;
mod interval;
mod lexer;
mod number;
mod parser;
mod program;
mod real;
mod series;
mod spatial;

pub use error::{FormulaError, FormulaErrorKind};
pub(super) use function::Function;
pub(super) use interval::Interval;
pub(super) use number::Number;
pub(super) use program::Program;
pub(super) use real::Real;
pub(super) use series::Series;
pub(super) use spatial::{GRADIENT, HESSIAN, Spatial, VALUE};

use compile::Compiled;

/// Quantity that a formula computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Index n.
    Index,
    /// Squared index n².
    SquaredIndex,
}

/// A coordinate with which an index may vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Coordinate {
    /// Cartesian coordinate x.
    X,
    /// Cartesian coordinate y.
    Y,
    /// Cartesian coordinate z.
    Z,
    /// Distance r from the origin.
    R,
    /// Distance ρ from the z axis.
    Rho,
}

impl Coordinate {
    /// All coordinates, with their names in formulas.
    pub const ALL: [(&'static str, Coordinate); 5] = [
        ("x", Coordinate::X),
        ("y", Coordinate::Y),
        ("z", Coordinate::Z),
        ("r", Coordinate::R),
        ("rho", Coordinate::Rho),
    ];
}

/// A formula of n² in coordinates, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Formula {
    pub(super) program: Program,
    pub(super) domain: Domain,
    constant: Option<f64>,
    used: Vec<String>,
    pub(super) free: Option<Free>,
}

/// A program with parameters as inputs, after the coordinates.
#[derive(Clone, Debug)]
pub(in crate::field) struct Free {
    program: Program,
    names: Vec<String>,
    values: Vec<f64>,
}

impl Free {
    /// Returns names and values of the parameters.
    pub(in crate::field) fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        let names = self.names.iter().map(String::as_str);
        names.zip(self.values.iter().copied())
    }

    /// Returns the values of the parameters.
    pub(in crate::field) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Evaluates n² from coordinates and parameters.
    pub(in crate::field) fn run<N: Number>(&self, coordinates: &[N], parameters: &[N]) -> N {
        self.program.run_slice(&[coordinates, parameters].concat())
    }
}

/// Coordinate inputs of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Domain {
    /// A single coordinate, the only one that the formula depends on.
    Line(Coordinate),
    /// Coordinates x, y and z.
    Space,
}

impl Formula {
    /// Parses a formula for a quantity, in `x`, `y`, `z`, `r`, `rho`, `pi` and parameters, given by
    /// names and values.
    ///
    /// # Errors
    ///
    /// The error in the text, and its place.
    ///
    /// ```
    /// use morgana_eikonal::field::{Formula, Quantity};
    ///
    /// let lens = Formula::new("2 - (r/R)^2", Quantity::SquaredIndex, &[("R", 1.5)]);
    /// assert!(lens.is_ok_and(|lens| lens.uses("R")));
    /// let wrong = Formula::new("1.3 + 0.1*cis(x)", Quantity::Index, &[]).unwrap_err();
    /// assert_eq!(wrong.to_string(), "unknown name 'cis' in the formula");
    /// assert_eq!(wrong.span, 10..13);
    /// ```
    pub fn new(
        text: &str,
        quantity: Quantity,
        parameters: &[(&str, f64)],
    ) -> Result<Self, FormulaError> {
        let Compiled {
            program,
            domain,
            constant,
            used,
            free,
        } = compile::compiled(text, quantity, parameters)?;
        let value = |name: &String| {
            let known = parameters.iter().find(|(known, _)| known == name);
            known.map_or(f64::NAN, |(_, value)| *value)
        };
        let free = free.map(|program| Free {
            program,
            values: used.iter().map(value).collect(),
            names: used.clone(),
        });
        Ok(Formula {
            free,
            program,
            domain,
            constant,
            used,
        })
    }

    /// Returns n² of a formula that depends on no coordinate.
    pub(super) fn constant(&self) -> Option<f64> {
        self.constant
    }

    /// Returns true if the formula uses the parameter.
    pub fn uses(&self, parameter: &str) -> bool {
        self.used.iter().any(|name| name == parameter)
    }

    /// Returns the built-in names of formulas: coordinates, constants and functions.
    pub fn names() -> impl Iterator<Item = &'static str> {
        compile::names()
    }
}
