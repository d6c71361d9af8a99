//! Sides of the volume that are mirrors.

use serde_json::{Value, json};

/// Distance of a mirror from the side of the volume, in voxels, on the inside: light never reaches
/// the side. Sources on the side start further inside.
const INSET: f64 = 1e-6;

/// Names of the sides.
const NAMES: [&str; 6] = ["-x", "-y", "-z", "+x", "+y", "+z"];

/// Makes the shapes of the sides that are mirrors, with their names.
pub(super) fn shapes(
    mirrors: [bool; 6],
    size: [usize; 3],
    unit: f64,
) -> impl Iterator<Item = (String, Value)> {
    let sides = (0..6).filter(move |side| mirrors[*side]);
    sides.map(move |side| {
        let shape = json!({
            "type": "rectangle",
            "to_world": [{"matrix": matrix(side, size, unit)}],
            "bsdf": {"type": "twosided", "inside": {"type": "conductor"}},
        });
        (format!("mirror {}", NAMES[side]), shape)
    })
}

/// Returns the matrix from the square [−1, 1]² to a side of the volume.
fn matrix(side: usize, size: [usize; 3], unit: f64) -> [[f64; 4]; 4] {
    let (axis, is_upper) = (side % 3, side >= 3);
    let edges = size.map(|n| n as f64 * unit);
    let mut matrix = [[0.0; 4]; 4];
    let [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
    matrix[first][0] = 0.5 * edges[first];
    matrix[second][1] = 0.5 * edges[second];
    matrix[axis][2] = 1.0;
    matrix[first][3] = 0.5 * edges[first];
    matrix[second][3] = 0.5 * edges[second];
    matrix[axis][3] = if is_upper {
        edges[axis] - INSET * unit
    } else {
        INSET * unit
    };
    matrix[3][3] = 1.0;
    matrix
}
