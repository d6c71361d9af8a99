//! Vectors that take memory only where they have been written.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::{Index, Range};

/// Storage of each block; `None` for blocks that have not been written.
type Blocks<T> = Vec<Option<Box<[T]>>>;

/// Vector of fixed length. All elements have the same value, except in blocks that have been
/// written. Other blocks take no memory.
///
/// ```
/// use morgana_transport::sparse::Sparse;
/// let mut cells = Sparse::new(1_000_000, 0.0);
/// *cells.get_mut(5000) += 2.5;
/// assert_eq!((cells[5000], cells[7], cells.len()), (2.5, 0.0, 1_000_000));
/// assert!(cells.written(0..cells.len()).count() < 100);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored<T>")]
pub struct Sparse<T> {
    blocks: Blocks<T>,
    len: usize,
    /// Value of all elements of blocks that have not been written.
    rest: T,
}

/// Stored vector before its lengths are checked.
#[derive(Deserialize)]
struct Stored<T> {
    blocks: Blocks<T>,
    len: usize,
    rest: T,
}

impl<T> Sparse<T> {
    /// Elements per block. Smaller blocks would follow the written cells more closely, but each
    /// block takes 16 bytes of the table and 16 bytes of the allocator.
    pub(crate) const BLOCK: usize = 1 << 6;
}

impl<T> TryFrom<Stored<T>> for Sparse<T> {
    type Error = &'static str;

    fn try_from(stored: Stored<T>) -> Result<Self, Self::Error> {
        let Stored { blocks, len, rest } = stored;
        let fits = |(i, block): (usize, &Option<Box<[T]>>)| {
            let size = Self::BLOCK.min(len - i * Self::BLOCK);
            block.as_ref().is_none_or(|block| block.len() == size)
        };
        if blocks.len() != len.div_ceil(Self::BLOCK) || !blocks.iter().enumerate().all(fits) {
            return Err("the lengths of the blocks and the vector differ");
        }
        Ok(Sparse { blocks, len, rest })
    }
}

impl<T: Copy> Sparse<T> {
    /// Creates a vector of `len` equal values.
    pub fn new(len: usize, rest: T) -> Self {
        let blocks = std::iter::repeat_with(|| None);
        Sparse {
            blocks: blocks.take(len.div_ceil(Self::BLOCK)).collect(),
            len,
            rest,
        }
    }

    /// Returns the bytes that a vector of `len` elements takes once all blocks are written.
    pub fn memory(len: usize) -> usize {
        let table = len.div_ceil(Self::BLOCK) * size_of::<Option<Box<[T]>>>();
        len.saturating_mul(size_of::<T>()).saturating_add(table)
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if the length is zero.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the value of all elements of blocks that have not been written.
    pub(crate) fn rest(&self) -> T {
        self.rest
    }

    /// Returns an element for writing.
    ///
    /// # Panics
    /// If the index is out of bounds.
    pub fn get_mut(&mut self, index: usize) -> &mut T {
        element(&mut self.blocks, self.rest, self.len, index)
    }

    /// Iterates over all elements in order.
    pub fn iter(&self) -> Iter<'_, T> {
        Iter {
            vector: self,
            left: 0..self.len,
        }
    }

    /// Returns the elements of a range that are in written blocks, with their indices.
    pub fn written(&self, range: Range<usize>) -> impl Iterator<Item = (usize, T)> {
        let end = range.end.min(self.len);
        let blocks = range.start / Self::BLOCK..end.div_ceil(Self::BLOCK);
        let written = blocks.filter_map(|b| Some((b * Self::BLOCK, self.blocks[b].as_deref()?)));
        let elements = written.flat_map(|(first, block)| (first..).zip(block.iter().copied()));
        elements.filter(move |(i, _)| (range.start..end).contains(i))
    }

    /// Resets the blocks inside a range, and frees their memory.
    pub(crate) fn clear(&mut self, range: Range<usize>) {
        let end = if range.end >= self.len {
            self.blocks.len()
        } else {
            range.end / Self::BLOCK
        };
        for block in range.start.div_ceil(Self::BLOCK)..end {
            self.blocks[block] = None;
        }
    }

    /// Calls a function in parallel for parts of `blocks` blocks, with the index of each part's
    /// first element.
    pub(crate) fn for_each_part(
        &mut self,
        blocks: usize,
        see: impl Fn(usize, Part<T>) + Send + Sync,
    ) where
        T: Send + Sync,
    {
        let (rest, len) = (self.rest, self.len);
        let parts = self.blocks.par_chunks_mut(blocks).enumerate();
        parts.for_each(|(i, part)| {
            let first = i * blocks * Self::BLOCK;
            let part = Part {
                blocks: part,
                rest,
                left: len - first,
            };
            see(first, part);
        });
    }
}

