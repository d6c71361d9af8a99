//! Messages to the user: what is wrong, where it was written, and what may have been meant.

pub(crate) mod difference;
pub mod lints;
mod render;
mod source;
mod suggest;
pub(crate) mod words;

pub use difference::Difference;
pub use formats::escape::{escaped, shown};
pub use render::Style;
pub use source::{Location, SourceFile};
pub use suggest::{closest, suggest};

use std::collections::BTreeSet;
use std::fmt;
use transport::scene::Lint;

/// Diagnostics kept in a [`Diagnostics`]; later ones are only counted.
const CAPACITY: usize = 100;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The scene cannot be used.
    Error,
    /// The scene can be used but may not be what was meant.
    Warning,
    /// The scene is used as it was meant, but not quite as it was written.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        })
    }
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong, in one line.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Where it was written.
    pub location: Option<Location>,
    /// Check that found it, for warnings and notes that users can silence.
    pub lint: Option<Lint>,
}

impl From<formats::FileError> for Diagnostic {
    fn from(error: formats::FileError) -> Self {
        Diagnostic::error(error.to_string())
    }
}

impl Diagnostic {
    /// An error without a place.
    pub fn error(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Error,
            message: message.into(),
            help: None,
            location: None,
            lint: None,
        }
    }

    /// A warning without a place.
    pub fn warning(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Warning,
            ..Self::error(message)
        }
    }

    /// A note without a place.
    pub fn note(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Note,
            ..Self::error(message)
        }
    }

    /// The message as one of a check, by whose name users silence it.
    pub fn of(mut self, lint: Lint) -> Self {
        self.lint = Some(lint);
        self
    }

    /// The same message at `location`.
    pub fn at(mut self, location: &Location) -> Self {
        self.location = Some(location.clone());
        self
    }

    /// The same message with advice; `None` leaves it as it is.
    pub fn help(mut self, help: impl Into<Option<String>>) -> Self {
        self.help = help.into().or(self.help);
        self
    }
}

/// A collection of messages, so that several mistakes are reported at once.
///
/// Only the first hundred are kept; the others are counted. What was said already of the same place is not said again.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    items: Vec<Diagnostic>,
    errors: usize,
    dropped: usize,
    differences: BTreeSet<Difference>,
    silenced: BTreeSet<Lint>,
}

impl Diagnostics {
    /// An empty collection.
    pub fn new() -> Self {
        Self::default()
    }

    /// Removes the messages of some checks, and takes no more of them.
    pub fn silence(&mut self, lints: &[Lint]) {
        self.silenced.extend(lints);
        let silenced = &self.silenced;
        self.items
            .retain(|d| d.lint.is_none_or(|lint| !silenced.contains(&lint)));
    }

    /// An empty collection that silences the same checks.
    pub fn emptied(&self) -> Self {
        Diagnostics {
            silenced: self.silenced.clone(),
            ..Self::default()
        }
    }

    /// Adds a message, unless it is there or its check is silenced.
    pub fn push(&mut self, diagnostic: impl Into<Diagnostic>) {
        let diagnostic = diagnostic.into();
        let silenced = diagnostic
            .lint
            .is_some_and(|lint| self.silenced.contains(&lint));
        if silenced || self.items.contains(&diagnostic) {
            return;
        }
        self.errors += usize::from(diagnostic.severity == Severity::Error);
        if self.items.len() < CAPACITY {
            self.items.push(diagnostic);
        } else {
            self.dropped += 1;
        }
    }

    /// Takes note of a deliberate difference from Mitsuba, which is no message.
    pub(crate) fn differ(&mut self, difference: Difference) {
        self.differences.insert(difference);
    }

    /// The differences from Mitsuba that reading has met.
    pub(crate) fn differences(&self) -> &BTreeSet<Difference> {
        &self.differences
    }

    /// Like [`suggest`], but without the search once no more messages are kept: thousands of
    /// mistakes with thousands of candidates each would take minutes.
    pub fn suggest<'a>(
        &self,
        name: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Option<String> {
        if self.items.len() < CAPACITY {
            suggest(name, candidates)
        } else {
            None
        }
    }

    /// Whether any message is an error.
    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Number of errors, including those that were not kept.
    pub fn error_count(&self) -> usize {
        self.errors
    }

    /// Whether there is no message at all.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// The messages that were kept, in the order in which they were found.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.items.iter()
    }

    /// All messages as text for a terminal or a log, each with its line of the source.
    pub fn render(&self, style: Style) -> String {
        let mut out = String::new();
        for diagnostic in &self.items {
            render::diagnostic(&mut out, diagnostic, style);
            out.push('\n');
        }
        if self.dropped > 0 {
            out.push_str(&format!("... and {} more\n", self.dropped));
        }
        out
    }
}

impl std::error::Error for Diagnostics {}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(Style::Plain))
    }
}
