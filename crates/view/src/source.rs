//! Source files of items, and detection of changes.

use crate::item::ItemOptions;
use io::input::FileStamp;
use std::path::{Path, PathBuf};

/// File, and its state when it was read.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) options: ItemOptions,
    stamp: Option<FileStamp>,
}

impl Source {
    /// Records the state of a file before it is read.
    pub(crate) fn new(path: &Path, options: &ItemOptions) -> Self {
        Source {
            path: path.to_owned(),
            options: options.clone(),
            stamp: FileStamp::of(path),
        }
    }

    /// Returns true if the file has been written since. A deleted file counts as unchanged: its
    /// content is still shown.
    pub(crate) fn has_changed(&self) -> bool {
        let now = FileStamp::of(&self.path);
        // Planted error "files shown as they once were", found by morgana-view/served::files_that_have_changed_are_read_again:
        // now.is_some() && self.stamp.is_none()
        now.is_some() && now != self.stamp
    }
}
