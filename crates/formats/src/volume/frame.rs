//! Position of the samples of a volume in space.

use glam::{DAffine3, DMat3, DVec3};

/// Position of samples that a file states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeFrame {
    /// Position of the first sample, in the file's coordinates.
    pub first: DVec3,
    /// Steps from a sample to the next along x, y and z, as columns.
    pub steps: DMat3,
    /// True if the outermost samples lie on the faces of the box that the samples fill, false if
    /// half a step inside.
    pub nodes: bool,
}

impl VolumeFrame {
    /// Returns the position of samples at the centres of equal cells that fill a box from `low` to
    /// `high`.
    pub fn of_box([low, high]: [DVec3; 2], size: [usize; 3]) -> Self {
        let spacing = (high - low) / DVec3::from_array(size.map(|n| n as f64));
        VolumeFrame {
            first: low + 0.5 * spacing,
            steps: DMat3::from_diagonal(spacing),
            nodes: false,
        }
    }

    /// Returns the map from the unit cube, which the samples fill, to the file's coordinates. A
    /// single layer is one step thick, even between nodes.
    pub fn to_file(&self, size: [usize; 3]) -> DAffine3 {
        let axis = |n: usize| {
            if self.nodes && n > 1 {
                (0.0, (n - 1) as f64)
            } else {
                (-0.5, n as f64)
            }
        };
        let start = DVec3::from_array(size.map(|n| axis(n).0));
        let edge = DVec3::from_array(size.map(|n| axis(n).1));
        DAffine3 {
            matrix3: self.steps * DMat3::from_diagonal(edge),
            translation: self.first + self.steps * start,
        }
    }

    /// Returns the distances between neighbours along x, y and z.
    pub fn spacing(&self) -> DVec3 {
        let steps = self.steps;
        DVec3::new(
            steps.x_axis.length(),
            steps.y_axis.length(),
            steps.z_axis.length(),
        )
    }

    /// Returns true if x, y and z of the samples are x, y and z of space.
    pub fn is_aligned(&self) -> bool {
        let diagonal = self.steps.diagonal();
        self.steps == DMat3::from_diagonal(diagonal) && diagonal.min_element() > 0.0
    }

    /// Returns true if positions are finite and steps are not coplanar.
    pub(super) fn is_sound(&self) -> bool {
        let volume = self.steps.determinant();
        self.first.is_finite() && volume.is_finite() && volume != 0.0
    }
}
