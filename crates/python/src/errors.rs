//! Conversion of Rust errors to Python exceptions, which `python/morgana/_errors.py` defines.

use io::{Diagnostic, Diagnostics, Problem, Refusal};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use transport::render::MeasureError;

/// Python's exceptions.
mod raised {
    use pyo3::import_exception;

    import_exception!(morgana._errors, SceneError);
    import_exception!(morgana._errors, FileError);
    import_exception!(morgana._errors, RenderError);
}

/// Severity, message, help, place and name of the check, as the arguments of Python's `Diagnostic`.
type Fields = (
    String,
    String,
    Option<String>,
    Option<String>,
    Option<String>,
);

/// Returns messages about a scene as tuples, which Python wraps.
fn fields(diagnostics: &Diagnostics) -> Vec<Fields> {
    let fields = |d: &Diagnostic| {
        let place = d.location.as_ref().map(|l| l.to_string());
        let severity = d.severity.to_string();
        let check = d.lint.map(|lint| lint.to_string());
        (severity, d.message.clone(), d.help.clone(), place, check)
    };
    diagnostics.iter().map(fields).collect()
}

/// Converts messages about a scene to Python's `Diagnostic`s.
pub fn diagnostics<'py>(
    py: Python<'py>,
    diagnostics: &Diagnostics,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let class = py.import("morgana._errors")?.getattr("Diagnostic")?;
    let wrap = |fields: Fields| class.call1(fields);
    fields(diagnostics).into_iter().map(wrap).collect()
}

/// Makes an exception from all errors of a scene.
pub fn scene(diagnostics: &Diagnostics) -> PyErr {
    raised::SceneError::new_err((fields(diagnostics),))
}

/// Makes an exception for a file that cannot be read or written.
pub fn file(error: &io::FileError) -> PyErr {
    raised::FileError::new_err((error.to_string(),))
}

/// Makes an exception for a run that cannot start.
pub fn refusal(refusal: &Refusal) -> PyErr {
    match refusal {
        Refusal::Film(_) | Refusal::MeterMemory(..) | Refusal::Meters(MeasureError::Memory(_)) => {
            PyMemoryError::new_err(refusal.to_string())
        }
        _ => render(refusal.to_string()),
    }
}

/// Makes an exception for a result that cannot be pickled or unpickled.
pub fn unpickled(problem: &Problem) -> PyErr {
    render(format!(
        "the pickled result is {problem}: use pickles only between processes of one version of morgana, and files for storage"
    ))
}

/// Makes an exception for a run that cannot be done.
pub fn render(message: impl Into<String>) -> PyErr {
    raised::RenderError::new_err((message.into(),))
}
