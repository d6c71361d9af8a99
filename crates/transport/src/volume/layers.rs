//! How many layers of cells around each cell are empty.

/// Turns the layers of cells, 0 where they are full and `u8::MAX` elsewhere, x fastest, into distances to the nearest full cell by the
/// largest coordinate, 254 at most. What lies beyond counts as full. Two scans suffice: one forwards and one backwards (A. Rosenfeld and J. L.
/// Pfaltz, "Distance functions on digital pictures", Pattern Recognition 1968).
pub(crate) fn spread(size: [usize; 3], layers: &mut [u8]) {
    let [nx, ny, nz] = size;
    let steps = [1, nx, nx * ny];
    let visit = |layers: &mut [u8], [i, j, k]: [usize; 3], forwards: bool| {
        let cell = i + steps[1] * j + steps[2] * k;
        let edge = [(i, nx), (j, ny), (k, nz)]
            .iter()
            .any(|(i, n)| *i == 0 || i + 1 == *n);
        if edge {
            layers[cell] = layers[cell].min(1);
            return;
        }
        let before = |at: usize| {
            if forwards {
                layers[cell - at]
            } else {
                layers[cell + at]
            }
        };
        // The neighbours that the scan has passed: those of the plane before, of the row before, and one in the row.
        let row = |at: usize| before(at - 1).min(before(at)).min(before(at + 1));
        let plane = row(steps[2] - steps[1])
            .min(row(steps[2]))
            .min(row(steps[2] + steps[1]));
        let least = plane.min(row(steps[1])).min(before(steps[0]));
        layers[cell] = layers[cell].min(least.saturating_add(1)).min(u8::MAX - 1);
    };
    for k in 0..nz {
        for j in 0..ny {
            (0..nx).for_each(|i| visit(layers, [i, j, k], true));
        }
    }
    for k in (0..nz).rev() {
        for j in (0..ny).rev() {
            (0..nx).rev().for_each(|i| visit(layers, [i, j, k], false));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_distances_to_full_cells_and_what_is_beyond() {
        let size = [9, 7, 8];
        let full = |at: [i32; 3]| [[2, 2, 3], [7, 5, 1]].contains(&at);
        let place = |cell: i32| [cell % 9, cell / 9 % 7, cell / 63];
        let mut layers: Vec<u8> = (0..504)
            .map(|c| if full(place(c)) { 0 } else { u8::MAX })
            .collect();
        spread(size, &mut layers);
        for cell in 0..504 {
            let at = place(cell);
            let mut least = i32::MAX;
            for other in [[2, 2, 3], [7, 5, 1]] {
                let distance = (0..3).map(|a| (at[a] - other[a]).abs()).max().unwrap();
                least = least.min(distance);
            }
            for axis in 0..3 {
                least = least.min(at[axis] + 1).min(size[axis] as i32 - at[axis]);
            }
            assert_eq!(i32::from(layers[cell as usize]), least, "{at:?}");
        }
    }
}
