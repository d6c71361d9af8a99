//! Runs that have ended: what they gave, and how they are pickled.

use crate::errors;
use crate::scene::Scene;
use io::packed::{self, Packed};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use transport::renderer::Renderer;

/// How a run was done.
#[derive(Clone, Debug)]
pub struct RunRecord {
    pub renderer: Renderer,
    /// Why that was chosen, if it was.
    pub reason: Option<String>,
    pub seed: u64,
    /// Samples per pixel, or particles.
    pub requested: Option<u64>,
    pub stopped: Option<&'static str>,
    /// None if parts were put together.
    pub threads: Option<usize>,
    pub seconds: f64,
}

/// A run that has ended.
#[derive(Debug)]
pub struct Finished<T> {
    /// What it gave: a picture, or what meters have read.
    pub result: T,
    pub scene: Py<Scene>,
    /// Everything about the run, as JSON.
    pub stats: String,
    /// Why it ended early.
    pub stopped: Option<String>,
}

/// Of a run: its packed result, the scene, everything about the run, and why it ended early.
pub type Pickled<'py> = (Bound<'py, PyBytes>, Py<Scene>, String, Option<String>);

impl<T: Packed> Finished<T> {
    /// What was pickled.
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

    /// What makes it again, as Python's `__reduce__` returns it.
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
