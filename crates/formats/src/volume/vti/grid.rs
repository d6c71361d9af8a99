//! Position of the samples of a `.vti` file.

use glam::{DMat3, DVec3};
use roxmltree::Node;

use super::bad;
use crate::error::Problem;
use crate::volume::VolumeFrame;

/// Size and position of a grid.
pub(super) struct Grid {
    /// Numbers of samples along x, y, z.
    pub size: [usize; 3],
    /// Position of the samples.
    pub frame: VolumeFrame,
}

impl Grid {
    /// Reads the attributes of the image and of its only piece.
    pub(super) fn read(image: Node, piece: Node, on_points: bool) -> Result<Self, Problem> {
        let whole = extent(image, "WholeExtent")?;
        if extent(piece, "Extent")? != whole {
            let message = "a piece that is not the whole image";
            return Err(Problem::Unsupported(message.into()));
        }
        let origin = numbers(image, "Origin", &[0.0; 3])?;
        let spacing = DVec3::from_array(numbers(image, "Spacing", &[1.0; 3])?);
        let direction = numbers(
            image,
            "Direction",
            &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        )?;
        let direction = DMat3::from_cols_array(&direction).transpose();
        if spacing.min_element() <= 0.0 || direction.determinant() == 0.0 {
            return Err(bad("its spacing or direction is degenerate".into()));
        }
        let axes = whole.map(|range| axis(range, on_points));
        let first = DVec3::from_array(axes.map(|(_, first)| first));
        Ok(Grid {
            size: axes.map(|(count, _)| count),
            frame: VolumeFrame {
                first: DVec3::from_array(origin) + direction * (spacing * first),
                steps: direction * DMat3::from_diagonal(spacing),
                nodes: on_points,
            },
        })
    }
}

/// Returns the number of samples along an axis, and the position of the first, in units of the
/// spacing. A single layer has no cells: its samples are at its points.
fn axis([low, high]: [i32; 2], on_points: bool) -> (usize, f64) {
    let cells = (i64::from(high) - i64::from(low)) as usize;
    match (cells, on_points) {
        (0, _) => (1, f64::from(low)),
        (cells, true) => (cells + 1, f64::from(low)),
        (cells, false) => (cells, f64::from(low) + 0.5),
    }
}

fn extent(node: Node, name: &str) -> Result<[[i32; 2]; 3], Problem> {
    let text = node.attribute(name).unwrap_or("");
    let numbers: Result<Vec<i32>, _> = text.split_whitespace().map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x0, x1, y0, y1, z0, z1]) if x0 <= x1 && y0 <= y1 && z0 <= z1 => {
            Ok([[x0, x1], [y0, y1], [z0, z1]])
        }
        _ => Err(bad(format!("its {name} is '{text}'"))),
    }
}

fn numbers<const N: usize>(
    node: Node,
    name: &str,
    default: &[f64; N],
) -> Result<[f64; N], Problem> {
    let Some(text) = node.attribute(name) else {
        return Ok(*default);
    };
    let numbers = text.split_whitespace().map(str::parse::<f64>);
    let numbers = numbers.collect::<Result<Vec<f64>, _>>().ok();
    let numbers = numbers.filter(|n| n.iter().all(|v| v.is_finite()));
    let numbers = numbers.and_then(|n| n.try_into().ok());
    numbers.ok_or_else(|| bad(format!("its {name} is '{text}'")))
}
