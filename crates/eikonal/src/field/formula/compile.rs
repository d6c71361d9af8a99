//! Compiler from the tree of a formula to its program: resolves names, and determines which inputs
//! the formula depends on.

use super::error::{FormulaError, FormulaErrorKind as Kind};
use super::function::{Function, NAMED};
use super::graph::{Graph, Id};
use super::lexer::is_name;
use super::parser::{Expr, ExprKind, parse};
use super::program::Program;
use super::{Coordinate, Domain, Quantity};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Functions of two arguments.
const BINARY: [&str; 2] = ["pow", "atan2"];
/// Functions that are not smooth, so that rays cannot pass, with advice on replacements.
const NOT_SMOOTH: [(&str, &str); 10] = [
    ("abs", "sqrt(u^2 + a^2) rounds the kink off over a length a"),
    ("min", "use a smooth transition, such as one with tanh"),
    ("max", "use a smooth transition, such as one with tanh"),
    ("floor", "put a surface where the index jumps"),
    ("ceil", "put a surface where the index jumps"),
    ("round", "put a surface where the index jumps"),
    (
        "sign",
        "use tanh(u/a), or put a surface where the index jumps",
    ),
    (
        "step",
        "use tanh(u/a), or put a surface where the index jumps",
    ),
    ("mod", "put a surface where the index jumps"),
    ("clamp", "use a smooth transition, such as one with tanh"),
];

/// Result of compiling a text.
pub(super) struct Compiled {
    pub program: Program,
    pub domain: Domain,
    pub constant: Option<f64>,
    pub used: Vec<String>,
    pub free: Option<Program>,
}

/// Returns all names that have a meaning.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    let coordinates = Coordinate::ALL.into_iter().map(|(name, _)| name);
    let functions = NAMED.into_iter().map(|(name, _)| name);
    coordinates.chain(["pi"]).chain(functions).chain(BINARY)
}

pub(super) fn compiled(
    text: &str,
    quantity: Quantity,
    parameters: &[(&str, f64)],
) -> Result<Compiled, FormulaError> {
    let whole = |kind| FormulaError {
        kind,
        span: 0..text.len(),
    };
    check(parameters).map_err(whole)?;
    let tree = parse(text)?;
    let mut found = BTreeSet::new();
    collect(&tree, &mut found);
    let coordinates = Coordinate::ALL
        .into_iter()
        .filter(|(name, _)| found.contains(name));
    let coordinates: Vec<Coordinate> = coordinates.map(|(_, coordinate)| coordinate).collect();
    let domain = match coordinates[..] {
        [] => Domain::Line(Coordinate::X),
        [only] => Domain::Line(only),
        _ => Domain::Space,
    };
    let mut compiler = Compiler {
        graph: Graph::default(),
        domain,
        parameters,
        free: Vec::new(),
    };
    let n2 = compiler.square(&tree, quantity)?;
    let program = Program::new(&compiler.graph, n2, inputs(domain)).map_err(whole)?;
    let used = parameters.iter().filter(|(name, _)| found.contains(name));
    let used: Vec<&str> = used.map(|(name, _)| *name).collect();
    Ok(Compiled {
        program,
        domain,
        constant: compiler.graph.value(n2),
        free: free(&tree, quantity, &compiler, &used),
        used: used.into_iter().map(String::from).collect(),
    })
}

/// Returns the number of inputs that are coordinates.
fn inputs(domain: Domain) -> usize {
    if domain == Domain::Space { 3 } else { 1 }
}

/// Returns the program with parameters as further inputs; `None` without parameters, or if there
/// are too few registers.
fn free(tree: &Expr, quantity: Quantity, fixed: &Compiler, parameters: &[&str]) -> Option<Program> {
    if parameters.is_empty() {
        return None;
    }
    let mut compiler = Compiler {
        graph: Graph::default(),
        domain: fixed.domain,
        parameters: fixed.parameters,
        free: parameters.to_vec(),
    };
    let n2 = compiler.square(tree, quantity).ok()?;
    Program::new(&compiler.graph, n2, inputs(fixed.domain) + parameters.len()).ok()
}

