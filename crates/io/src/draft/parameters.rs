//! Parameters of a scene file: declarations, values from the command line, and `$name` in texts.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use crate::diagnostic::{Diagnostic, Diagnostics, Location};

/// Maximum number of bytes that all substitutions together may produce. Defaults that repeat one
/// another could otherwise grow without bound.
const MAX_SUBSTITUTED_BYTES: usize = 16 << 20;

/// Parameter with its value. `overridden` is true if the command line sets it, `used` if the file
/// refers to it.
struct Parameter {
    value: String,
    overridden: bool,
    used: bool,
}

/// Parameters known so far.
pub(crate) struct Parameters {
    values: BTreeMap<String, Parameter>,
    /// Names of parameters without a value that resemble no known name.
    open: Vec<String>,
    /// Place of the first parameter without a value.
    first_open: Option<Location>,
    budget: usize,
    /// Returns the declaration of a named parameter in the file's format, for advice.
    declaration: fn(&str) -> String,
}

/// Failed substitution, with its place in the text.
pub(crate) struct SubstitutionError {
    cause: Cause,
    pub(crate) range: Range<usize>,
}

/// Cause of a failed substitution.
enum Cause {
    /// Message and advice.
    Wrong(String, Option<String>),
    /// Name of a parameter without a value.
    Open(String),
}

impl Parameters {
    /// Starts with the overrides; the last of equal names wins. `declaration` returns the
    /// declaration of a parameter in the file's format.
    pub(crate) fn new(overrides: &[(String, String)], declaration: fn(&str) -> String) -> Self {
        let parameter = |value: &String| Parameter {
            value: value.clone(),
            overridden: true,
            used: false,
        };
        let values = overrides
            .iter()
            .map(|(name, value)| (name.clone(), parameter(value)));
        Parameters {
            values: values.collect(),
            open: Vec::new(),
            first_open: None,
            budget: MAX_SUBSTITUTED_BYTES,
            declaration,
        }
    }

    /// Declares a parameter of the file: sets its value unless it is already set. Returns the
    /// value.
    pub(crate) fn declare(&mut self, name: &str, value: &str) -> &str {
        let new = || Parameter {
            value: value.to_owned(),
            overridden: false,
            used: false,
        };
        let parameter = self.values.entry(name.to_owned()).or_insert_with(new);
        parameter.used |= parameter.overridden;
        &parameter.value
    }

    /// Returns the name in a text that consists only of `$name` or `${name}`.
    pub(crate) fn whole(text: &str) -> Option<&str> {
        if !text.starts_with('$') {
            return None;
        }
        let (name, end) = name_at(text, 0).ok()?;
        name.filter(|_| end == text.len())
    }

