//! A render that is watched in the browser.

use crate::command_error::CommandError;
use crate::interrupt::Interrupt;
use crate::output::say;
use std::sync::Arc;
use std::time::Duration;
use transport::Film;
use view::{Item, Live, LiveProgress, ViewOptions, ViewServer};

/// Time between two looks whether anybody still watches.
const LOOK: Duration = Duration::from_millis(100);

/// A page that shows a render.
#[derive(Debug)]
pub struct Watched {
    live: Arc<Live>,
    interrupt: Interrupt,
    /// Serves the page until this is dropped.
    _server: ViewServer,
}

impl Watched {
    /// Serves a page and says where; its button to stop asks `interrupt`.
    pub fn open(
        name: String,
        channels: Vec<String>,
        interrupt: &Interrupt,
    ) -> Result<Self, CommandError> {
        let stop = interrupt.clone();
        let live = Arc::new(Live::new(channels, move || stop.ask()));
        let items = vec![Item::live(name, live.clone())];
        let failed = |e| CommandError::Runtime(format!("--view: cannot serve a page: {e}"));
        let server = ViewServer::start(items, &ViewOptions::default()).map_err(failed)?;
        say(&server.address())?;
        Ok(Watched {
            live,
            interrupt: interrupt.clone(),
            _server: server,
        })
    }

    /// Shows how far the render has got, and waits while it is paused.
    pub fn update(&self, film: &Film, progress: LiveProgress) {
        self.live.update(film, progress);
        self.live.pause(|| self.interrupt.asked());
    }

    /// Shows the image that is done, as long as somebody watches or until the user asks to end.
    pub fn finish(self, film: &Film) {
        self.live.finish(film);
        while self.live.is_watched() && !self.interrupt.is_signalled() {
            std::thread::sleep(LOOK);
        }
    }
}
