//! Files that are shown: whether they are still those that were read.

use crate::item::ItemOptions;
use io::input::FileStamp;
use std::path::{Path, PathBuf};

/// A file, and what it was like when it was read.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) options: ItemOptions,
    stamp: Option<FileStamp>,
}

impl Source {
    /// A file that is about to be read.
    pub(crate) fn new(path: &Path, options: &ItemOptions) -> Self {
        Source {
            path: path.to_owned(),
            options: options.clone(),
            stamp: FileStamp::of(path),
        }
    }

    /// Whether the file has been written since. One that is gone has not: what it held is still shown.
    pub(crate) fn has_changed(&self) -> bool {
        let now = FileStamp::of(&self.path);
        // Planted error "files shown as they once were", found by morgana-view/served::files_that_have_changed_are_read_again:
        // now.is_some() && self.stamp.is_none()
        now.is_some() && now != self.stamp
    }
}
