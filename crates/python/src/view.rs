//! Viewer page that Python serves.

use crate::errors;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use view::{Item, ItemOptions, OpenError, ViewOptions, ViewServer};

/// A page that is served until it is closed or dropped.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Viewer {
    /// Address of the page.
    #[pyo3(get)]
    address: String,
    server: Mutex<Option<ViewServer>>,
}

#[pymethods]
impl Viewer {
    /// Serves files, each with the name that the page shows.
    #[new]
    fn new(
        py: Python<'_>,
        files: Vec<(String, PathBuf)>,
        defines: Vec<(String, String)>,
    ) -> PyResult<Self> {
        let options = ItemOptions {
            defines,
            ..ItemOptions::default()
        };
        let open = |(name, path): &(String, PathBuf)| Ok(Item::open(path, &options)?.named(name));
        let items: Result<Vec<Item>, OpenError> = py.detach(|| files.iter().map(open).collect());
        let items = items.map_err(|error| match error {
            OpenError::File(error) => errors::file(&error),
            OpenError::Scene(diagnostics) => errors::scene(&diagnostics),
        })?;
        let options = ViewOptions {
            may_be_framed: true,
            ..ViewOptions::default()
        };
        let server = ViewServer::start(items, &options).map_err(PyOSError::new_err)?;
        Ok(Viewer {
            address: server.address(),
            server: Mutex::new(Some(server)),
        })
    }

    /// Stops serving the page.
    fn close(&self, py: Python<'_>) {
        py.detach(|| {
            drop(
                self.server
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .take(),
            )
        });
    }
}
