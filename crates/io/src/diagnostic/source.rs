//! Source text and places in it.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Text file to which diagnostics refer.
#[derive(Debug)]
pub struct SourceFile {
    path: PathBuf,
    text: String,
    line_starts: Vec<usize>,
    /// True if lines are names of places rather than text.
    is_index: bool,
}

impl SourceFile {
    /// Makes a source file with its text.
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

    /// Makes a stand-in for a scene that is not text. It has one line for each place in the scene,
    /// which is shown unchanged.
    pub fn places(places: &[String]) -> Arc<Self> {
        let mut lines = Self::new("", places.join("\n"));
        if let Some(file) = Arc::get_mut(&mut lines) {
            file.is_index = true;
        }
        lines
    }

    /// Returns the path under which the file was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns true if the lines are names of places: see [`SourceFile::places`].
    pub(crate) fn is_index(&self) -> bool {
        self.is_index
    }

    /// Returns the folder to which relative paths in this file refer.
    pub fn directory(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Returns line and column of a byte offset, both counted from 1. Columns count characters.
    pub(crate) fn line_column(&self, offset: usize) -> (usize, usize) {
        let line = self.line_starts.partition_point(|&start| start <= offset);
        let start = self.line_starts[line - 1];
        let before = self.text.get(start..offset).unwrap_or("");
        (line, before.chars().count() + 1)
    }

    /// Returns the text of a line (counted from 1) without its line break; empty outside the file.
    pub fn line(&self, line: usize) -> &str {
        let Some(&start) = line.checked_sub(1).and_then(|i| self.line_starts.get(i)) else {
            return "";
        };
        let rest = &self.text[start..];
        rest.lines().next().unwrap_or("")
    }

    /// Returns the byte offset of a line and column, both counted from 1, clamped to the text.
    pub(crate) fn offset(&self, line: usize, column: usize) -> usize {
        let start = self.line_starts.get(line.saturating_sub(1)).copied();
        let start = start.unwrap_or(self.text.len());
        let characters = self.text[start..].char_indices();
        let column = characters.map(|(i, _)| i).nth(column.saturating_sub(1));
        column.map_or(self.text.len(), |i| start + i)
    }
}

/// Span of a source file.
#[derive(Clone)]
pub struct Location {
    source: Arc<SourceFile>,
    start: usize,
    len: usize,
}

/// Locations are equal if they are equal spans of one file.
impl PartialEq for Location {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.source, &other.source) && self.span() == other.span()
    }
}

impl Location {
    /// Makes the span of `len` bytes from byte `start`, clamped to the text.
    pub fn new(source: &Arc<SourceFile>, start: usize, len: usize) -> Self {
        let start = start.min(source.text.len());
        let len = len.min(source.text.len() - start);
        Location {
            source: Arc::clone(source),
            start,
            len,
        }
    }

    /// Returns the file.
    pub fn source(&self) -> &Arc<SourceFile> {
        &self.source
    }

    /// Returns the path of the file.
    pub fn file(&self) -> &Path {
        self.source.path()
    }

    /// Returns the line, counted from 1.
    pub fn line(&self) -> usize {
        self.source.line_column(self.start).0
    }

    /// Returns the column in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.source.line_column(self.start).1
    }

    /// Returns start and length in bytes.
    pub fn span(&self) -> (usize, usize) {
        (self.start, self.len)
    }

    /// Returns the place of a span of bytes of `value`, if this location contains `value`
    /// unchanged.
    pub(crate) fn within(&self, value: &str, span: std::ops::Range<usize>) -> Option<Location> {
        let start = self.start + self.text().find(value)?;
        Some(Location::new(&self.source, start + span.start, span.len()))
    }

    /// Returns the text of the span; empty if the span does not begin and end between characters.
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
