//! Tree of a grid: a root, nodes of 32³ and 16³ children, leaves of 8³ voxels.

use std::array::from_fn;
use std::collections::HashSet;

use super::bytes::Bytes;
use super::values::Coding;
use crate::error::Problem;
use crate::volume::Sample;

/// Edge of a leaf in voxels, as a power of two.
const LEAF: u32 = 3;
/// Edge of a tile of the root in voxels, as a power of two.
const ROOT: u32 = 12;
/// Levels of nodes between root and leaves, the lower level first: the number of children along an
/// edge, and the edge of a child in voxels, as powers of two.
const NODES: [(u32, u32); 2] = [(4, LEAF), (5, 7)];

/// Index of a voxel. It has 64 bits, so that no sum of indices in a file overflows.
pub(super) type Index = [i64; 3];

/// Part of a tree below its root.
enum NodePart<'a> {
    /// Cube of voxels of one value, by its first voxel and its edge.
    Tile {
        first: Index,
        edge: i64,
        value: f64,
        active: bool,
    },
    /// Leaf, by its first voxel, and the mask of its active voxels.
    Leaf { first: Index, active: &'a [u8] },
}

/// Tree without the values of its leaves.
pub(super) struct Tree<'a> {
    coding: Coding<'a>,
    background: f64,
    /// File content from the root's tiles onwards.
    root: Bytes<'a>,
    /// First voxels of all leaves.
    leaves: Vec<Index>,
    /// Lower and upper corner of the active voxels.
    active: Option<[Index; 2]>,
}

impl<'a> Tree<'a> {
    /// Reads the tree. The values of the leaves follow in the file.
    pub(super) fn read(cursor: &mut Bytes<'a>, coding: Coding<'a>) -> Result<Self, Problem> {
        cursor.u32()?; // The number of buffers, which is always one.
        let background = coding.number(cursor)?;
        let mut tree = Tree {
            coding,
            background,
            root: cursor.clone(),
            leaves: Vec::new(),
            active: None,
        };
        let (mut leaves, mut active) = (Vec::new(), None);
        let mut add = |range: [Index; 2]| {
            active = Some(active.map_or(range, |all| around(all, range)));
        };
        tree.walk(cursor, &mut |part| match part {
            NodePart::Tile {
                first,
                edge,
                active: true,
                ..
            } => add([first, plus(first, [edge - 1; 3])]),
            NodePart::Tile { .. } => {}
            NodePart::Leaf { first, active } => {
                leaves.push(first);
                let on = (0..Coding::LEAF).filter(|i| is_on(active, *i));
                let voxels = on.map(|i| plus(first, position(i, LEAF)));
                if let Some(range) = voxels.map(|at| [at, at]).reduce(around) {
                    add(range);
                }
            }
        })?;
        (tree.leaves, tree.active) = (leaves, active);
        Ok(tree)
    }

