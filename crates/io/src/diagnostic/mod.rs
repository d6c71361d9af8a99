//! Messages to the user: the problem, its place in the file, and a probable correction.

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

/// Maximum number of diagnostics kept in a [`Diagnostics`]; later ones are only counted.
const CAPACITY: usize = 100;

/// Severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Error: the scene cannot be used.
    Error,
    /// Warning: the scene can be used but is probably not as intended.
    Warning,
    /// Note: the scene is used as intended, but not exactly as written.
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

/// Message to the user.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// Severity of the message.
    pub severity: Severity,
    /// Problem, in one line.
    pub message: String,
    /// Advice.
    pub help: Option<String>,
    /// Place in the source.
    pub location: Option<Location>,
    /// Check that found the problem, for warnings and notes that users can silence.
    pub lint: Option<Lint>,
}

impl From<formats::FileError> for Diagnostic {
    fn from(error: formats::FileError) -> Self {
        Diagnostic::error(error.to_string())
    }
}

impl Diagnostic {
    /// Makes an error without a place.
    pub fn error(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Error,
            message: message.into(),
            help: None,
            location: None,
            lint: None,
        }
    }

    /// Makes a warning without a place.
    pub fn warning(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Warning,
            ..Self::error(message)
        }
    }

    /// Makes a note without a place.
    pub fn note(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Note,
            ..Self::error(message)
        }
    }

    /// Assigns the message to a check, by whose name users silence it.
    pub fn of(mut self, lint: Lint) -> Self {
        self.lint = Some(lint);
        self
    }

    /// Sets the place of the message.
    pub fn at(mut self, location: &Location) -> Self {
        self.location = Some(location.clone());
        self
    }

    /// Sets the advice; `None` changes nothing.
    pub fn help(mut self, help: impl Into<Option<String>>) -> Self {
        self.help = help.into().or(self.help);
        self
    }
}

/// Collection of messages, so that several mistakes are reported at once.
///
/// It keeps the first hundred messages and counts the others. It ignores a message that it already
/// holds.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    items: Vec<Diagnostic>,
    errors: usize,
    dropped: usize,
    differences: BTreeSet<Difference>,
    silenced: BTreeSet<Lint>,
}

impl Diagnostics {
    /// Makes an empty collection.
    pub fn new() -> Self {
        Self::default()
    }

    /// Removes the messages of some checks, and ignores further messages of these checks.
    pub fn silence(&mut self, lints: &[Lint]) {
        self.silenced.extend(lints);
        let silenced = &self.silenced;
        self.items
            .retain(|d| d.lint.is_none_or(|lint| !silenced.contains(&lint)));
    }

    /// Makes an empty collection that silences the checks that this collection silences.
    pub fn emptied(&self) -> Self {
        Diagnostics {
            silenced: self.silenced.clone(),
            ..Self::default()
        }
    }

    /// Adds a message, unless the collection holds it or its check is silenced.
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

    /// Records a deliberate difference from Mitsuba, which is not a message.
    pub(crate) fn differ(&mut self, difference: Difference) {
        self.differences.insert(difference);
    }

    /// Returns the differences from Mitsuba that were found while reading.
    pub(crate) fn differences(&self) -> &BTreeSet<Difference> {
        &self.differences
    }

    /// Suggests a name like [`suggest`], or returns `None` if the collection is full: searches for
    /// thousands of mistakes among thousands of candidates would take minutes.
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

    /// Returns true if any message is an error.
    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Returns the first error.
    pub fn first_error(&self) -> Option<&Diagnostic> {
        self.iter().find(|one| one.severity == Severity::Error)
    }

    /// Returns the number of errors, including errors that were not kept.
    pub fn error_count(&self) -> usize {
        self.errors
    }

    /// Returns true if there is no message.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Returns the messages that were kept, in the order in which they were found.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.items.iter()
    }

    /// Returns all messages as text for a terminal or a log, each with its line of the source.
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