    /// Replaces every `$name` and `${name}` in a text.
    pub(crate) fn substitute<'t>(
        &mut self,
        text: &'t str,
        diagnostics: &Diagnostics,
    ) -> Result<Cow<'t, str>, SubstitutionError> {
        if !text.contains('$') {
            return Ok(Cow::Borrowed(text));
        }
        let mut out = String::new();
        let mut rest = 0;
        while let Some(dollar) = text[rest..].find('$').map(|i| i + rest) {
            out.push_str(&text[rest..dollar]);
            let (name, end) = name_at(text, dollar)?;
            match name {
                Some(name) => out.push_str(self.value(name, dollar..end, diagnostics)?),
                None => out.push('$'),
            }
            self.spend(out.len(), dollar..end)?;
            rest = end;
        }
        out.push_str(&text[rest..]);
        self.budget -= out.len().min(self.budget);
        Ok(Cow::Owned(out))
    }

    /// Returns the value of a parameter and marks it as used.
    fn value(
        &mut self,
        name: &str,
        range: Range<usize>,
        diagnostics: &Diagnostics,
    ) -> Result<&str, SubstitutionError> {
        if !self.values.contains_key(name) {
            let known = self.values.keys().map(String::as_str);
            let cause = match diagnostics.suggest(name, known) {
                Some(help) => Cause::Wrong(undefined(name), Some(help)),
                None => Cause::Open(name.to_owned()),
            };
            return Err(SubstitutionError { cause, range });
        }
        let parameter = self.values.get_mut(name);
        Ok(parameter.map_or("", |p| {
            p.used = true;
            p.value.as_str()
        }))
    }

    /// Checks that a text of this length fits into the budget.
    fn spend(&self, length: usize, range: Range<usize>) -> Result<(), SubstitutionError> {
        if length <= self.budget {
            return Ok(());
        }
        let message = "the values of parameters become too long".to_owned();
        let cause = Cause::Wrong(message, None);
        Err(SubstitutionError { cause, range })
    }

    /// Reports a failed substitution. Parameters without values are reported together by
    /// [`Parameters::report_open`].
    pub(crate) fn report(
        &mut self,
        failure: SubstitutionError,
        at: &Location,
        diagnostics: &mut Diagnostics,
    ) {
        match failure.cause {
            Cause::Wrong(message, help) => {
                diagnostics.push(Diagnostic::error(message).help(help).at(at));
            }
            Cause::Open(name) => {
                self.first_open.get_or_insert_with(|| at.clone());
                if !self.open.contains(&name) {
                    self.open.push(name);
                }
            }
        }
    }

    /// Reports all parameters without values, with advice.
    pub(crate) fn report_open(&self, diagnostics: &mut Diagnostics) {
        let Some(first) = &self.first_open else {
            return;
        };
        let (message, declaration) = match &self.open[..] {
            [name] => (undefined(name), (self.declaration)(name)),
            names => {
                let names: Vec<String> = names.iter().map(|name| format!("'${name}'")).collect();
                let message = format!("parameters {} are not defined", names.join(", "));
                (
                    message,
                    format!("{} and so on", (self.declaration)(&self.open[0])),
                )
            }
        };
        let options: Vec<String> = self.open.iter().map(|n| format!("-D {n}=...")).collect();
        let help = format!("pass {}, or add {declaration}", options.join(" "));
        diagnostics.push(Diagnostic::error(message).help(help).at(first));
    }

    /// Reports overrides that nothing used.
    pub(crate) fn report_unused(&self, diagnostics: &mut Diagnostics) {
        for (name, _) in self.values.iter().filter(|(_, p)| p.overridden && !p.used) {
            let known = self.values.iter().filter(|(_, p)| p.used || !p.overridden);
            let help = diagnostics.suggest(name, known.map(|(name, _)| name.as_str()));
            let message = format!("the scene has no parameter '{name}' (given as -D {name}=...)");
            diagnostics.push(Diagnostic::error(message).help(help));
        }
    }

    /// Returns names and values.
    pub(crate) fn into_values(self) -> Vec<(String, String)> {
        self.values
            .into_iter()
            .map(|(name, p)| (name, p.value))
            .collect()
    }
}

/// Returns the message about an undefined name.
fn undefined(name: &str) -> String {
    format!("parameter '${name}' is not defined")
}

/// Returns the name after the `$` at `dollar` and the position after it; no name if the `$` stands
/// alone.
fn name_at(text: &str, dollar: usize) -> Result<(Option<&str>, usize), SubstitutionError> {
    let start = dollar + 1;
    if let Some(braced) = text[start..].strip_prefix('{') {
        let cause = Cause::Wrong("'${' without '}'".to_owned(), None);
        let range = dollar..text.len();
        let end = braced.find('}').ok_or(SubstitutionError { cause, range })?;
        return Ok((Some(&braced[..end]), start + end + 2));
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let length = text[start..]
        .find(|c| !is_name(c))
        .unwrap_or(text.len() - start);
    let name = &text[start..start + length];
    let starts_well = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    Ok(if starts_well {
        (Some(name), start + length)
    } else {
        (None, start)
    })
}
