//! Loading of a scene as other threads see it: what is being done, and how it is ended.

use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::ObjectDescription;
use std::borrow::Cow;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use transport::Stop;

/// Time between two looks at work under way.
const INTERVAL: Duration = Duration::from_millis(50);
/// Bytes of stack of the thread that loads: as many as the main thread has on Linux.
const STACK: usize = 8 << 20;

/// Progress of loading a scene. Copies share it.
#[derive(Clone, Debug, Default)]
pub struct Loading {
    stop: Stop,
    stage: Arc<Mutex<Stage>>,
}

/// A stage of loading, shown as it completes "while …".
#[derive(Clone, Debug)]
pub struct Stage {
    what: Cow<'static, str>,
    location: Option<Location>,
}

impl Default for Stage {
    fn default() -> Self {
        Stage {
            what: "loading the scene".into(),
            location: None,
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        match &self.location {
            Some(location) => write!(f, " at {location}"),
            None => Ok(()),
        }
    }
}

impl Loading {
    /// Asks loading to end: it does at its next step, with an error.
    pub fn give_up(&self) {
        self.stop.raise();
    }

    /// The stage that loading has come to.
    pub fn stage(&self) -> Stage {
        let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        stage.clone()
    }

    /// Does the `work` of loading on a thread of its own, and calls `look` meanwhile, twenty times a second. When `look` breaks, the work is
    /// asked to end, and left to itself: this function returns at once.
    ///
    /// # Errors
    /// The system does not start another thread.
    pub fn watch<T: Send + 'static, B>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
        mut look: impl FnMut() -> ControlFlow<B>,
    ) -> std::io::Result<ControlFlow<B, T>> {
        let (running, ended) = channel::<()>();
        let thread = thread::Builder::new().stack_size(STACK).spawn(move || {
            // Dropped at the end, also if the work panics.
            let _running = running;
            work()
        })?;
        while ended.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
            if let ControlFlow::Break(reason) = look() {
                self.give_up();
                return Ok(ControlFlow::Break(reason));
            }
        }
        let done = thread.join();
        Ok(ControlFlow::Continue(
            done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        ))
    }

    /// Enters a stage.
    pub(crate) fn begin(&self, what: impl Into<Cow<'static, str>>) {
        self.enter(what.into(), None);
    }

    /// Enters the stage of building an object.
    pub(crate) fn build(&self, object: &ObjectDescription) {
        let what = format!("building {}", object.label());
        self.enter(what.into(), Some(object.location.clone()));
    }

    /// Returns whether loading is to end.
    pub(crate) fn is_given_up(&self) -> bool {
        self.stop.is_raised()
    }

    /// Returns the request to end that the parts of a scene look at while they are put together.
    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Returns the error of loading that was given up; `None` if it was not.
    pub(crate) fn error(&self) -> Option<Diagnostics> {
        let mut diagnostics = Diagnostics::new();
        let message = format!("loading was given up while {}", self.stage());
        diagnostics.push(Diagnostic::error(message));
        self.is_given_up().then_some(diagnostics)
    }

    fn enter(&self, what: Cow<'static, str>, location: Option<Location>) {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        *stage = Stage { what, location };
    }
}
