//! Files that a scene refers to.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Data files that a scene refers to, collected while their paths are resolved.
#[derive(Clone, Debug, Default)]
pub struct FileRegistry {
    /// Resolved paths, each with the name in the scene and, if known, the hash of the content.
    files: BTreeMap<PathBuf, (String, Option<blake3::Hash>)>,
    /// Folders that are searched besides the folder of the file that names a file.
    folders: Vec<PathBuf>,
    limits: Limits,
}

impl FileRegistry {
    /// Makes an empty registry.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes an empty registry of files with these memory limits.
    pub fn within(limits: Limits) -> Self {
        FileRegistry {
            limits,
            ..Self::default()
        }
    }

    /// Also searches for files in these folders, in this order.
    pub fn searching(self, folders: Vec<PathBuf>) -> Self {
        FileRegistry { folders, ..self }
    }

    /// Finds a file by its name in a file in `folder`, and records it.
    pub(crate) fn resolve(&mut self, written: &str, folder: &Path) -> PathBuf {
        let path = find(written, folder, &self.folders);
        self.add(path.clone(), written);
        path
    }

    /// Returns the memory limits of each file.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Records a file by its resolved path and its name in the scene.
    pub fn add(&mut self, path: PathBuf, written: &str) {
        let (_, hash) = self
            .files
            .entry(path)
            .or_insert_with(|| (written.to_owned(), None));
        // A file that is read again may have another content.
        *hash = None;
    }

    /// Computes and keeps the hashes of all contents that are not known.
    pub(crate) fn hash_contents(&mut self) -> Result<(), FileError> {
        for (path, (_, hash)) in &mut self.files {
            if hash.is_none() {
                *hash = Some(content_hash(path)?);
            }
        }
        Ok(())
    }

    /// Returns the resolved paths.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.keys().map(PathBuf::as_path)
    }

    /// Returns hashes of all contents with the names in the scene, in an order that does not depend
    /// on the scene's folder.
    pub(super) fn content_hashes(&self) -> Result<Vec<(&str, blake3::Hash)>, FileError> {
        let files = self.files.iter();
        let hashes = files.map(|(path, (name, hash))| {
            let hash = hash.map_or_else(|| content_hash(path), Ok)?;
            Ok((name.as_str(), hash))
        });
        let mut hashes = hashes.collect::<Result<Vec<_>, _>>()?;
        hashes.sort_by_key(|(name, hash)| (*name, *hash.as_bytes()));
        Ok(hashes)
    }
}

/// Finds a file or folder by its name in a file in `folder`. As in Mitsuba, it searches `folder`,
/// then each of `folders`, then the current folder. If the file does not exist, returns its path in
/// `folder`.
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
