//! Errors of reading and writing data files.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::escape::{escaped, shown};

/// Error of reading or writing a file.
#[derive(Debug)]
pub struct FileError {
    /// Path of the file.
    pub path: PathBuf,
    /// Line of a text file, from 1.
    pub line: Option<usize>,
    /// Problem of the file.
    pub problem: Problem,
}

/// Problem of a data file.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The operating system could not read the file.
    #[error("cannot read: {0}")]
    Read(#[source] io::Error),
    /// The file is a Git LFS pointer to a file that has not been fetched.
    #[error(
        "a pointer of Git LFS instead of the file: run `git lfs pull` in the repository of the file"
    )]
    LfsPointer,
    /// The object is not a regular file, and may be infinite.
    #[error("{0}, not a regular file: save its data in a file first")]
    NotRegular(&'static str),
    /// The operating system could not write the file.
    #[error("cannot write: {0}")]
    Write(#[source] io::Error),
    /// The target exists, and must not be replaced.
    #[error("cannot write: it exists, but is not a regular file")]
    NotAFile,
    /// The content is not of the expected format.
    #[error("not a {format} file: {reason}")]
    WrongFormat {
        /// Name of the expected format.
        format: &'static str,
        /// Reason why the content has another format.
        reason: String,
    },
    /// The file is valid, but has a feature that this program does not support.
    #[error("not supported: {0}")]
    Unsupported(String),
    /// The file ends before its data.
    #[error("truncated: expected {expected} bytes, found {found}")]
    Truncated {
        /// Size that the header states, in bytes.
        expected: u64,
        /// Actual size, in bytes.
        found: u64,
    },
    /// The file continues after its data.
    #[error(
        "{extra} unexpected bytes after the data: check the sizes in the header, or copy the file again"
    )]
    TrailingBytes {
        /// Number of superfluous bytes.
        extra: u64,
    },
    /// A size overflows or exceeds a limit.
    #[error("too large: {0}")]
    TooLarge(String),
    /// A size is zero where content is needed.
    #[error("empty: {0}")]
    Empty(String),
    /// A value is NaN or infinite.
    #[error("value {value} at {place} is not finite")]
    NotFinite {
        /// Place of the value, for example `voxel (1, 2, 3)`.
        place: String,
        /// The value.
        value: f64,
    },
    /// An array has another shape or element type than needed.
    #[error("expected {expected}, found {found}")]
    Mismatch {
        /// Needed shape or type.
        expected: String,
        /// Shape or type in the file.
        found: String,
    },
    /// Information is missing from the file and from the user's options.
    #[error("{0}")]
    Unsaid(String),
    /// Content violates the rules of its format.
    #[error("{0}")]
    Malformed(String),
}

impl Problem {
    /// Adds the path of the file.
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
        // Escape the problem, which may quote the file.
        write!(f, ": {}", escaped(&self.problem.to_string()))
    }
}

impl std::error::Error for FileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.problem)
    }
}
