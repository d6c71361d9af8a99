//! What files of k-Wave say of their arrays.

use glam::DVec3;
use hdf5_reader::Hdf5File;

use super::elements::number;
use crate::error::Problem;
use crate::volume::layout::Layout;

/// What the datasets `dx`, `dy` and `dz` of k-Wave say, in metres.
pub(super) fn spacing(file: &Hdf5File) -> Option<DVec3> {
    let number = |name| number(file, name).filter(|v| *v > 0.0);
    Some(DVec3::new(number("dx")?, number("dy")?, number("dz")?))
}

/// Seconds between instants.
pub(super) fn time_step(file: &Hdf5File) -> Option<f64> {
    number(file, "dt").filter(|v| *v > 0.0)
}

/// The layout of an array `[1, t, point]`, whose sensor has recorded at the points of a mask, if these are all points of the grid.
pub(super) fn whole_grid(file: &Hdf5File, shape: &[usize]) -> Result<Option<Layout>, Problem> {
    let size = ["Nz", "Ny", "Nx"].map(|name| number(file, name).map(|n| n as usize));
    let ([1, times, points], [Some(z), Some(y), Some(x)]) = (shape, size) else {
        return Ok(None);
    };
    if [z, y, x] == [1, *times, *points] {
        return Ok(None);
    }
    if z.checked_mul(y).and_then(|n| n.checked_mul(x)) == Some(*points) {
        return Layout::columns([x, y, z], *times).map(Some);
    }
    Err(Problem::Mismatch {
        expected: format!(
            "pressure at all {x} x {y} x {z} points of k-Wave's grid, or in a cuboid"
        ),
        found: format!("{points} points of a mask"),
    })
}