fn check(parameters: &[(&str, f64)]) -> Result<(), Kind> {
    for (i, (name, value)) in parameters.iter().enumerate() {
        let wrong = |why| Kind::ParameterName((*name).to_owned(), why);
        if !is_name(name) {
            return Err(wrong("names are made of letters, digits and underscores"));
        }
        if names().any(|taken| taken == *name) {
            return Err(wrong("it has a meaning in formulas"));
        }
        if parameters[..i].iter().any(|(taken, _)| taken == name) {
            return Err(wrong("another parameter has it"));
        }
        if !value.is_finite() {
            return Err(Kind::ParameterValue((*name).to_owned()));
        }
    }
    Ok(())
}

/// Collects the names in a tree, except names of functions.
fn collect<'a>(tree: &'a Expr, found: &mut BTreeSet<&'a str>) {
    match &tree.kind {
        ExprKind::Number(_) => {}
        ExprKind::Name(name) => {
            found.insert(name);
        }
        ExprKind::Call(_, arguments) => arguments.iter().for_each(|a| collect(a, found)),
        ExprKind::Negated(inner) => collect(inner, found),
        ExprKind::Power(both) => both.iter().for_each(|a| collect(a, found)),
        ExprKind::Chain(first, others) => {
            collect(first, found);
            others.iter().for_each(|(_, a)| collect(a, found));
        }
    }
}

struct Compiler<'a> {
    graph: Graph,
    domain: Domain,
    parameters: &'a [(&'a str, f64)],
    /// Parameters that are inputs instead of constants.
    free: Vec<&'a str>,
}

