//! Files that a scene refers to.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// The data files that a scene refers to, collected while its paths are resolved.
#[derive(Clone, Debug, Default)]
pub struct FileRegistry {
    /// Resolved path to the way in which it was written.
    files: BTreeMap<PathBuf, String>,
    limits: Limits,
}

impl FileRegistry {
    /// An empty registry.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty registry of files that may take so much memory.
    pub fn within(limits: Limits) -> Self {
        FileRegistry {
            limits,
            ..Self::default()
        }
    }

    /// How much memory each of the files may take.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Records a file by its resolved path and the way in which the scene writes it.
    pub fn add(&mut self, path: PathBuf, written: &str) {
        self.files.entry(path).or_insert_with(|| written.to_owned());
    }

    /// The resolved paths.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.keys().map(PathBuf::as_path)
    }

    /// Hashes of all contents with the names as written, in an order that does not depend on where
    /// the scene lies.
    pub(super) fn content_hashes(&self) -> Result<Vec<(&str, blake3::Hash)>, FileError> {
        let hash = |(path, name)| Ok((name, content_hash(path)?));
        let files = self
            .files
            .iter()
            .map(|(path, name)| (path.as_path(), name.as_str()));
        let mut hashes = files.map(hash).collect::<Result<Vec<_>, _>>()?;
        hashes.sort_by_key(|(name, hash)| (*name, *hash.as_bytes()));
        Ok(hashes)
    }
}

fn content_hash(path: &Path) -> Result<blake3::Hash, FileError> {
    let (file, _) = input::open(path)?;
    let mut hasher = blake3::Hasher::new();
    let read = hasher.update_reader(file.into_inner());
    read.map_err(|e| Problem::Read(e).at(path))?;
    Ok(hasher.finalize())
}
