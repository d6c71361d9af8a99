//! Long work beside Python: the interpreter stays free, signals are handled, and progress is
//! reported.

use io::loading::Loading;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};
use transport::render::Handle;

/// Time between two checks of signals and progress.
const INTERVAL: Duration = Duration::from_millis(50);

/// State that the work and its watcher share.
#[derive(Debug, Default)]
pub struct Shared {
    /// Handle of the work.
    pub handle: Handle,
    /// True if the work is to end soon.
    pub stop: AtomicBool,
}

impl Shared {
    /// Returns true if the work is to end soon.
    pub fn requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Does `work` on another thread, while this thread runs Python's signal handlers.
///
/// Calls `tick`, if given, with the number of samples so far, and ends the work after `time`.
/// Returns the result of the work, and true after Ctrl-C.
///
/// # Errors
/// Exceptions of a handler or of `tick`, except `KeyboardInterrupt`, once the work has stopped.
pub fn watched<T: Send>(
    py: Python<'_>,
    tick: Option<&Py<PyAny>>,
    time: Option<Duration>,
    work: impl FnOnce(&Shared) -> T + Send,
) -> PyResult<(T, bool)> {
    let shared = Shared::default();
    let (result, raised) = py.detach(|| {
        thread::scope(|scope| {
            let (running, ended) = channel::<()>();
            let shared = &shared;
            let worker = scope.spawn(move || {
                // Drop the sender at the end, also after a panic: the watcher then notices the end.
                let _running = running;
                work(shared)
            });
            let (mut raised, started) = (None, Instant::now());
            while ended.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| look(py, tick, shared)).err();
                    shared.stop.store(raised.is_some(), Ordering::Relaxed);
                }
                if raised.is_some() || time.is_some_and(|t| started.elapsed() >= t) {
                    shared.handle.request_end();
                }
            }
            (worker.join(), raised)
        })
    });
    let result = result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    match raised {
        Some(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => Ok((result, true)),
        Some(error) => Err(error),
        None => Ok((result, false)),
    }
}

/// Does the `work` of loading on another thread, while this thread runs Python's signal handlers.
///
/// # Errors
/// Exceptions of a handler, such as `KeyboardInterrupt`, at once. The work then ends by itself, and
/// its result is dropped.
pub fn loaded<T: Send + 'static>(
    py: Python<'_>,
    loading: &Loading,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let look = || match Python::attach(|py| py.check_signals()) {
        Ok(()) => ControlFlow::Continue(()),
        Err(raised) => ControlFlow::Break(raised),
    };
    match py.detach(|| loading.watch(work, look))? {
        ControlFlow::Continue(loaded) => Ok(loaded),
        ControlFlow::Break(raised) => Err(raised),
    }
}

fn look(py: Python<'_>, tick: Option<&Py<PyAny>>, shared: &Shared) -> PyResult<()> {
    py.check_signals()?;
    if let Some(tick) = tick {
        tick.call1(py, (shared.handle.samples(),))?;
    }
    Ok(())
}
