//! Source text and places in it.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A text file that diagnostics point into.
#[derive(Debug)]
pub struct SourceFile {
    path: PathBuf,
    text: String,
    line_starts: Vec<usize>,
    /// Whether lines are names of places rather than text.
    is_index: bool,
}

impl SourceFile {
    /// A file with its text.
    pub fn new(path: impl Into<PathBuf>, text: String) -> Arc<Self> {
        let breaks = text
            .bytes()
            .enumerate()
            .filter(|(_, b)| *b == b'\n')
            .map(|(i, _)| i + 1);
        let line_starts = std::iter::once(0).chain(breaks).collect();
        Arc::new(SourceFile {
            path: path.into(),
            text,
            line_starts,
            is_index: false,
        })
    }

    /// Stands for a scene that is no text: a line for each place in it, to be shown as it is.
    pub fn places(places: &[String]) -> Arc<Self> {
        let mut lines = Self::new("", places.join("\n"));
        if let Some(file) = Arc::get_mut(&mut lines) {
            file.is_index = true;
        }
        lines
    }

    /// The path under which the file was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether its lines are names of places: see [`SourceFile::places`].
    pub(crate) fn is_index(&self) -> bool {
        self.is_index
    }

    /// The folder that relative paths in this file refer to.
    pub fn directory(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Line and column, both from 1, of a byte offset. Columns count characters.
    pub(crate) fn line_column(&self, offset: usize) -> (usize, usize) {
        let line = self.line_starts.partition_point(|&start| start <= offset);
        let start = self.line_starts[line - 1];
        let before = self.text.get(start..offset).unwrap_or("");
        (line, before.chars().count() + 1)
    }

    /// The text of a line (from 1) without its line break; empty outside the file.
    pub fn line(&self, line: usize) -> &str {
        let Some(&start) = line.checked_sub(1).and_then(|i| self.line_starts.get(i)) else {
            return "";
        };
        let rest = &self.text[start..];
        rest.lines().next().unwrap_or("")
    }

    /// Byte offset of a line and column, both from 1, clamped to the text.
    pub(crate) fn offset(&self, line: usize, column: usize) -> usize {
        let start = self.line_starts.get(line.saturating_sub(1)).copied();
        let start = start.unwrap_or(self.text.len());
        let characters = self.text[start..].char_indices();
        let column = characters.map(|(i, _)| i).nth(column.saturating_sub(1));
        column.map_or(self.text.len(), |i| start + i)
    }
}

/// A span of a source file.
#[derive(Clone)]
pub struct Location {
    source: Arc<SourceFile>,
    start: usize,
    len: usize,
}

/// Equal if they are the same span of the same file.
impl PartialEq for Location {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.source, &other.source) && self.span() == other.span()
    }
}

impl Location {
    /// The span of `len` bytes from byte `start`, clamped to the text.
    pub fn new(source: &Arc<SourceFile>, start: usize, len: usize) -> Self {
        let start = start.min(source.text.len());
        let len = len.min(source.text.len() - start);
        Location {
            source: Arc::clone(source),
            start,
            len,
        }
    }

    /// The file.
    pub fn source(&self) -> &Arc<SourceFile> {
        &self.source
    }

    /// The file's path.
    pub fn file(&self) -> &Path {
        self.source.path()
    }

    /// Line, from 1.
    pub fn line(&self) -> usize {
        self.source.line_column(self.start).0
    }

    /// Column in characters, from 1.
    pub fn column(&self) -> usize {
        self.source.line_column(self.start).1
    }

    /// Start and length in bytes.
    pub fn span(&self) -> (usize, usize) {
        (self.start, self.len)
    }

    /// The place of a span of bytes of `value`, if what is written here is that value as it is.
    pub(crate) fn within(&self, value: &str, span: std::ops::Range<usize>) -> Option<Location> {
        let start = self.start + self.text().find(value)?;
        Some(Location::new(&self.source, start + span.start, span.len()))
    }

    /// The text it covers; empty if the span does not begin and end between characters.
    pub fn text(&self) -> &str {
        self.source
            .text
            .get(self.start..self.start + self.len)
            .unwrap_or("")
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.source.line_column(self.start);
        if self.source.is_index {
            return f.write_str(self.source.line(line));
        }
        write!(f, "{}:{line}:{column}", super::shown(self.file()))
    }
}

impl fmt::Debug for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Location({self})")
    }
}
