//! Programs of graphs: instructions on a few registers, which run without allocation.

use super::error::FormulaErrorKind;
use super::function::Function;
use super::graph::{Graph, Id, Node};
use super::number::Number;

/// Numbers of registers of small and of large programs: powers of two.
const REGISTERS: [usize; 2] = [8, 64];

/// An operation. Its operands are register numbers, in addition to the register of the instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
    Constant(f64),
    Add(u8),
    Sub(u8),
    Mul(u8),
    Div(u8),
    Square,
    SignedSquare,
    Affine(f64, f64),
    IntegerPower(i32),
    RealPower(f64),
    Apply(Function),
    Atan2(u8),
}

/// An operation on the register `from`, with the result in the register `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Instruction {
    operation: Operation,
    from: u8,
    to: u8,
}

/// Program of a formula, ready to be evaluated. The first registers hold the inputs.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::field) struct Program {
    instructions: Vec<Instruction>,
    result: u8,
    is_large: bool,
}

impl Program {
    /// Compiles the program of a node of a graph with `inputs` inputs.
    pub(super) fn new(graph: &Graph, root: Id, inputs: usize) -> Result<Self, FormulaErrorKind> {
        if inputs > REGISTERS[1] {
            return Err(FormulaErrorKind::TooComplicated);
        }
        // Find the last use of each node.
        let order = order(graph, root);
        let mut last_use = vec![0; graph.len()];
        for (at, id) in order.iter().enumerate() {
            for argument in graph.node(*id).arguments().into_iter().flatten() {
                last_use[argument] = at;
            }
        }
        last_use[root] = usize::MAX;
        // Emit instructions; registers are reused after the last use of their values.
        let mut allocation = Allocation::new(graph.len(), inputs);
        let mut instructions = Vec::new();
        for (at, id) in order.iter().enumerate() {
            let node = graph.node(*id);
            if let Node::Input(index) = node {
                allocation.of[*id] = index as u8;
                continue;
            }
            let (operation, from) = translated(node, &allocation.of);
            let mut arguments: Vec<Id> = node.arguments().into_iter().flatten().collect();
            arguments.dedup();
            for argument in arguments {
                if last_use[argument] == at {
                    allocation.free.push(allocation.of[argument]);
                }
            }
            let to = allocation.take()?;
            allocation.of[*id] = to;
            let instruction = Instruction {
                operation,
                from,
                to,
            };
            instructions.push(instruction);
        }
        Ok(Program {
            instructions,
            result: allocation.of[root],
            is_large: usize::from(allocation.count) > REGISTERS[0],
        })
    }

    /// Returns the number of operations.
    pub(in crate::field) fn len(&self) -> usize {
        self.instructions.len()
    }

    /// Evaluates the program for the inputs.
    #[inline]
    pub(in crate::field) fn run<N: Number, const I: usize>(&self, inputs: [N; I]) -> N {
        if self.is_large {
            self.run_large(inputs)
        } else {
            self.run_in::<N, I, { REGISTERS[0] }>(inputs)
        }
    }

    #[inline(never)]
    fn run_large<N: Number, const I: usize>(&self, inputs: [N; I]) -> N {
        self.run_in::<N, I, { REGISTERS[1] }>(inputs)
    }

    /// Evaluates the program for any number of inputs, at least one.
    pub(in crate::field) fn run_slice<N: Number>(&self, inputs: &[N]) -> N {
        let mut registers = [inputs[0]; REGISTERS[1]];
        registers[..inputs.len()].copy_from_slice(inputs);
        self.run_on(registers)
    }

    #[inline(always)]
    fn run_in<N: Number, const I: usize, const R: usize>(&self, inputs: [N; I]) -> N {
        let mut registers = [inputs[0]; R];
        registers[..I].copy_from_slice(&inputs);
        self.run_on(registers)
    }

