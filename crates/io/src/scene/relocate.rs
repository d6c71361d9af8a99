//! Names of data files for scenes that are written to another folder.

use super::{
    Child, ObjectDescription, ObjectId, Property, SceneDescription, SpectrumValue, Value, find,
};
use crate::diagnostic::Location;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Name of the parameter that names a data file.
const FILE: &str = "filename";

/// A file name that is not Unicode.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: the name is not Unicode, and scene files are: rename the file or its folders", .0.display())]
pub struct NameOfFile(pub PathBuf);

impl SceneDescription {
    /// Returns the scene with names of data files as seen from another folder: relative to it if
    /// possible, otherwise absolute. The scene then needs no [folders](SceneDescription::folders)
    /// to search.
    ///
    /// # Errors
    /// Returns an error for a name that is not Unicode.
    pub fn relocated(&self, folder: &Path) -> Result<Self, NameOfFile> {
        let mut relocation = Relocation {
            to: absolute(folder),
            folders: &self.folders,
            done: HashMap::new(),
            refused: None,
        };
        let root = relocation.object(&self.root);
        match relocation.refused {
            Some(name) => Err(name),
            None => Ok(SceneDescription {
                root,
                parameters: self.parameters.clone(),
                folders: Vec::new(),
            }),
        }
    }
}

struct Relocation<'a> {
    to: PathBuf,
    folders: &'a [PathBuf],
    done: HashMap<ObjectId, Arc<ObjectDescription>>,
    /// First name that is not Unicode.
    refused: Option<NameOfFile>,
}

impl Relocation<'_> {
    fn object(&mut self, object: &Arc<ObjectDescription>) -> Arc<ObjectDescription> {
        if let Some(done) = self.done.get(&object.number) {
            return Arc::clone(done);
        }
        let properties = object.properties.iter().map(|p| self.property(p)).collect();
        let child = |child: &Child| Child {
            object: self.object(&child.object),
            ..child.clone()
        };
        let children = object.children.iter().map(child).collect();
        let new = Arc::new(ObjectDescription {
            properties,
            children,
            ..(**object).clone()
        });
        self.done.insert(object.number, Arc::clone(&new));
        new
    }

    fn property(&mut self, property: &Property) -> Property {
        let mut seen = |name: &str| self.file(name, &property.location);
        let value = match &property.value {
            Value::String(name) if property.name == FILE => Value::String(seen(name)),
            Value::Spectrum(SpectrumValue::File(name)) => {
                Value::Spectrum(SpectrumValue::File(seen(name)))
            }
            value => value.clone(),
        };
        Property {
            value,
            ..property.clone()
        }
    }

    /// Returns the name of a file as seen from the new folder.
    fn file(&mut self, written: &str, location: &Location) -> String {
        let path = absolute(&find(written, location.source().directory(), self.folders));
        let seen = relative(&path, &self.to);
        let text = seen.to_str().map(str::to_owned);
        text.unwrap_or_else(|| {
            self.refused.get_or_insert(NameOfFile(path));
            String::new()
        })
    }
}

/// Returns an absolute path; if the path exists, with all links resolved.
fn absolute(path: &Path) -> PathBuf {
    let known = path.canonicalize().ok();
    let path = known.or_else(|| std::path::absolute(path).ok());
    path.unwrap_or_default()
}

/// Returns `path` as seen from `folder`, both absolute. The result is relative, with `..`, if they
/// share more than the root.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let shared = path.components().zip(folder.components());
    let shared = shared.take_while(|(a, b)| a == b).count();
    let named = |c: &Component| matches!(c, Component::Normal(_));
    if !path.components().take(shared).any(|c| named(&c)) {
        return path.to_owned();
    }
    let up = folder
        .components()
        .skip(shared)
        .map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::relative;
    use std::path::Path;

    #[test]
    fn paths_are_seen_from_a_folder() {
        let seen = |path: &str, folder: &str| relative(Path::new(path), Path::new(folder));
        assert_eq!(seen("/a/b/c.ply", "/a/b"), Path::new("c.ply"));
        assert_eq!(seen("/a/b/c.ply", "/a/d/e"), Path::new("../../b/c.ply"));
        assert_eq!(seen("/b/c.ply", "/a/d"), Path::new("/b/c.ply"));
    }
}
