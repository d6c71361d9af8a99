//! Long work beside Python: the interpreter stays free, signals are seen, progress is told.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Time between two looks at signals and progress.
const INTERVAL: Duration = Duration::from_millis(50);

/// What work and its watcher share.
#[derive(Debug, Default)]
pub struct Shared {
    /// Samples taken so far.
    pub counter: AtomicU64,
    /// Whether the work is to end soon.
    pub stop: AtomicBool,
}

/// Does `work` on a thread of its own while this one runs Python's signal handlers and calls `tick`, if given, with
/// the samples so far. Returns what the work gives, and whether Ctrl-C has stopped it.
///
/// # Errors
/// What a handler or `tick` raises, once the work has stopped: all but `KeyboardInterrupt`.
pub fn watched<T: Send>(
    py: Python<'_>,
    tick: Option<&Py<PyAny>>,
    work: impl FnOnce(&Shared) -> T + Send,
) -> PyResult<(T, bool)> {
    let shared = Shared::default();
    let (result, raised) = py.detach(|| {
        thread::scope(|scope| {
            let (running, ended) = channel::<()>();
            let shared = &shared;
            let worker = scope.spawn(move || {
                // Dropped at the end, also if the work panics: the watcher then knows.
                let _running = running;
                work(shared)
            });
            let mut raised = None;
            while ended.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| look(py, tick, shared)).err();
                    shared.stop.store(raised.is_some(), Ordering::Relaxed);
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

fn look(py: Python<'_>, tick: Option<&Py<PyAny>>, shared: &Shared) -> PyResult<()> {
    py.check_signals()?;
    if let Some(tick) = tick {
        tick.call1(py, (shared.counter.load(Ordering::Relaxed),))?;
    }
    Ok(())
}