    #[inline(always)]
    fn run_on<N: Number, const R: usize>(&self, mut registers: [N; R]) -> N {
        // Take the remainder, so that the compiler knows that the register exists.
        let at = |i: u8| usize::from(i) % R;
        for instruction in &self.instructions {
            let (a, to) = (at(instruction.from), at(instruction.to));
            match instruction.operation {
                Operation::Constant(value) => registers[to] = N::constant(value),
                Operation::Add(i) => registers[to] = registers[a].add(&registers[at(i)]),
                Operation::Sub(i) => registers[to] = registers[a].sub(&registers[at(i)]),
                Operation::Mul(i) => registers[to] = registers[a].mul(&registers[at(i)]),
                Operation::Div(i) => registers[to] = registers[a].div(&registers[at(i)]),
                Operation::Square => registers[to] = registers[a].square(),
                Operation::SignedSquare => registers[to] = registers[a].signed_square(),
                Operation::Affine(factor, constant) => {
                    registers[to] = registers[a].times(factor).plus(constant)
                }
                Operation::IntegerPower(k) => registers[to] = registers[a].integer_power(k),
                Operation::RealPower(p) => registers[to] = registers[a].real_power(p),
                Operation::Apply(function) => registers[to] = registers[a].apply(function),
                Operation::Atan2(i) => registers[to] = registers[a].atan2(&registers[at(i)]),
            }
        }
        registers[at(self.result)]
    }
}

/// Assignment of registers to nodes, and free registers.
struct Allocation {
    of: Vec<u8>,
    free: Vec<u8>,
    count: u8,
}

impl Allocation {
    /// Creates an allocation with the inputs in the first registers.
    fn new(nodes: usize, inputs: usize) -> Self {
        Allocation {
            of: vec![0; nodes],
            free: Vec::new(),
            count: inputs as u8,
        }
    }

    fn take(&mut self) -> Result<u8, FormulaErrorKind> {
        if let Some(register) = self.free.pop() {
            return Ok(register);
        }
        if usize::from(self.count) == REGISTERS[1] {
            return Err(FormulaErrorKind::TooComplicated);
        }
        self.count += 1;
        Ok(self.count - 1)
    }
}

/// Orders the nodes that a node needs, each after its arguments, the node itself last. The argument
/// with the higher subtree comes first, so that the other does not occupy a register meanwhile.
fn order(graph: &Graph, root: Id) -> Vec<Id> {
    let mut height = vec![0; graph.len()];
    for id in 0..graph.len() {
        let arguments = graph.node(id).arguments().into_iter().flatten();
        height[id] = arguments.map(|a| height[a] + 1).max().unwrap_or(0);
    }
    let mut placed = vec![false; graph.len()];
    let (mut order, mut open) = (Vec::new(), vec![(root, false)]);
    while let Some((id, ready)) = open.pop() {
        if placed[id] {
            continue;
        }
        if ready {
            placed[id] = true;
            order.push(id);
            continue;
        }
        open.push((id, true));
        let arguments = graph.node(id).arguments().into_iter().flatten();
        let mut arguments: Vec<Id> = arguments.collect();
        arguments.sort_by_key(|a| height[*a]);
        open.extend(arguments.into_iter().map(|a| (a, false)));
    }
    order
}

/// Translates a node to an operation on registers.
fn translated(node: Node, of: &[u8]) -> (Operation, u8) {
    match node {
        // Inputs are in registers already.
        Node::Input(index) => (Operation::Affine(1.0, 0.0), index as u8),
        Node::Constant(value) => (Operation::Constant(value.value()), 0),
        Node::Add(a, b) => (Operation::Add(of[b]), of[a]),
        Node::Sub(a, b) => (Operation::Sub(of[b]), of[a]),
        Node::Mul(a, b) => (Operation::Mul(of[b]), of[a]),
        Node::Div(a, b) => (Operation::Div(of[b]), of[a]),
        Node::Atan2(a, b) => (Operation::Atan2(of[b]), of[a]),
        Node::Square(a) => (Operation::Square, of[a]),
        Node::SignedSquare(a) => (Operation::SignedSquare, of[a]),
        Node::Affine(a, factor, constant) => {
            (Operation::Affine(factor.value(), constant.value()), of[a])
        }
        Node::IntegerPower(a, k) => (Operation::IntegerPower(k), of[a]),
        Node::RealPower(a, p) => (Operation::RealPower(p.value()), of[a]),
        Node::Apply(a, function) => (Operation::Apply(function), of[a]),
    }
}
