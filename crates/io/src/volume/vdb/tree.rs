//! The tree of a grid: a root, nodes of 32³ and 16³ children, leaves of 8³ voxels.

use std::array::from_fn;

use super::bytes::Bytes;
use super::values::Coding;
use crate::error::Problem;
use crate::volume::Sample;

/// The edge of a leaf in voxels, as a power of two.
const LEAF: u32 = 3;
/// The same of a tile of the root.
const ROOT: u32 = 12;
/// Of the two levels of nodes in between, the lower first: how many children there are along an edge, and the edge
/// of a child in voxels, as powers of two.
const NODES: [(u32, u32); 2] = [(4, LEAF), (5, 7)];

/// The index of a voxel. In 64 bits, so that no sum of those of a file overflows.
pub(super) type Index = [i64; 3];

/// A cube of voxels of one value.
struct Tile {
    first: Index,
    /// Its edge.
    edge: i64,
    value: f64,
    active: bool,
}

/// A leaf, by its first voxel.
struct Leaf {
    first: Index,
    /// The least and the greatest active voxel.
    active: Option<[Index; 2]>,
}

/// A tree without the values of its leaves.
pub(super) struct Tree<'a> {
    coding: Coding<'a>,
    background: f64,
    tiles: Vec<Tile>,
    leaves: Vec<Leaf>,
}

impl<'a> Tree<'a> {
    /// Reads the tree, after which come the values of its leaves.
    pub fn read(cursor: &mut Bytes, coding: Coding<'a>) -> Result<Self, Problem> {
        cursor.u32()?; // The number of buffers, which is always one.
        let mut tree = Tree {
            background: coding.number(cursor)?,
            coding,
            tiles: Vec::new(),
            leaves: Vec::new(),
        };
        let (tiles, children) = (cursor.u32()?, cursor.u32()?);
        for _ in 0..tiles {
            let first = index(cursor)?;
            let value = tree.coding.number(cursor)?;
            let [active] = cursor.array()?;
            tree.add_tile(first, ROOT, value, active != 0);
        }
        for _ in 0..children {
            let first = index(cursor)?;
            tree.node(cursor, first, 1)?;
        }
        Ok(tree)
    }

    fn node(&mut self, cursor: &mut Bytes, first: Index, level: usize) -> Result<(), Problem> {
        let (branch, edge) = NODES[level];
        let count = 1usize << (3 * branch);
        let children = cursor.take(count / 8)?;
        let active = cursor.take(count / 8)?;
        let values = self.coding.values(cursor, count, active, self.background)?;
        let place = |i: usize| plus(first, position(i, branch).map(|n| n << edge));
        for (i, value) in values.into_iter().enumerate() {
            if !is_on(children, i) {
                self.add_tile(place(i), edge, value, is_on(active, i));
            }
        }
        for i in (0..count).filter(|i| is_on(children, *i)) {
            match level {
                0 => self.leaf(cursor, place(i))?,
                _ => self.node(cursor, place(i), level - 1)?,
            }
        }
        Ok(())
    }

    fn leaf(&mut self, cursor: &mut Bytes, first: Index) -> Result<(), Problem> {
        let mask = cursor.take(Coding::LEAF / 8)?;
        let on = (0..Coding::LEAF).filter(|i| is_on(mask, *i));
        let voxels = on.map(|i| plus(first, position(i, LEAF)));
        let active = voxels.map(|at| [at, at]).reduce(around);
        self.leaves.push(Leaf { first, active });
        Ok(())
    }

    /// Notes a tile that differs from what is everywhere.
    fn add_tile(&mut self, first: Index, edge: u32, value: f64, active: bool) {
        if active || value != self.background {
            self.tiles.push(Tile {
                first,
                edge: 1 << edge,
                value,
                active,
            });
        }
    }

    /// The first active voxel, and how many the box of all has along x, y, z.
    pub fn active_box(&self) -> Option<(Index, [usize; 3])> {
        let tiles = self.tiles.iter().filter(|tile| tile.active);
        let tiles = tiles.map(|tile| [tile.first, plus(tile.first, [tile.edge - 1; 3])]);
        let leaves = self.leaves.iter().filter_map(|leaf| leaf.active);
        let [low, high] = leaves.chain(tiles).reduce(around)?;
        Some((low, from_fn(|i| (high[i] - low[i] + 1) as usize)))
    }

    /// All values of the box of `size` voxels from `low` on, x fastest. Those of the leaves are next in the file.
    pub fn dense<T: Sample>(
        &self,
        cursor: &mut Bytes,
        low: Index,
        size: [usize; 3],
    ) -> Result<Vec<T>, Problem> {
        let mut dense = Dense {
            low,
            size,
            data: vec![T::nearest(self.background); size.iter().product()],
        };
        for tile in &self.tiles {
            dense.fill(tile.first, tile.edge, |_| tile.value);
        }
        for leaf in &self.leaves {
            let active = cursor.take(Coding::LEAF / 8)?;
            let values = self
                .coding
                .values(cursor, Coding::LEAF, active, self.background)?;
            dense.fill(leaf.first, 1 << LEAF, |[x, y, z]| {
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
    /// Sets those of a cube from `first` on, as far as it is in the box, by their place in the cube.
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

/// Where child `i` of a node with 2^`branch` along an edge is: z is fastest.
fn position(i: usize, branch: u32) -> Index {
    let mask = (1 << branch) - 1;
    let part = |shift: u32| (i >> shift & mask) as i64;
    [part(2 * branch), part(branch), part(0)]
}

fn plus(a: Index, b: Index) -> Index {
    from_fn(|i| a[i] + b[i])
}

/// The box around two.
fn around(a: [Index; 2], b: [Index; 2]) -> [Index; 2] {
    [
        from_fn(|i| a[0][i].min(b[0][i])),
        from_fn(|i| a[1][i].max(b[1][i])),
    ]
}

fn index(cursor: &mut Bytes) -> Result<Index, Problem> {
    Ok([cursor.i32()?, cursor.i32()?, cursor.i32()?].map(i64::from))
}

/// A bit of a mask.
pub(super) fn is_on(mask: &[u8], i: usize) -> bool {
    mask[i / 8] >> (i % 8) & 1 == 1
}
