//! Progress of loading a scene for other threads, and requests to end it.

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

/// Time between two checks of the work in progress.
const INTERVAL: Duration = Duration::from_millis(50);
/// Stack size of the loading thread in bytes: the size of the main thread's stack on Linux.
const STACK: usize = 8 << 20;

/// Progress of loading a scene. Copies share it.
#[derive(Clone, Debug, Default)]
pub struct Loading {
    stop: Stop,
    stage: Arc<Mutex<Stage>>,
}

/// A stage of loading, displayed so that it completes "while …".
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
    /// Requests that loading ends. It ends at its next step, with an error.
    pub fn give_up(&self) {
        self.stop.raise();
    }

    /// Returns the current stage of loading.
    pub fn stage(&self) -> Stage {
        let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        stage.clone()
    }

    /// Runs `work` on a thread of its own, and meanwhile calls `look` twenty times a second. When
    /// `look` breaks, this function requests that the work ends, and returns at once without
    /// waiting for it.
    ///
    /// # Errors
    /// Returns an error if the system cannot start another thread.
    pub fn watch<T: Send + 'static, B>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
        mut look: impl FnMut() -> ControlFlow<B>,
    ) -> std::io::Result<ControlFlow<B, T>> {
        let (running, ended) = channel::<()>();
        let thread = thread::Builder::new().stack_size(STACK).spawn(move || {
            // Dropped at the end, even if the work panics.
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

    /// Returns true if loading is to end.
    pub(crate) fn is_given_up(&self) -> bool {
        self.stop.is_raised()
    }

    /// Returns the request to end. Parts of a scene check it while they are assembled.
    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Returns the error of loading that was given up; otherwise `None`.
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
