//! Formulas as graphs: equal parts are shared, constants are folded, and integer powers become
//! multiplications.

use super::error::FormulaErrorKind;
use super::function::Function;
use super::number::Number;
use super::series::Series;
use std::collections::HashMap;

/// A number that hashes by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Bits(u64);

impl Bits {
    fn of(value: f64) -> Self {
        Bits(value.to_bits())
    }

    pub(super) fn value(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// Index of a node; arguments come before the nodes that use them.
pub(super) type Id = usize;

/// A value of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Constant(Bits),
    Input(usize),
    Add(Id, Id),
    Sub(Id, Id),
    Mul(Id, Id),
    Div(Id, Id),
    Square(Id),
    SignedSquare(Id),
    /// First argument times the second, plus the third.
    Affine(Id, Bits, Bits),
    IntegerPower(Id, i32),
    RealPower(Id, Bits),
    Apply(Id, Function),
    Atan2(Id, Id),
}

impl Node {
    /// Returns the arguments of the node.
    pub(super) fn arguments(self) -> [Option<Id>; 2] {
        match self {
            Node::Constant(_) | Node::Input(_) => [None; 2],
            Node::Add(a, b) | Node::Sub(a, b) | Node::Mul(a, b) | Node::Div(a, b) => {
                [Some(a), Some(b)]
            }
            Node::Atan2(a, b) => [Some(a), Some(b)],
            Node::Square(a) | Node::SignedSquare(a) | Node::Affine(a, ..) => [Some(a), None],
            Node::IntegerPower(a, _) | Node::RealPower(a, _) | Node::Apply(a, _) => [Some(a), None],
        }
    }
}

/// Largest integer exponent.
const MAX_EXPONENT: f64 = 1024.0;

/// Nodes without duplicates.
#[derive(Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    /// Distances with their squares, which are polynomials and therefore smooth.
    distances: Vec<(Id, Id)>,
}

