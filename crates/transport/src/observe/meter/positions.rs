//! Bins of position on a surface.

use super::reading::ReadingAxis;
use crate::Bins;
use crate::shape::{Hit, Shape, VoxelFaces};
use std::f64::consts::PI;

/// Number of sides of a grid of voxels.
const SIDES: usize = 6;

/// Bins of position on the surface of a shape: parts, and the coordinates u and v within each part.
///
/// | shape | parts | u | v |
/// |---|---|---|---|
/// | rectangle, side of a cube | sides of the cube | first local coordinate, in \[0, 1\] | second |
/// | disk, cap | | radius, in \[0, 1\] | angle, in turns |
/// | side of a cylinder | side 0, caps 1 and 2 | angle, in turns | height, in \[0, 1\] |
/// | sphere | | angle, in turns | cosine of the polar angle |
/// | mesh | triangles | none | none |
/// | faces of voxels | sides of the grid to which the faces point | coordinate across the grid, in \[0, 1\] | second |
#[derive(Clone, Debug, PartialEq)]
pub struct Positions {
    /// True if v is the cosine of an angle.
    sphere: bool,
    parts: usize,
    resolution: [usize; 2],
    /// Areas of all bins, if they are known.
    areas: Option<Vec<f64>>,
}

impl Positions {
    /// Creates the given numbers of bins along u and v. Parts are distinguished if `parts` is set.
    pub fn new(shape: &Shape, [u, v]: [usize; 2], parts: bool) -> Self {
        let areas = shape.part_areas();
        let total = areas.iter().sum();
        let areas = if parts { areas } else { vec![total] };
        let fine = (u, v) != (1, 1);
        let divide = |(part, area): (usize, &f64)| {
            let disk =
                matches!(shape, Shape::Disk(_)) || matches!(shape, Shape::Cylinder(_)) && part > 0;
            let fraction = move |i: usize| {
                if disk {
                    (2 * i + 1) as f64 / (u * u * v) as f64
                } else {
                    1.0 / (u * v) as f64
                }
            };
            let area = *area;
            (0..u * v)
                .map(move |bin| area * fraction(bin % u))
                .collect::<Vec<f64>>()
        };
        Positions {
            sphere: matches!(shape, Shape::Sphere(_)),
            parts: areas.len(),
            resolution: [u, v],
            areas: (!fine || shape.is_even())
                .then(|| areas.iter().enumerate().flat_map(divide).collect()),
        }
    }

    /// Creates the given numbers of bins along u and v, across the grid to which all the faces
    /// belong. Parts are distinguished if `parts` is set: the faces that point to −x, +x, −y, +y,
    /// −z, +z, with the coordinates y and z, z and x, x and y of the grid.
    pub fn of_voxel_faces<'s>(
        surfaces: impl IntoIterator<Item = &'s VoxelFaces>,
        resolution: [usize; 2],
        parts: bool,
    ) -> Self {
        let bins = resolution[0] * resolution[1];
        let mut areas = vec![0.0; if parts { SIDES * bins } else { bins }];
        for faces in surfaces {
            let own = faces.bin_areas(resolution);
            for (bin, area) in own.into_iter().enumerate() {
                areas[if parts { bin } else { bin % bins }] += area;
            }
        }
        Positions {
            sphere: false,
            parts: if parts { SIDES } else { 1 },
            resolution,
            areas: Some(areas),
        }
    }

    /// Creates a single bin for all surfaces together.
    pub fn whole<'s>(shapes: impl IntoIterator<Item = &'s Shape>) -> Self {
        let area = |shape: &Shape| shape.part_areas().iter().sum::<f64>();
        Positions {
            sphere: false,
            parts: 1,
            resolution: [1, 1],
            areas: Some(vec![shapes.into_iter().map(area).sum()]),
        }
    }

    /// Returns the number of bins.
    pub fn bins(&self) -> usize {
        let [u, v] = self.resolution;
        self.parts.saturating_mul(u).saturating_mul(v)
    }

    /// Returns the areas of all bins; `None` if equal steps of the coordinates differ in area, as
    /// on an ellipsoid.
    pub fn areas(&self) -> Option<&[f64]> {
        self.areas.as_deref()
    }

    /// Returns the axes with more than one bin.
    pub(super) fn axes(&self) -> Vec<ReadingAxis> {
        let parts = Bins {
            min: 0.0,
            max: self.parts as f64,
            count: self.parts,
        };
        let [u, v] = self.ranges();
        let mut axes = Vec::new();
        if self.parts > 1 {
            axes.push(ReadingAxis::new("part", &parts));
        }
        if self.resolution != [1, 1] {
            axes.extend([ReadingAxis::new("v", &v), ReadingAxis::new("u", &u)]);
        }
        axes
    }

    fn ranges(&self) -> [Bins; 2] {
        let bins = |min, count| Bins {
            min,
            max: 1.0,
            count,
        };
        let least = if self.sphere { -1.0 } else { 0.0 };
        [
            bins(0.0, self.resolution[0]),
            bins(least, self.resolution[1]),
        ]
    }

    /// Returns the index of the bin of a surface point.
    pub(super) fn index(&self, hit: &Hit) -> Option<usize> {
        let part = if self.parts > 1 {
            hit.primitive as usize
        } else {
            0
        };
        if self.resolution == [1, 1] {
            return Some(part);
        }
        let [u_bins, v_bins] = self.ranges();
        let [u, v] = hit.uv.get();
        let v = if self.sphere { (PI * v).cos() } else { v };
        let u = u_bins.index(u.clamp(0.0, 1.0))?;
        let v = v_bins.index(v.clamp(v_bins.min, 1.0))?;
        Some((part * v_bins.count + v) * u_bins.count + u)
    }
}
