//! Parts of scenes by their content: scenes that hold equal parts share them in memory, whichever descriptions they come from.

use transport::shared::Shared;
use transport::volume::VolumeGrid;

/// Grids that scenes hold.
pub(super) static GRIDS: Shared<Content, VolumeGrid> = Shared::new();

/// Numbers that are hashed at once.
const BATCH: usize = 1 << 13;

/// Hash of everything that a part is built from (BLAKE3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Content([u8; 32]);

/// A hash under way.
#[derive(Default)]
pub(super) struct ContentHasher(blake3::Hasher);

impl ContentHasher {
    /// Adds a list of numbers, with its length.
    pub(super) fn doubles(mut self, values: &[f64]) -> Self {
        self.length(values.len());
        for batch in values.chunks(BATCH) {
            let bytes: Vec<u8> = batch.iter().flat_map(|v| v.to_le_bytes()).collect();
            self.0.update(&bytes);
        }
        self
    }

    /// Adds a list of numbers of single precision, with its length.
    pub(super) fn singles(mut self, values: &[f32]) -> Self {
        self.length(values.len());
        for batch in values.chunks(BATCH) {
            let bytes: Vec<u8> = batch.iter().flat_map(|v| v.to_le_bytes()).collect();
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
