//! Positions of arrays that meters wrote. A file contains the edges of an array's cells along x, y
//! and z. It also contains `to_world`, the map of the unit cube that the cells divide
//! (docs/meters.md).

use super::VolumeFrame;
use glam::{DMat3, DVec3};

/// Returns the position of the cells of the array `name` with a given size. `numbers` returns the
/// array of a name if it has the requested number of elements, all finite. With several meters,
/// names of arrays begin with the name of the meter.
pub fn place(
    name: &str,
    size: [usize; 3],
    mut numbers: impl FnMut(&str, usize) -> Option<Vec<f64>>,
) -> Option<VolumeFrame> {
    let meter = name.rfind('.').map_or("", |dot| &name[..=dot]);
    for (axis, cells) in ["x", "y", "z"].into_iter().zip(size) {
        numbers(&format!("{meter}{axis}_edges"), cells + 1)?;
    }
    let rows = numbers(&format!("{meter}to_world"), 12)?;
    let column = |c: usize| DVec3::new(rows[c], rows[4 + c], rows[8 + c]);
    let cells = DVec3::from_array(size.map(|n| n as f64));
    let map = DMat3::from_cols(column(0), column(1), column(2));
    let steps = map * DMat3::from_diagonal(cells.recip());
    let frame = VolumeFrame {
        first: column(3) + steps * DVec3::splat(0.5),
        steps,
        nodes: false,
    };
    frame.is_sound().then_some(frame)
}
