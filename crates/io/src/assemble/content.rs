//! Parts of scenes, identified by their content. Scenes that hold equal parts share them in memory,
//! even if they come from different descriptions.

use eikonal::field::Bspline;
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use transport::shape::Mesh;
use transport::shared::Shared;
use transport::volume::{GridError, LabelGrid, VolumeGrid};

/// Grids of volumes in use.
pub(super) static GRIDS: Shared<Content, VolumeGrid> = Shared::new();
/// Placed meshes in use.
pub(super) static MESHES: Shared<Content, Mesh> = Shared::new();
/// Prefiltered grids of indices in use.
pub(super) static SPLINES: Shared<Content, Bspline> = Shared::new();

/// Placed grids of voxel labels in use.
static LABELS: Shared<Content, LabelGrid> = Shared::new();

/// Maximum number of values hashed per batch.
const BATCH: usize = 1 << 13;

/// Hash of everything that a part is built from (BLAKE3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Content([u8; 32]);

/// Unfinished hash of content.
#[derive(Clone, Default)]
pub(super) struct ContentHasher(blake3::Hasher);

impl ContentHasher {
    /// Adds a list of numbers, with its length.
    pub(super) fn doubles(self, values: &[f64]) -> Self {
        self.list(values, |v| v.to_le_bytes())
    }

    /// Adds a list of bytes, with its length.
    pub(super) fn bytes(mut self, values: &[u8]) -> Self {
        self.length(values.len());
        self.0.update(values);
        self
    }

    /// Adds a list of numbers of single precision, with its length.
    pub(super) fn singles(self, values: &[f32]) -> Self {
        self.list(values, |v| v.to_le_bytes())
    }

    /// Adds a list of indices, with its length.
    pub(super) fn indices(self, values: &[u32]) -> Self {
        self.list(values, |v| v.to_le_bytes())
    }

    /// Adds a list of vectors, with its length.
    pub(super) fn vectors(self, values: &[DVec3]) -> Self {
        self.list(values, |v| {
            v.to_array().into_iter().flat_map(f64::to_le_bytes)
        })
    }

    fn list<T, B: IntoIterator<Item = u8>>(
        mut self,
        values: &[T],
        bytes: impl Fn(&T) -> B,
    ) -> Self {
        self.length(values.len());
        for batch in values.chunks(BATCH) {
            let bytes: Vec<u8> = batch.iter().flat_map(&bytes).collect();
            self.0.update(&bytes);
        }
        self
    }

    /// Returns the hash.
    pub(super) fn finish(self) -> Content {
        Content(*self.0.finalize().as_bytes())
    }

    fn length(&mut self, length: usize) {
        self.0.update(&(length as u64).to_le_bytes());
    }
}

/// Returns voxel labels at a place, shared with scenes that hold equal labels.
///
/// # Errors
/// Returns the errors of [`LabelGrid::new`].
pub(super) fn label_grid(
    size: [usize; 3],
    labels: Vec<u8>,
    to_world: DAffine3,
) -> Result<Arc<LabelGrid>, GridError> {
    let content = labels_content(size, &labels, to_world).finish();
    LABELS.try_get(content, || LabelGrid::new(size, labels, to_world))
}

/// Starts the hash of parts that are built from voxel labels at a place.
pub(super) fn labels_content(size: [usize; 3], labels: &[u8], to_world: DAffine3) -> ContentHasher {
    ContentHasher::default()
        .doubles(&size.map(|n| n as f64))
        .doubles(&to_world.to_cols_array())
        .bytes(labels)
}