impl<T: Copy + Default + PartialEq> Sparse<T> {
    /// Maps all elements by a function of index and value. The function must map zeros (or `false`)
    /// to zeros.
    ///
    /// Zeros of blocks that have not been written stay as the system allocates them. They take no
    /// memory until they are written.
    pub fn dense<U: Copy + Default>(&self, value: impl Fn(usize, T) -> U) -> Vec<U> {
        if self.rest != T::default() {
            return self.iter().enumerate().map(|(i, v)| value(i, *v)).collect();
        }
        let mut all = vec![U::default(); self.len];
        for (i, v) in self.written(0..self.len) {
            all[i] = value(i, v);
        }
        all
    }
}

impl<T: Copy> Index<usize> for Sparse<T> {
    type Output = T;

    #[inline]
    fn index(&self, index: usize) -> &T {
        match &self.blocks[index / Self::BLOCK] {
            Some(block) => &block[index % Self::BLOCK],
            None => &self.rest,
        }
    }
}

/// Iterator over all elements of a vector in order.
#[derive(Clone, Debug)]
pub struct Iter<'v, T> {
    vector: &'v Sparse<T>,
    /// Indices of the remaining elements.
    left: Range<usize>,
}

impl<'v, T: Copy> Iterator for Iter<'v, T> {
    type Item = &'v T;

    fn next(&mut self) -> Option<&'v T> {
        self.left.next().map(|i| &self.vector[i])
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.left.size_hint()
    }
}

impl<'v, T: Copy> IntoIterator for &'v Sparse<T> {
    type Item = &'v T;
    type IntoIter = Iter<'v, T>;

    fn into_iter(self) -> Iter<'v, T> {
        self.iter()
    }
}

/// Some neighbouring blocks of a vector.
pub(crate) struct Part<'v, T> {
    blocks: &'v mut [Option<Box<[T]>>],
    rest: T,
    /// Number of elements from the start of the part to the end of the vector.
    left: usize,
}

impl<T: Copy> Part<'_, T> {
    /// Returns an element for writing; `index` counts from the start of the part.
    #[inline]
    pub(crate) fn get_mut(&mut self, index: usize) -> &mut T {
        element(self.blocks, self.rest, self.left, index)
    }
}

/// Returns an element for writing, in blocks of a vector that ends after `left` elements. Its last
/// block may be shorter.
#[inline]
fn element<T: Copy>(blocks: &mut [Option<Box<[T]>>], rest: T, left: usize, index: usize) -> &mut T {
    let (number, place) = (index / Sparse::<T>::BLOCK, index % Sparse::<T>::BLOCK);
    let size = || Sparse::<T>::BLOCK.min(left - (index - place));
    let block = blocks[number].get_or_insert_with(|| vec![rest; size()].into());
    &mut block[place]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_written_blocks_are_stored() {
        let mut cells = Sparse::new(1000, 0.0);
        for i in [130, 999] {
            *cells.get_mut(i) = i as f64;
        }
        let found = |range| cells.written(range).filter(|(_, v)| *v != 0.0);
        let all: Vec<_> = found(0..1000).collect();
        assert_eq!(all, [(130, 130.0), (999, 999.0)]);
        assert_eq!(found(131..999).count(), 0);
        // The written blocks are 128 to 191, and 960 to 999.
        assert_eq!(cells.written(0..1000).count(), 64 + 40);
        assert!(cells.iter().eq(&cells.dense(|_, v| v)));
        for range in [0..191, 129..999] {
            cells.clear(range);
            assert_eq!((cells[130], cells[999]), (130.0, 999.0));
        }
        cells.clear(128..192);
        assert_eq!((cells[130], cells[999]), (0.0, 999.0));
        cells.clear(960..1000);
        assert_eq!(cells[999], 0.0);
        assert_eq!(Sparse::<f64>::memory(1000), 1000 * 8 + 16 * 16);
    }

    #[test]
    fn values_that_are_not_zero_are_everywhere() {
        let errors = Sparse::new(70, f64::INFINITY);
        assert_eq!(errors.dense(|_, v| v), [f64::INFINITY; 70]);
    }

    #[test]
    fn blocks_of_wrong_lengths_are_refused() {
        let stored = |blocks: Blocks<f64>| Stored {
            blocks,
            len: 70,
            rest: 0.0,
        };
        let block = |len: usize| Some(vec![1.0; len].into_boxed_slice());
        assert!(Sparse::try_from(stored(vec![None, block(6)])).is_ok());
        assert!(Sparse::try_from(stored(vec![None, block(64)])).is_err());
        assert!(Sparse::try_from(stored(vec![None])).is_err());
    }
}
