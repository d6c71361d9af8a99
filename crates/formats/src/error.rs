//! Failures of reading and writing data files.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::escape::{escaped, shown};

/// A file that could not be read or written, and why.
#[derive(Debug)]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// Line of a text file, from 1.
    pub line: Option<usize>,
    /// What is wrong with it.
    pub problem: Problem,
}

/// What can be wrong with a data file.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The operating system refused to read it.
    #[error("cannot read: {0}")]
    Read(#[source] io::Error),
    /// What Git LFS puts in place of a file that it has not fetched.
    #[error(
        "a pointer of Git LFS, not the file itself: run `git lfs pull` where the files come from"
    )]
    LfsPointer,
    /// It is something that may have no end.
    #[error("{0}, not a regular file: save its data in a file first")]
    NotRegular(&'static str),
    /// The operating system refused to write it.
    #[error("cannot write: {0}")]
    Write(#[source] io::Error),
    /// The target exists and is something that must not be replaced.
    #[error("cannot write: it exists and is not a regular file")]
    NotAFile,
    /// The content is not of the format that was expected.
    #[error("not a {format} file: {reason}")]
    WrongFormat {
        /// Name of the expected format.
        format: &'static str,
        /// What gave it away.
        reason: String,
    },
    /// A valid file that uses something this program does not read or write.
    #[error("not supported: {0}")]
    Unsupported(String),
    /// The file ends early.
    #[error("truncated: expected {expected} bytes, found {found}")]
    Truncated {
        /// Size that the header calls for, in bytes.
        expected: u64,
        /// Actual size, in bytes.
        found: u64,
    },
    /// The file goes on after its data.
    #[error("{extra} unexpected bytes after the data")]
    TrailingBytes {
        /// Number of bytes too many.
        extra: u64,
    },
    /// Sizes that overflow or exceed what is accepted.
    #[error("too large: {0}")]
    TooLarge(String),
    /// A size of zero where there must be something.
    #[error("empty: {0}")]
    Empty(String),
    /// NaN or an infinity where a number is needed.
    #[error("value {value} at {place} is not finite")]
    NotFinite {
        /// Which value, for example `voxel (1, 2, 3)`.
        place: String,
        /// The value.
        value: f64,
    },
    /// An array of another shape or element type than needed.
    #[error("expected {expected}, found {found}")]
    Mismatch {
        /// What is needed.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// What neither the file nor the user has said.
    #[error("{0}")]
    Unsaid(String),
    /// Content that breaks the rules of its format.
    #[error("{0}")]
    Malformed(String),
}

impl Problem {
    /// Attaches the file.
    pub fn at(self, path: &Path) -> FileError {
        FileError {
            path: path.to_owned(),
            line: None,
            problem: self,
        }
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", shown(&self.path))?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        // It may quote the file.
        write!(f, ": {}", escaped(&self.problem.to_string()))
    }
}

impl std::error::Error for FileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.problem)
    }
}
