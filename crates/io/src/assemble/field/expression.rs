//! Indices given by a formula.

use crate::diagnostic::suggest;
use crate::query::Query;
use crate::scene::{Property, Value};
use eikonal::Field;
use eikonal::field::{Formula, FormulaError, FormulaErrorKind, Quantity};

/// Parameters that are not named numbers of the formula.
const OWN: [&str; 3] = ["n", "n2", "to_world"];

/// Builds the field of a volume of type `expression`; `None` after an error.
pub(super) fn build(q: &mut Query) -> Option<Field> {
    let numbers = numbers(q);
    let (name, quantity) = match (q.has("n"), q.has("n2")) {
        (true, false) => ("n", Quantity::Index),
        (false, true) => ("n2", Quantity::SquaredIndex),
        (false, false) => {
            q.error(
                "n",
                "an expression needs 'n', a formula of the index, or 'n2', a formula of its square",
            );
            return None;
        }
        (true, true) => {
            q.error(
                "n2",
                "give 'n', a formula of the index, or 'n2', a formula of its square, not both",
            );
            return None;
        }
    };
    let text = q.string(name);
    let named: Vec<(&str, f64)> = numbers.iter().map(|(name, v)| (&**name, *v)).collect();
    match Formula::new(&text, quantity, &named) {
        Ok(formula) => {
            for (unused, _) in named.iter().filter(|(name, _)| !formula.uses(name)) {
                q.error(unused, format!("the formula does not use '{unused}'"));
            }
            Some(formula.into())
        }
        Err(error) => {
            report(&error, name, &text, &named, q);
            None
        }
    }
}

/// Returns the numbers to which a volume gives names.
fn numbers(q: &mut Query) -> Vec<(String, f64)> {
    let is_number = |p: &&Property| {
        let number = matches!(p.value, Value::Float(_) | Value::Integer(_));
        number && !OWN.contains(&&*p.name)
    };
    let names = q.object().properties.iter().filter(is_number);
    names.map(|p| (p.name.clone(), q.float(&p.name))).collect()
}

/// Reports an error of a formula, at its position in the text.
fn report(error: &FormulaError, name: &str, text: &str, numbers: &[(&str, f64)], q: &mut Query) {
    let message = error.to_string();
    match &error.kind {
        FormulaErrorKind::ParameterName(parameter, _)
        | FormulaErrorKind::ParameterValue(parameter) => q.error(parameter, message),
        FormulaErrorKind::UnknownName(unknown) => {
            let mut known: Vec<&str> = numbers.iter().map(|(name, _)| *name).collect();
            Formula::names().for_each(|name| known.push(name));
            let help = suggest(unknown, known.iter().copied()).unwrap_or_else(|| {
                let known = known.join(", ");
                format!("known names: {known}; define other names as parameters")
            });
            q.error_within(name, text, error.span.clone(), &message, Some(help));
        }
        _ => q.error_within(name, text, error.span.clone(), &message, None),
    }
}