    /// Passes all parts of the tree to `visit`, in the order of the file. No two parts share a
    /// voxel, so that the work of filling a box is proportional to its size and the size of the
    /// file.
    fn walk(
        &self,
        cursor: &mut Bytes<'a>,
        visit: &mut impl FnMut(NodePart<'a>),
    ) -> Result<(), Problem> {
        let (tiles, children) = (cursor.u32()?, cursor.u32()?);
        let mut known = HashSet::new();
        let mut key = |cursor: &mut Bytes| {
            let first = index(cursor)?;
            let is_aligned = first.iter().all(|n| n.trailing_zeros() >= ROOT);
            if is_aligned && known.insert(first) {
                Ok(first)
            } else {
                Err(Problem::Malformed("two nodes of its tree overlap".into()))
            }
        };
        for _ in 0..tiles {
            let first = key(cursor)?;
            let value = self.coding.number(cursor)?;
            let [active] = cursor.array()?;
            visit(NodePart::Tile {
                first,
                edge: 1 << ROOT,
                value,
                active: active != 0,
            });
        }
        for _ in 0..children {
            let first = key(cursor)?;
            self.node(cursor, first, 1, visit)?;
        }
        Ok(())
    }

    fn node(
        &self,
        cursor: &mut Bytes<'a>,
        first: Index,
        level: usize,
        visit: &mut impl FnMut(NodePart<'a>),
    ) -> Result<(), Problem> {
        let (branch, edge) = NODES[level];
        let count = 1usize << (3 * branch);
        let children = cursor.take(count / 8)?;
        let active = cursor.take(count / 8)?;
        let values = self.coding.values(cursor, count, active, self.background)?;
        let place = |i: usize| plus(first, position(i, branch).map(|n| n << edge));
        for (i, value) in values.into_iter().enumerate() {
            if !is_on(children, i) {
                visit(NodePart::Tile {
                    first: place(i),
                    edge: 1 << edge,
                    value,
                    active: is_on(active, i),
                });
            }
        }
        for i in (0..count).filter(|i| is_on(children, *i)) {
            match level {
                0 => visit(NodePart::Leaf {
                    first: place(i),
                    active: cursor.take(Coding::LEAF / 8)?,
                }),
                _ => self.node(cursor, place(i), level - 1, visit)?,
            }
        }
        Ok(())
    }

    /// Returns the first active voxel, and the size of the box of all active voxels along x, y, z.
    pub(crate) fn active_box(&self) -> Option<(Index, [usize; 3])> {
        let [low, high] = self.active?;
        Some((low, from_fn(|i| (high[i] - low[i] + 1) as usize)))
    }

    /// Returns all values of the box of `size` voxels from `low` onwards, x fastest. The values of
    /// the leaves are next in the file.
    pub(super) fn dense<T: Sample>(
        &self,
        cursor: &mut Bytes<'a>,
        low: Index,
        size: [usize; 3],
    ) -> Result<Vec<T>, Problem> {
        let mut dense = Dense {
            low,
            size,
            data: vec![T::nearest(self.background); size.iter().product()],
        };
        // Read the tiles again instead of storing them: tiles may take far more memory than the
        // file.
        self.walk(&mut self.root.clone(), &mut |part| {
            if let NodePart::Tile {
                first, edge, value, ..
            } = part
                && value != self.background
            {
                dense.fill(first, edge, |_| value);
            }
        })?;
        for first in &self.leaves {
            let active = cursor.take(Coding::LEAF / 8)?;
            let values = self
                .coding
                .values(cursor, Coding::LEAF, active, self.background)?;
            dense.fill(*first, 1 << LEAF, |[x, y, z]| {
                values[x << (2 * LEAF) | y << LEAF | z]
            });
        }
        Ok(dense.data)
    }
}

/// Values of all voxels of a box.
struct Dense<T> {
    low: Index,
    size: [usize; 3],
    data: Vec<T>,
}

impl<T: Sample> Dense<T> {
    /// Sets the values of a cube from `first` onwards, by position in the cube, within the box.
    fn fill(&mut self, first: Index, edge: i64, value: impl Fn([usize; 3]) -> f64) {
        let start: Index = from_fn(|i| first[i] - self.low[i]);
        let range = |i: usize| {
            let most = self.size[i] as i64;
            start[i].clamp(0, most)..(start[i] + edge).clamp(0, most)
        };
        let [nx, ny, _] = self.size.map(|n| n as i64);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let place = [x - start[0], y - start[1], z - start[2]];
                    let value = T::nearest(value(place.map(|n| n as usize)));
                    self.data[((z * ny + y) * nx + x) as usize] = value;
                }
            }
        }
    }
}

/// Returns the position of child `i` in a node with 2^`branch` children along an edge: z is
/// fastest.
fn position(i: usize, branch: u32) -> Index {
    let mask = (1 << branch) - 1;
    let part = |shift: u32| (i >> shift & mask) as i64;
    [part(2 * branch), part(branch), part(0)]
}

fn plus(a: Index, b: Index) -> Index {
    from_fn(|i| a[i] + b[i])
}

/// Returns the box around two boxes.
fn around(a: [Index; 2], b: [Index; 2]) -> [Index; 2] {
    [
        from_fn(|i| a[0][i].min(b[0][i])),
        from_fn(|i| a[1][i].max(b[1][i])),
    ]
}

fn index(cursor: &mut Bytes) -> Result<Index, Problem> {
    Ok([cursor.i32()?, cursor.i32()?, cursor.i32()?].map(i64::from))
}

/// Returns a bit of a mask.
pub(super) fn is_on(mask: &[u8], i: usize) -> bool {
    mask[i / 8] >> (i % 8) & 1 == 1
}
