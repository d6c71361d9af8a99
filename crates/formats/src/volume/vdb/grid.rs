//! Metadata of grids in a file: names, types, positions.

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::bytes::{Bytes, Cut};
use crate::element::Element;
use crate::error::Problem;

/// Suffix of the name of a tree whose numbers are stored in half precision.
const HALF: &str = "_HalfFloat";
/// Separator between a name and the number that makes it unique.
const SEPARATOR: char = '\u{1e}';

/// Grid of floating-point numbers.
pub(super) struct Descriptor {
    pub name: String,
    /// Number type in the tree.
    pub tree: Element,
    /// Number type in the file: half precision, or the type of the tree.
    pub element: Element,
    /// Offset of the grid in the file.
    pub at: usize,
}

impl Descriptor {
    /// Returns all grids of floating-point numbers of a file.
    pub(super) fn all<'a>(cursor: &mut Bytes<'a>, file: &'a [u8]) -> Result<Vec<Self>, Problem> {
        let count = cursor.i32()?;
        let mut grids = Vec::new();
        for _ in 0..count {
            let name = cursor.text()?;
            let kind = cursor.text()?;
            let parent = cursor.text()?;
            let at = cursor.i64()?;
            cursor.take(8)?; // Skip the offset of the values, which follow the tree.
            let end = usize::try_from(cursor.i64()?).map_err(|_| Cut)?;
            let tree = match kind.trim_end_matches(HALF) {
                "Tree_float_5_4_3" => Some(Element::F32),
                "Tree_double_5_4_3" => Some(Element::F64),
                _ => None,
            };
            // Skip instances, which share the tree of another grid.
            if let Some(tree) = tree.filter(|_| parent.is_empty()) {
                let name = name.split(SEPARATOR).next().unwrap_or_default();
                grids.push(Descriptor {
                    name: name.to_owned(),
                    tree,
                    element: if kind.ends_with(HALF) {
                        Element::F16
                    } else {
                        tree
                    },
                    at: usize::try_from(at).map_err(|_| Cut)?,
                });
            }
            // Continue after the data of this grid. An earlier position would be read repeatedly.
            if end < file.len() - cursor.len() {
                let message = "a grid that ends before it begins";
                return Err(Problem::Malformed(message.into()));
            }
            *cursor = Bytes::new(file.get(end..).ok_or(Cut)?);
        }
        Ok(grids)
    }
}

/// Skips names, types and values of metadata.
pub(super) fn skip_metadata(cursor: &mut Bytes) -> Result<(), Cut> {
    for _ in 0..cursor.u32()? {
        cursor.sized()?;
        cursor.sized()?;
        cursor.sized()?;
    }
    Ok(())
}

/// Returns the map from voxel indices to the world.
pub(super) fn transform(cursor: &mut Bytes) -> Result<DAffine3, Problem> {
    let kind = cursor.text()?;
    let mut vector =
        || -> Result<DVec3, Cut> { Ok(DVec3::new(cursor.f64()?, cursor.f64()?, cursor.f64()?)) };
    // Skip four derived vectors after scales.
    match kind.as_str() {
        "UniformScaleMap" | "ScaleMap" => {
            let scale = vector()?;
            (0..4).try_for_each(|_| vector().map(drop))?;
            Ok(DAffine3::from_scale(scale))
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let (translation, scale) = (vector()?, vector()?);
            (0..4).try_for_each(|_| vector().map(drop))?;
            let matrix3 = DMat3::from_diagonal(scale);
            Ok(DAffine3 {
                matrix3,
                translation,
            })
        }
        "TranslationMap" => Ok(DAffine3::from_translation(vector()?)),
        "AffineMap" | "UnitaryMap" => {
            let mut numbers = [0.0; 16];
            for number in &mut numbers {
                *number = cursor.f64()?;
            }
            // Read rows as columns: the file multiplies rows by a matrix, and this crate a matrix
            // by columns.
            Ok(DAffine3::from_mat4(DMat4::from_cols_array(&numbers)))
        }
        other => Err(Problem::Unsupported(format!(
            "an OpenVDB transform of type {other}"
        ))),
    }
}
