//! Parser from tokens to a tree, by precedence: + and − bind least, then * and /, signs, and
//! powers, which group from the right.

use super::error::{FormulaError, FormulaErrorKind as Kind};
use super::lexer::{Placed, Token, words};
use std::ops::Range;

/// Maximum number of characters of a formula.
const MAX_CHARACTERS: usize = 4096;
/// Maximum number of nesting levels: the stack of a thread must hold them.
const MAX_LEVELS: usize = 200;

/// A part of a formula, and its place.
#[derive(Clone, Debug)]
pub(super) struct Expr {
    pub kind: ExprKind,
    pub span: Range<usize>,
}

/// Kind of a part of a formula.
#[derive(Clone, Debug)]
pub(super) enum ExprKind {
    Number(f64),
    Name(String),
    Call(String, Vec<Expr>),
    Negated(Box<Expr>),
    /// Operands joined by + and −, or by * and /; each operator is stored with the operand after
    /// it.
    Chain(Box<Expr>, Vec<(char, Expr)>),
    Power(Box<[Expr; 2]>),
}

/// Parses the tree of a formula.
pub(super) fn parse(text: &str) -> Result<Expr, FormulaError> {
    if text.len() > MAX_CHARACTERS {
        let (kind, span) = (Kind::TooLong(MAX_CHARACTERS), 0..text.len());
        return Err(FormulaError { kind, span });
    }
    let words = words(text)?;
    let mut parser = Parser {
        words,
        at: 0,
        levels: 0,
    };
    let whole = parser.sum()?;
    match parser.peek() {
        (Token::End, _) => Ok(whole),
        _ => Err(parser.unexpected("an operator")),
    }
}

struct Parser {
    words: Vec<Placed>,
    at: usize,
    levels: usize,
}

impl Parser {
    fn peek(&self) -> &Placed {
        &self.words[self.at]
    }

    /// Consumes the next token and returns its symbol, if it is one of `symbols`.
    fn pass(&mut self, symbols: &str) -> Option<char> {
        match self.peek() {
            (Token::Symbol(c), _) if symbols.contains(*c) => {
                let c = *c;
                self.at += 1;
                Some(c)
            }
            _ => None,
        }
    }

    fn unexpected(&self, expected: &'static str) -> FormulaError {
        let (token, span) = self.peek().clone();
        let found = match token {
            Token::End => {
                let kind = Kind::End(expected);
                return FormulaError { kind, span };
            }
            Token::Number(value) => value.to_string(),
            Token::Name(name) => name,
            Token::Symbol(c) => c.to_string(),
        };
        let kind = Kind::Unexpected { expected, found };
        FormulaError { kind, span }
    }

    /// Enters a nesting level; callers decrement `levels` when they leave it.
    fn deeper(&mut self) -> Result<(), FormulaError> {
        self.levels += 1;
        if self.levels <= MAX_LEVELS {
            return Ok(());
        }
        let (kind, span) = (Kind::TooDeep, self.peek().1.clone());
        Err(FormulaError { kind, span })
    }

    fn sum(&mut self) -> Result<Expr, FormulaError> {
        self.chain("+-", Parser::product)
    }

    fn product(&mut self) -> Result<Expr, FormulaError> {
        self.chain("*/", Parser::signed)
    }

    /// Parses operands with operators between them, grouped from the left.
    fn chain(
        &mut self,
        operators: &str,
        operand: fn(&mut Parser) -> Result<Expr, FormulaError>,
    ) -> Result<Expr, FormulaError> {
        self.deeper()?;
        let (first, mut others) = (operand(self)?, Vec::new());
        while let Some(operator) = self.pass(operators) {
            others.push((operator, operand(self)?));
        }
        self.levels -= 1;
        let Some((_, last)) = others.last() else {
            return Ok(first);
        };
        let span = first.span.start..last.span.end;
        let kind = ExprKind::Chain(Box::new(first), others);
        Ok(Expr { kind, span })
    }

    fn signed(&mut self) -> Result<Expr, FormulaError> {
        let start = self.peek().1.start;
        match self.pass("+-") {
            None => self.power(),
            Some(sign) => {
                self.deeper()?;
                let operand = self.signed()?;
                self.levels -= 1;
                let span = start..operand.span.end;
                Ok(match sign {
                    '-' => Expr {
                        kind: ExprKind::Negated(Box::new(operand)),
                        span,
                    },
                    _ => operand,
                })
            }
        }
    }

    fn power(&mut self) -> Result<Expr, FormulaError> {
        let base = self.atom()?;
        if self.pass("^").is_none() {
            return Ok(base);
        }
        self.deeper()?;
        let exponent = self.signed()?;
        self.levels -= 1;
        let span = base.span.start..exponent.span.end;
        let kind = ExprKind::Power(Box::new([base, exponent]));
        Ok(Expr { kind, span })
    }

    fn atom(&mut self) -> Result<Expr, FormulaError> {
        let (token, span) = self.peek().clone();
        let kind = match token {
            Token::Number(value) => ExprKind::Number(value),
            Token::Name(name) => {
                self.at += 1;
                return self.named(name, span);
            }
            Token::Symbol('(') => {
                self.at += 1;
                let inner = self.sum()?;
                let end = self.closing()?;
                return Ok(Expr {
                    span: span.start..end,
                    ..inner
                });
            }
            _ => return Err(self.unexpected("a value")),
        };
        self.at += 1;
        Ok(Expr { kind, span })
    }

    /// Parses a name, or a call if parentheses follow.
    fn named(&mut self, name: String, span: Range<usize>) -> Result<Expr, FormulaError> {
        if self.pass("(").is_none() {
            let kind = ExprKind::Name(name);
            return Ok(Expr { kind, span });
        }
        let mut arguments = vec![self.sum()?];
        while self.pass(",").is_some() {
            arguments.push(self.sum()?);
        }
        let end = self.closing()?;
        let kind = ExprKind::Call(name, arguments);
        Ok(Expr {
            kind,
            span: span.start..end,
        })
    }

    /// Consumes a closing parenthesis, and returns its end.
    fn closing(&mut self) -> Result<usize, FormulaError> {
        let end = self.peek().1.end;
        match self.pass(")") {
            Some(_) => Ok(end),
            None => Err(self.unexpected("')'")),
        }
    }
}
