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
    /// Where files are looked for besides the folder of the file that names them.
    folders: Vec<PathBuf>,
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

    /// Looks for files in these folders, too, in this order.
    pub fn searching(self, folders: Vec<PathBuf>) -> Self {
        FileRegistry { folders, ..self }
    }

    /// Finds a file by its name as written in a file that lies in `folder`, and records it.
    pub(crate) fn resolve(&mut self, written: &str, folder: &Path) -> PathBuf {
        let path = find(written, folder, &self.folders);
        self.add(path.clone(), written);
        path
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

/// The path of a file or folder by its name as written in a file that lies in `folder`: there, or in the first of
/// `folders` that has it, or in the current folder, as in Mitsuba. One that does not exist is expected in `folder`.
pub(crate) fn find(written: &str, folder: &Path, folders: &[PathBuf]) -> PathBuf {
    let nearest = folder.join(written);
    if nearest.exists() {
        return nearest;
    }
    let elsewhere = folders.iter().map(|folder| folder.join(written));
    let mut elsewhere = elsewhere.chain([PathBuf::from(written)]);
    elsewhere.find(|path| path.exists()).unwrap_or(nearest)
}

fn content_hash(path: &Path) -> Result<blake3::Hash, FileError> {
    let (file, _) = input::open(path)?;
    let mut hasher = blake3::Hasher::new();
    let read = hasher.update_reader(file.into_inner());
    read.map_err(|e| Problem::Read(e).at(path))?;
    Ok(hasher.finalize())
}
