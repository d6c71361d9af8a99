//! Formulas of the index in coordinates: parsed, compiled, and evaluated with derivatives, for points and for boxes
//! (docs/theory.md#formulas).

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

/// What a formula gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The index n.
    Index,
    /// Its square n².
    SquaredIndex,
}

/// A coordinate by which an index may vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Coordinate {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
    /// r, the distance from the origin.
    R,
    /// ρ, the distance from the z axis.
    Rho,
}

impl Coordinate {
    /// All of them, with their names in formulas.
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
    /// Names and values of the parameters.
    pub(in crate::field) fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        let names = self.names.iter().map(String::as_str);
        names.zip(self.values.iter().copied())
    }

    /// The values of the parameters.
    pub(in crate::field) fn values(&self) -> &[f64] {
        &self.values
    }

    /// n² by coordinates and parameters.
    pub(in crate::field) fn run<N: Number>(&self, coordinates: &[N], parameters: &[N]) -> N {
        self.program.run_slice(&[coordinates, parameters].concat())
    }
}

/// The inputs of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Domain {
    /// One coordinate, which is all that it depends on.
    Line(Coordinate),
    /// x, y and z.
    Space,
}

impl Formula {
    /// The formula that a text gives of a quantity, in `x`, `y`, `z`, `r`, `rho`, `pi` and parameters: names and values.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    ///
    /// ```
    /// use morgana_eikonal::field::{Formula, Quantity};
    ///
    /// let lens = Formula::new("2 - (r/R)^2", Quantity::SquaredIndex, &[("R", 1.5)]);
    /// assert!(lens.is_ok_and(|lens| lens.uses("R")));
    /// let wrong = Formula::new("1.3 + 0.1*cis(x)", Quantity::Index, &[]).unwrap_err();
    /// assert_eq!(wrong.to_string(), "the formula knows no 'cis'");
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

    /// n² of a formula that depends on no coordinate.
    pub(super) fn constant(&self) -> Option<f64> {
        self.constant
    }

    /// Whether the value of a parameter counts.
    pub fn uses(&self, parameter: &str) -> bool {
        self.used.iter().any(|name| name == parameter)
    }

    /// What formulas know besides parameters: coordinates, constants and functions.
    pub fn names() -> impl Iterator<Item = &'static str> {
        compile::names()
    }
}