impl Graph {
    pub(super) fn node(&self, id: Id) -> Node {
        self.nodes[id]
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    fn push(&mut self, node: Node) -> Id {
        *self.known.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            self.nodes.len() - 1
        })
    }

    pub(super) fn constant(&mut self, value: f64) -> Id {
        self.push(Node::Constant(Bits::of(value)))
    }

    pub(super) fn input(&mut self, index: usize) -> Id {
        self.push(Node::Input(index))
    }

    /// Returns the value of a node that does not depend on inputs.
    pub(super) fn value(&self, id: Id) -> Option<f64> {
        match self.nodes[id] {
            Node::Constant(bits) => Some(bits.value()),
            _ => None,
        }
    }

    /// Returns the square root of a sum of squares of inputs.
    pub(super) fn distance(&mut self, inputs: impl IntoIterator<Item = usize>) -> Id {
        let squares = inputs.into_iter().map(|i| {
            let x = self.input(i);
            self.square(x)
        });
        let squares: Vec<Id> = squares.collect();
        let sum = squares.into_iter().reduce(|a, b| self.add(a, b));
        let square = sum.unwrap_or_else(|| self.constant(0.0));
        let distance = self.push(Node::Apply(square, Function::Sqrt));
        self.distances.push((distance, square));
        distance
    }

    pub(super) fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(a), Some(b)) => self.constant(a + b),
            (Some(c), None) => self.plus(b, c),
            (None, Some(c)) => self.plus(a, c),
            _ => self.push(Node::Add(a.min(b), a.max(b))),
        }
    }

    pub(super) fn sub(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(a), Some(b)) => self.constant(a - b),
            (None, Some(c)) => self.plus(a, -c),
            (Some(c), None) => {
                let negated = self.times(b, -1.0);
                self.plus(negated, c)
            }
            _ if a == b => self.constant(0.0),
            _ => self.push(Node::Sub(a, b)),
        }
    }

    fn affine(&mut self, a: Id, factor: f64, constant: f64) -> Id {
        self.push(Node::Affine(a, Bits::of(factor), Bits::of(constant)))
    }

    fn plus(&mut self, a: Id, c: f64) -> Id {
        match self.nodes[a] {
            _ if c == 0.0 => a,
            Node::Affine(inner, factor, constant) => {
                self.affine(inner, factor.value(), constant.value() + c)
            }
            _ => self.affine(a, 1.0, c),
        }
    }

    /// Multiplies by a constant. Factors are combined, but not across an added constant, so that
    /// differences of large numbers keep their digits.
    pub(super) fn times(&mut self, a: Id, c: f64) -> Id {
        match self.nodes[a] {
            Node::Constant(value) => self.constant(value.value() * c),
            _ if c == 1.0 => a,
            _ if c == 0.0 => self.constant(0.0),
            Node::Affine(inner, factor, constant) if constant.value() == 0.0 => {
                self.times(inner, factor.value() * c)
            }
            _ => self.affine(a, c, 0.0),
        }
    }

    pub(super) fn mul(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (_, Some(c)) => self.times(a, c),
            (Some(c), None) => self.times(b, c),
            _ if a == b => self.square(a),
            _ => self.push(Node::Mul(a.min(b), a.max(b))),
        }
    }

    pub(super) fn div(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(a), Some(b)) => self.constant(a / b),
            // Multiply by the reciprocal of a constant: it is rounded once more, but faster.
            (None, Some(0.0)) => self.constant(f64::NAN),
            (None, Some(c)) if (1.0 / c).is_finite() => self.times(a, 1.0 / c),
            (Some(c), None) => {
                let reciprocal = self.push(Node::IntegerPower(b, -1));
                self.times(reciprocal, c)
            }
            _ => self.push(Node::Div(a, b)),
        }
    }

    /// Returns the square; the square of a distance is a polynomial.
    pub(super) fn square(&mut self, a: Id) -> Id {
        if let Some(value) = self.value(a) {
            return self.constant(value * value);
        }
        let distance = self.distances.iter().find(|(id, _)| *id == a);
        match (distance, self.nodes[a]) {
            (Some((_, square)), _) => *square,
            (None, Node::Affine(inner, factor, constant)) if constant.value() == 0.0 => {
                let square = self.square(inner);
                self.times(square, factor.value() * factor.value())
            }
            _ => self.push(Node::Square(a)),
        }
    }

    /// Returns n² of an index n, with the sign of n, so that a negative index is not mistaken for a
    /// medium.
    pub(super) fn signed_square(&mut self, a: Id) -> Id {
        match self.value(a) {
            Some(n) => self.constant(n * n.abs()),
            None => self.push(Node::SignedSquare(a)),
        }
    }

    pub(super) fn power(&mut self, a: Id, b: Id) -> Result<Id, FormulaErrorKind> {
        match (self.value(a), self.value(b)) {
            (Some(a), Some(b)) => Ok(self.constant(a.powf(b))),
            (None, Some(p)) if p.fract() == 0.0 => {
                if p.abs() > MAX_EXPONENT {
                    return Err(FormulaErrorKind::Exponent);
                }
                Ok(self.integer_power(a, p as i32))
            }
            (None, Some(0.5)) => Ok(self.apply(a, Function::Sqrt)),
            (None, Some(p)) => Ok(self.push(Node::RealPower(a, Bits::of(p)))),
            _ => {
                let log = self.apply(a, Function::Log);
                let exponent = self.mul(b, log);
                Ok(self.apply(exponent, Function::Exp))
            }
        }
    }

    fn integer_power(&mut self, a: Id, k: i32) -> Id {
        match k {
            0 => self.constant(1.0),
            1 => a,
            2 => self.square(a),
            k if k % 2 == 0 && self.distances.iter().any(|(id, _)| *id == a) => {
                let square = self.square(a);
                self.integer_power(square, k / 2)
            }
            k => self.push(Node::IntegerPower(a, k)),
        }
    }

    pub(super) fn apply(&mut self, a: Id, function: Function) -> Id {
        match self.value(a) {
            Some(value) => self.constant(Series([value]).apply(function).0[0]),
            None => self.push(Node::Apply(a, function)),
        }
    }

    pub(super) fn atan2(&mut self, y: Id, x: Id) -> Id {
        match (self.value(y), self.value(x)) {
            (Some(y), Some(x)) => self.constant(y.atan2(x)),
            _ => self.push(Node::Atan2(y, x)),
        }
    }
}
