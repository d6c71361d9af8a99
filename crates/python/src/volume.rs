//! Volume files.

use crate::errors;
use crate::numbers::ask_for_memory;
use glam::{DMat3, DVec3};
use io::volume::{Volume, VolumeFrame, write};
use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Writes samples [z, y, x] at nodes as the array `name`, in the format of the file's extension.
/// Formats that store a position keep the position of the first sample and the distances along x, y
/// and z.
#[pyfunction]
pub fn write_volume(
    py: Python<'_>,
    path: PathBuf,
    values: PyReadonlyArray3<'_, f64>,
    origin: [f64; 3],
    spacing: [f64; 3],
    name: &str,
) -> PyResult<()> {
    ask_for_memory(values.len(), size_of::<f64>(), "samples")?;
    let &[depth, height, width] = values.shape() else {
        unreachable!("arrays of three axes")
    };
    let data = values.as_array().iter().copied().collect();
    let frame = VolumeFrame {
        first: DVec3::from(origin),
        steps: DMat3::from_diagonal(DVec3::from(spacing)),
        nodes: true,
    };
    // Replace characters that formats do not allow in names.
    let kept = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let name = name.replace(|c| !kept(c), "_");
    let written = py.detach(|| {
        let volume = Volume::new([width, height, depth], 1, data).map_err(|e| e.at(&path))?;
        write(&path, &volume.with_frame(frame), &name)
    });
    written.map(|_| ()).map_err(|e| errors::file(&e))
}
