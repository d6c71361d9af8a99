//! Finished runs: their results, and their conversion to pickled data.

use crate::errors;
use crate::scene::Scene;
use io::packed::{self, Packed};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use transport::renderer::Renderer;

/// Settings of a finished run.
#[derive(Clone, Debug)]
pub struct RunRecord {
    pub renderer: Renderer,
    /// Reason for the choice of the renderer, if it was chosen automatically.
    pub reason: Option<String>,
    pub seed: u64,
    /// Requested samples per pixel, or particles.
    pub requested: Option<u64>,
    pub stopped: Option<&'static str>,
    /// Number of threads; `None` if parts were combined.
    pub threads: Option<usize>,
    /// Name of the device: `cpu`, or the name of a GPU.
    pub device: String,
    pub seconds: f64,
}

/// A finished run.
#[derive(Debug)]
pub struct Finished<T> {
    /// Result: a picture, or readings of meters.
    pub result: T,
    pub scene: Py<Scene>,
    /// Statistics of the run, as JSON.
    pub stats: String,
    /// Reason for an early end of the run.
    pub stopped: Option<String>,
}

/// Packed result of a run, its scene, its statistics, and the reason for an early end.
pub type Pickled<'py> = (Bound<'py, PyBytes>, Py<Scene>, String, Option<String>);

impl<T: Packed> Finished<T> {
    /// Restores a pickled run.
    ///
    /// # Errors
    /// A result of another version.
    pub fn unpickled(
        packed: &[u8],
        scene: Py<Scene>,
        stats: String,
        stopped: Option<String>,
    ) -> PyResult<Self> {
        Ok(Finished {
            result: packed::unpack(packed).map_err(|e| errors::unpickled(&e))?,
            scene,
            stats,
            stopped,
        })
    }

    /// Returns the arguments that recreate the run, for Python's `__reduce__`.
    ///
    /// # Errors
    /// A result that cannot be packed.
    pub fn pickled<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let packed = packed::pack(&self.result).map_err(|e| errors::unpickled(&e))?;
        let scene = self.scene.clone_ref(py);
        let packed = PyBytes::new(py, &packed);
        Ok((packed, scene, self.stats.clone(), self.stopped.clone()))
    }
}
