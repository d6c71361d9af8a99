//! Diagnostics as text: the message, the line of the source, a caret, and advice.

use super::{Diagnostic, Location, Severity};
use formats::escape::{drives, escaped};
use unicode_width::UnicodeWidthStr;

/// Maximum number of characters of a source line that are shown.
const WIDTH: usize = 120;

/// Style of text output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Text only: for files, logs and tests.
    Plain,
    /// Text with ANSI colours.
    Colour,
}

impl Style {
    /// Returns colours for a terminal, unless the environment variable `NO_COLOR` is set to a
    /// non-empty value.
    pub fn detect(is_terminal: bool) -> Self {
        let refused = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        if is_terminal && !refused {
            Style::Colour
        } else {
            Style::Plain
        }
    }

    fn paint(self, code: &str, text: &str) -> String {
        match self {
            Style::Plain => text.to_owned(),
            Style::Colour => format!("\x1b[{code}m{text}\x1b[0m"),
        }
    }
}

/// Appends one diagnostic to `out`.
pub(super) fn diagnostic(out: &mut String, diagnostic: &Diagnostic, style: Style) {
    let colour = match diagnostic.severity {
        Severity::Error => "1;31",
        Severity::Warning => "1;33",
        Severity::Note => "1;36",
    };
    let severity = match diagnostic.lint {
        Some(lint) => format!("{}[{lint}]", diagnostic.severity),
        None => diagnostic.severity.to_string(),
    };
    let severity = style.paint(colour, &severity);
    let message = style.paint("1", &escaped(&diagnostic.message));
    out.push_str(&format!("{severity}: {message}\n"));
    let margin = diagnostic
        .location
        .as_ref()
        .map_or(1, |l| l.line().to_string().len());
    if let Some(location) = &diagnostic.location {
        snippet(out, location, margin, colour, style);
    }
    if let Some(help) = &diagnostic.help {
        let label = style.paint("1;36", "help");
        out.push_str(&format!("{:margin$} = {label}: {}\n", "", escaped(help)));
    }
}

/// Appends the place of a diagnostic, with the line of the source and carets under the marked part.
fn snippet(out: &mut String, location: &Location, margin: usize, colour: &str, style: Style) {
    let blue = |text: &str| style.paint("1;34", text);
    let place = escaped(&location.to_string()).into_owned();
    out.push_str(&format!("{:margin$}{} {place}\n", "", blue("-->")));
    if location.source().is_index() {
        return;
    }
    let line: Vec<char> = location.source().line(location.line()).chars().collect();
    if line.is_empty() {
        return;
    }
    let column = (location.column() - 1).min(line.len());
    let covered = location.text().lines().next().unwrap_or("").chars().count();
    let length = covered.min(line.len() - column).max(1);
    let from = window_start(column, length, line.len());
    let part = |from, length| printable(line.iter().skip(from).take(length));
    let length = length.min(WIDTH - (column - from).min(WIDTH - 1));
    // Chinese, Japanese and Korean characters take two cells.
    let covered = part(column, length).width().max(1);
    let carets = style.paint(colour, &"^".repeat(covered));
    let (number, indent) = (location.line(), part(from, column - from).width());
    let bar = blue("|");
    out.push_str(&format!("{:margin$} {bar}\n", ""));
    out.push_str(&format!(
        "{} {bar} {}\n",
        blue(&number.to_string()),
        part(from, WIDTH).trim_end()
    ));
    out.push_str(&format!("{:margin$} {bar} {:indent$}{carets}\n", "", ""));
}

/// Returns the first character to show of a long line, so that the marked part is visible.
fn window_start(column: usize, length: usize, total: usize) -> usize {
    if total <= WIDTH || column + length <= WIDTH {
        return 0;
    }
    column
        .saturating_sub(WIDTH / 3)
        .min(total - WIDTH.min(total))
}

/// Replaces control characters by blanks. A scene file must not control the terminal, and carets
/// must point at the right characters.
fn printable<'a>(text: impl Iterator<Item = &'a char>) -> String {
    text.map(|c| if drives(*c) { ' ' } else { *c }).collect()
}
