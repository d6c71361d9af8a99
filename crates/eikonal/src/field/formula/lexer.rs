//! Tokens of a formula.

use super::error::{FormulaError, FormulaErrorKind};
use std::ops::Range;

/// Token of a formula.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Number(f64),
    Name(String),
    /// Symbol + − * / ^ ( ) or the comma.
    Symbol(char),
    End,
}

/// A token and its place.
pub(super) type Placed = (Token, Range<usize>);

/// Operators as printed in books, and their plain forms.
const PRINTED: [(char, char); 5] = [('−', '-'), ('·', '*'), ('×', '*'), ('⋅', '*'), ('÷', '/')];
/// Letters as printed in books, and their names.
const LETTERS: [(char, &str); 2] = [('π', "pi"), ('ρ', "rho")];

/// Splits a text into tokens; the last token is the end.
pub(super) fn words(text: &str) -> Result<Vec<Placed>, FormulaError> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let printed = PRINTED.iter().find(|(print, _)| *print == c);
        let letter = LETTERS.iter().find(|(print, _)| *print == c);
        let (token, length) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '0'..='9' | '.' => number(text, at)?,
            'a'..='z' | 'A'..='Z' | '_' => name(&text[at..]),
            '*' if text[at..].starts_with("**") => (Token::Symbol('^'), 2),
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | ',' => (Token::Symbol(c), 1),
            _ => match (printed, letter) {
                (Some((_, plain)), _) => (Token::Symbol(*plain), c.len_utf8()),
                (_, Some((_, name))) => (Token::Name((*name).to_owned()), c.len_utf8()),
                _ => {
                    let (kind, span) = (FormulaErrorKind::Character(c), at..at + c.len_utf8());
                    return Err(FormulaError { kind, span });
                }
            },
        };
        words.push((token, at..at + length));
        at += length;
    }
    words.push((Token::End, text.len()..text.len()));
    Ok(words)
}

/// Returns true if the text is a valid name of a parameter: letters, digits and underscores, not
/// starting with a digit.
pub(super) fn is_name(text: &str) -> bool {
    let (token, length) = name(text);
    length == text.len()
        && !text.is_empty()
        && token == Token::Name(text.to_owned())
        && !text.starts_with(|c: char| c.is_ascii_digit())
}

fn name(text: &str) -> (Token, usize) {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let length = text.find(|c| !is_part(c)).unwrap_or(text.len());
    (Token::Name(text[..length].to_owned()), length)
}

/// Reads digits with an optional point and exponent.
fn number(text: &str, at: usize) -> Result<(Token, usize), FormulaError> {
    let rest = &text.as_bytes()[at..];
    let digits = |from: usize| {
        let count = rest[from.min(rest.len())..].iter();
        from + count.take_while(|b| b.is_ascii_digit()).count()
    };
    let mut length = digits(0);
    if rest.get(length) == Some(&b'.') {
        length = digits(length + 1);
    }
    if matches!(rest.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(rest.get(length + 1), Some(b'+' | b'-')));
        let end = digits(length + 1 + sign);
        if end > length + 1 + sign {
            length = end;
        }
    }
    let written = &text[at..at + length];
    match written.parse() {
        Ok(value) if f64::is_finite(value) => Ok((Token::Number(value), length)),
        _ => Err(FormulaError {
            kind: FormulaErrorKind::Number(written.to_owned()),
            span: at..at + length,
        }),
    }
}
