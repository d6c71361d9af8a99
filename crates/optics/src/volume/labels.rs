//! Labels of voxels.

use super::error::GridError;
use super::lattice::to_samples;
use super::layers::{Leaps, cell_of, number_of, spread};
use eikonal::field::Placement;
use glam::{DAffine3, DVec3};
use std::sync::OnceLock;

/// Label, 0 to 255, for each voxel of the unit cube under an affine map. Outside the cube, the
/// labels of the outermost voxels continue.
#[derive(Clone, Debug)]
pub struct LabelGrid {
    size: [usize; 3],
    /// Same as `size`, as floating-point numbers.
    top: DVec3,
    /// Label of each voxel, x fastest.
    labels: Vec<u8>,
    to_world: DAffine3,
    to_voxels: DAffine3,
    /// For each voxel, the number of layers around it with its label. Computed on first use.
    layers: OnceLock<Vec<u8>>,
}

impl LabelGrid {
    /// Creates a grid of `size` = (nx, ny, nz) voxels with `labels`, x fastest. `to_world` maps the
    /// unit cube to the world.
    ///
    /// # Errors
    /// Fails if a size is zero, if the number of labels does not match, or if the map cannot be
    /// inverted.
    pub fn new(size: [usize; 3], labels: Vec<u8>, to_world: DAffine3) -> Result<Self, GridError> {
        let [x, y, z] = size;
        if size.contains(&0) {
            return Err(GridError::Empty(x, y, z));
        }
        if labels.len() != x * y * z {
            return Err(GridError::Length {
                expected: x * y * z,
                found: labels.len(),
            });
        }
        let det = to_world.matrix3.determinant();
        if !(det.is_finite() && det != 0.0) {
            return Err(GridError::Singular);
        }
        Ok(LabelGrid {
            size,
            top: size.map(|n| n as f64).into(),
            labels,
            to_world,
            to_voxels: to_samples(size, Placement::Centers) * to_world.inverse(),
            layers: OnceLock::new(),
        })
    }

    /// Returns the label at a world position.
    #[inline]
    pub fn at(&self, x: DVec3) -> u8 {
        let place = self.to_voxels.transform_point3(x).to_array();
        let [i, j, k] = std::array::from_fn(|axis| {
            let last = (self.size[axis] - 1) as f64;
            (place[axis] + 0.5).floor().clamp(0.0, last) as usize
        });
        self.labels[i + self.size[0] * (j + self.size[1] * k)]
    }

    /// Returns the label at a world position; `None` outside the grid.
    pub(crate) fn within(&self, x: DVec3) -> Option<u8> {
        let place = self.to_voxels.transform_point3(x) + 0.5;
        number_of(cell_of(place), self.top).map(|voxel| self.labels[voxel])
    }

    /// Traces a straight line from `x` in a unit direction, from one cube of voxels with equal
    /// labels to the next.
    #[inline]
    pub fn along(&self, x: DVec3, direction: DVec3) -> Leaps<'_> {
        let layers = self.layers();
        let start = self.to_voxels.transform_point3(x) + 0.5;
        let direction = self.to_voxels.transform_vector3(direction);
        Leaps::new(self.top, layers, [start, direction])
    }

    /// Returns, for each voxel, the number of layers around it with its label.
    #[inline]
    pub(crate) fn layers(&self) -> &[u8] {
        self.layers.get_or_init(|| {
            let mut layers = self.uniform_neighbours();
            spread(self.size, &mut layers);
            layers
        })
    }

    /// Returns `u8::MAX` for each voxel whose 26 neighbours all have its label, and 0 for others.
    /// The comparison goes row by row along x, then y, then z.
    fn uniform_neighbours(&self) -> Vec<u8> {
        let mut uniform = vec![u8::MAX; self.labels.len()];
        let (mut step, mut before) = (1, Vec::new());
        for count in self.size {
            before.clone_from(&uniform);
            let slab = step * count;
            for first in (0..uniform.len()).step_by(slab) {
                let whole = first..first + slab;
                let (labels, before) = (&self.labels[whole.clone()], &before[whole.clone()]);
                let uniform = &mut uniform[whole];
                uniform[..step].fill(0);
                uniform[slab - step..].fill(0);
                for i in step..slab - step {
                    let [low, high] = [i - step, i + step];
                    let same = (labels[low] == labels[i]) & (labels[high] == labels[i]);
                    let all = before[low] & before[i] & before[high];
                    uniform[i] = if same { all } else { 0 };
                }
            }
            step = slab;
        }
        uniform
    }

    /// Returns the number of voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the labels, x fastest.
    pub fn labels(&self) -> &[u8] {
        &self.labels
    }

    /// Returns the map from the unit cube to the world.
    pub fn to_world(&self) -> DAffine3 {
        self.to_world
    }

    /// Returns the memory of the labels in bytes.
    pub fn memory(&self) -> usize {
        2 * self.labels.len()
    }
}

impl PartialEq for LabelGrid {
    fn eq(&self, other: &Self) -> bool {
        self.size == other.size && self.to_world == other.to_world && self.labels == other.labels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// Tests that labels along random lines equal the labels of points on the lines, up to rounding
    /// at faces, in few steps.
    #[test]
    fn labels_along_lines_are_those_of_the_places() {
        let size = [9, 8, 10];
        let at = |i: usize| [i % 9, i / 9 % 8, i / 72];
        let label =
            |[x, y, z]: [usize; 3]| u8::from(z > 5) + 2 * u8::from(x == 4 && y == 4 && z == 2);
        let labels = (0..720).map(|i| label(at(i))).collect();
        let columns = [[1.0, 0.1, 0.0], [0.0, 0.8, 0.2], [0.0, 0.0, 0.5]];
        let to_world =
            DAffine3::from_mat3_translation(DMat3::from_cols_array_2d(&columns), DVec3::NEG_ONE);
        let grid = LabelGrid::new(size, labels, to_world).unwrap();
        let mut rng = testkit::Rng::new(1);
        let mut next = || rng.next_1d();
        let (mut steps, mut lines) = (0, 0);
        for i in 0..2000 {
            let unit = DVec3::new(next(), next(), next()) * 1.2 - 0.1;
            let x = to_world.transform_point3(unit);
            let mut direction = (DVec3::new(next(), next(), next()) - 0.5).normalize();
            if i % 7 == 0 {
                direction = to_world.transform_vector3(DVec3::Y).normalize();
            }
            let inside = unit.min_element() > 0.0 && unit.max_element() < 1.0;
            let mut before = 0.0;
            let mut line = grid.along(x, direction);
            while let Some(voxel) = line.cell() {
                let label = grid.labels[voxel];
                let leap = line.clone();
                let length = line.leap(voxel);
                assert!(inside && length >= before - 1e-12);
                assert!(leap.stays(voxel, length - 1e-9) && !leap.stays(voxel, length + 1e-9));
                for _ in 0..5 {
                    let place = x + direction * (before + (length - before) * next());
                    let near = |e: DVec3| grid.at(place + e * 1e-9) == label;
                    assert!(near(direction) || near(-direction), "{place}");
                }
                (before, steps) = (length, steps + 1);
            }
            lines += usize::from(inside);
            let left = to_world
                .inverse()
                .transform_point3(x + direction * (before + 1e-9));
            assert!(!inside || left.min_element() < 0.0 || left.max_element() > 1.0);
        }
        assert!(steps < 8 * lines, "{steps} {lines}");
    }
}
