//! Display of a render in progress on a page in the browser.

use crate::browser;
use crate::command_error::CommandError;
use crate::interrupt::Interrupt;
use crate::output::say;
use std::sync::Arc;
use std::time::Duration;
use transport::Film;
use view::{Item, Live, LiveProgress, Page, ViewOptions, ViewServer};

/// Time between two checks if the page is still open.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// A page that shows a render.
#[derive(Debug)]
pub struct Watched {
    live: Arc<Live>,
    interrupt: Interrupt,
    /// Server of the page, until this is dropped.
    _server: ViewServer,
}

impl Watched {
    /// Serves a page and prints its address; `is_opened` also opens it in a browser. The page's stop
    /// button triggers `interrupt`.
    pub fn open(
        name: String,
        is_opened: bool,
        interrupt: &Interrupt,
    ) -> Result<Self, CommandError> {
        let stop = interrupt.clone();
        let live = Arc::new(Live::new(move || stop.request()));
        let page = Page::new(vec![Item::live(name, live.clone())]);
        let failed = |e| CommandError::Runtime(format!("--view: cannot serve a page: {e}"));
        let server = ViewServer::start(page.into(), &ViewOptions::default()).map_err(failed)?;
        say(&server.address())?;
        if is_opened {
            browser::open(&server.address());
        }
        Ok(Watched {
            live,
            interrupt: interrupt.clone(),
            _server: server,
        })
    }

    /// Shows the progress of the render, and waits while the render is paused.
    pub fn update(&self, film: &Film, channels: &[String], progress: LiveProgress) {
        self.live.update(film, channels, progress);
        self.live.pause(|| self.interrupt.requested());
    }

    /// Shows the finished image until the page is closed or the user ends the program.
    pub fn finish(self, film: &Film, channels: &[String]) {
        self.live.finish(film, channels);
        while self.live.is_watched() && !self.interrupt.is_signalled() {
            std::thread::sleep(CHECK_INTERVAL);
        }
    }
}
