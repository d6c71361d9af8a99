//! Viewer page for Python, which answers requests of notebooks and serves browsers.

use crate::errors;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use view::{Item, ItemOptions, OpenError, Page, ViewOptions, ViewServer};

/// A page that shows files.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Viewer {
    page: Arc<Page>,
    /// Server of the page, from the first request for its address until it is closed.
    server: Mutex<Option<ViewServer>>,
}

#[pymethods]
impl Viewer {
    /// Opens files, each with the name that the page shows.
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
        Ok(Viewer {
            page: Arc::new(Page::new(items)),
            server: Mutex::new(None),
        })
    }

    /// Returns the address of the page for browsers on this machine. The first call starts a server.
    fn address(&self, py: Python<'_>) -> PyResult<String> {
        let options = ViewOptions {
            may_be_framed: true,
            ..ViewOptions::default()
        };
        let address = || {
            let mut server = self.server.lock().unwrap_or_else(PoisonError::into_inner);
            if server.is_none() {
                *server = Some(ViewServer::start(self.page.clone(), &options)?);
            }
            Ok(server.as_ref().map(ViewServer::address).unwrap_or_default())
        };
        py.detach(address)
            .map_err(PyOSError::new_err::<std::io::Error>)
    }

    /// Responds to a request of the page: status, media type and content.
    fn respond<'py>(
        &self,
        py: Python<'py>,
        method: &str,
        target: &str,
        body: Vec<u8>,
    ) -> (u16, &'static str, Bound<'py, PyBytes>) {
        let response = py.detach(|| self.page.respond(method, target, body));
        let content = PyBytes::new(py, &response.content);
        (response.status, response.media_type, content)
    }

    /// Stops the server, if there is one.
    fn close(&self, py: Python<'_>) {
        let server = || self.server.lock().unwrap_or_else(PoisonError::into_inner);
        py.detach(|| drop(server().take()));
    }
}