impl Compiler<'_> {
    /// Returns the node of n².
    fn square(&mut self, tree: &Expr, quantity: Quantity) -> Result<Id, FormulaError> {
        let value = self.node(tree)?;
        Ok(match quantity {
            Quantity::Index => self.graph.signed_square(value),
            Quantity::SquaredIndex => value,
        })
    }

    /// Returns the node of a part of the tree, with the values of all parameters as constants.
    fn fixed(&mut self, tree: &Expr) -> Result<Id, FormulaError> {
        let free = std::mem::take(&mut self.free);
        let id = self.node(tree);
        self.free = free;
        id
    }

    /// Returns the node of a power. If a parameter in the exponent is an input, the node is the
    /// power with the parameter's value, times a factor for the change of the exponent. Negative
    /// bases thus keep their integer powers.
    fn power(&mut self, base: Id, exponent: &Expr) -> Result<Id, FormulaError> {
        let at = |kind| FormulaError {
            kind,
            span: exponent.span.clone(),
        };
        let (free, fixed) = (self.node(exponent)?, self.fixed(exponent)?);
        let power = self.graph.power(base, fixed).map_err(at)?;
        if free == fixed || self.graph.value(fixed).is_none() {
            return self.graph.power(base, free).map_err(at);
        }
        let (square, change) = (self.graph.square(base), self.graph.sub(free, fixed));
        let log = self.graph.apply(square, Function::Log);
        let turned = self.graph.mul(change, log);
        let turned = self.graph.times(turned, 0.5);
        let factor = self.graph.apply(turned, Function::Exp);
        Ok(self.graph.mul(power, factor))
    }

    /// Returns the node of a part of the tree.
    fn node(&mut self, tree: &Expr) -> Result<Id, FormulaError> {
        let at = |kind| FormulaError {
            kind,
            span: tree.span.clone(),
        };
        let id = match &tree.kind {
            ExprKind::Number(value) => self.graph.constant(*value),
            ExprKind::Name(name) => self.named(name).map_err(at)?,
            ExprKind::Call(name, arguments) => {
                let span = tree.span.start..tree.span.start + name.len();
                let on_name = |kind| FormulaError {
                    kind,
                    span: span.clone(),
                };
                self.known(name, arguments.len()).map_err(on_name)?;
                if let ("pow", [base, exponent]) = (name.as_str(), &arguments[..]) {
                    let base = self.node(base)?;
                    return self.power(base, exponent);
                }
                let ids = arguments.iter().map(|a| self.node(a));
                let ids: Vec<Id> = ids.collect::<Result<_, _>>()?;
                self.call(name, &ids).map_err(at)?
            }
            ExprKind::Negated(inner) => {
                let inner = self.node(inner)?;
                self.graph.times(inner, -1.0)
            }
            ExprKind::Power(both) => {
                let [base, exponent] = &**both;
                let base = self.node(base)?;
                self.power(base, exponent)?
            }
            ExprKind::Chain(first, others) => {
                let mut left = self.node(first)?;
                for (operator, right) in others {
                    let right = self.node(right)?;
                    left = match operator {
                        '+' => self.graph.add(left, right),
                        '-' => self.graph.sub(left, right),
                        '*' => self.graph.mul(left, right),
                        _ => self.graph.div(left, right),
                    };
                }
                left
            }
        };
        match self.graph.value(id) {
            Some(value) if !value.is_finite() => Err(at(Kind::NotFinite)),
            _ => Ok(id),
        }
    }

    fn named(&mut self, name: &str) -> Result<Id, Kind> {
        if let Some(number) = self.free.iter().position(|known| *known == name) {
            return Ok(self.graph.input(inputs(self.domain) + number));
        }
        if let Some((_, value)) = self.parameters.iter().find(|(known, _)| *known == name) {
            return Ok(self.graph.constant(*value));
        }
        if name == "pi" {
            return Ok(self.graph.constant(PI));
        }
        let coordinate = Coordinate::ALL
            .into_iter()
            .find(|(known, _)| *known == name);
        match (coordinate, self.domain) {
            (Some(_), Domain::Line(_)) => Ok(self.graph.input(0)),
            (Some((_, coordinate)), Domain::Space) => Ok(match coordinate {
                Coordinate::X => self.graph.input(0),
                Coordinate::Y => self.graph.input(1),
                Coordinate::Z => self.graph.input(2),
                Coordinate::Rho => self.graph.distance(0..2),
                Coordinate::R => self.graph.distance(0..3),
            }),
            (None, _) if names().any(|known| known == name) => {
                Err(Kind::NoArguments(name.to_owned()))
            }
            (None, _) => Err(Kind::UnknownName(name.to_owned())),
        }
    }

    /// Checks that a function exists and takes `found` arguments.
    fn known(&self, name: &str, found: usize) -> Result<(), Kind> {
        let name = name.to_owned();
        let not_smooth = NOT_SMOOTH.iter().find(|(known, _)| *known == name);
        if let Some((_, instead)) = not_smooth {
            return Err(Kind::NotSmooth { name, instead });
        }
        let expected = if BINARY.contains(&&*name) {
            2
        } else if NAMED.iter().any(|(known, _)| *known == name) {
            1
        } else if names().any(|known| known == name)
            || self.parameters.iter().any(|(known, _)| *known == name)
        {
            return Err(Kind::NotAFunction(name));
        } else {
            return Err(Kind::UnknownName(name));
        };
        if found == expected {
            return Ok(());
        }
        Err(Kind::ArgumentCount {
            name,
            expected,
            found,
        })
    }

    fn call(&mut self, name: &str, ids: &[Id]) -> Result<Id, Kind> {
        let function = NAMED.iter().find(|(known, _)| *known == name);
        match (function, ids) {
            (Some((_, function)), [a]) => Ok(self.graph.apply(*a, *function)),
            (None, [a, b]) => Ok(self.graph.atan2(*a, *b)),
            _ => Err(Kind::UnknownName(name.to_owned())),
        }
    }
}
