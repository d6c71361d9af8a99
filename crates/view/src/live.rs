//! Live pictures of a render: the render stores pictures here, and pages read them and send
//! commands.
//!
//! The render never waits for a page, unless a page has paused the render. It makes a picture only
//! if a page has requested one since the last. Pictures take at most 1/250 of the time.

use crate::picture::Picture;
use serde_json::{Value, json};
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use transport::Film;

/// Minimum time between two pictures. `MIN_INTERVAL_RATIO` is the minimum as a multiple of the time
/// that a picture takes.
const MIN_INTERVAL: Duration = Duration::from_secs(1);
const MIN_INTERVAL_RATIO: u32 = 250;
/// Time since the last request after which a page counts as closed. Browsers let background pages
/// send requests once a minute.
const CLOSED_TIMEOUT: Duration = Duration::from_secs(90);
/// Time between two checks while the render is paused.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

/// Render that pages watch.
pub struct Live {
    /// Function that ends the render.
    stop: Box<dyn Fn() + Send + Sync>,
    state: Mutex<State>,
    /// True if a page requests a new picture.
    is_wanted: AtomicBool,
    is_stop_requested: AtomicBool,
    is_paused: AtomicBool,
}

#[derive(Debug)]
struct State {
    picture: Option<Arc<Picture>>,
    /// Number of pictures so far.
    version: u64,
    progress: LiveProgress,
    mean: f64,
    error: f64,
    started: Instant,
    /// Time of the end of the render.
    ended: Option<Instant>,
    /// Time from which the next picture may be made.
    next: Instant,
    /// Time of the last request of a page.
    last_request: Option<Instant>,
}

/// Progress of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LiveProgress {
    /// Samples per pixel so far.
    pub done: f64,
    /// Requested samples per pixel, if there is a limit.
    pub total: Option<f64>,
    /// Run time at which the render ends, if there is a limit.
    pub time: Option<Duration>,
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Live")
            .field("is_paused", &self.is_paused)
            .finish_non_exhaustive()
    }
}

impl Live {
    /// Makes the state of a render before its first sample; `stop` requests its end.
    pub fn new(stop: impl Fn() + Send + Sync + 'static) -> Self {
        let now = Instant::now();
        Live {
            stop: Box::new(stop),
            state: Mutex::new(State {
                picture: None,
                version: 0,
                progress: LiveProgress::default(),
                mean: f64::NAN,
                error: f64::NAN,
                started: now,
                ended: None,
                next: now,
                last_request: None,
            }),
            is_wanted: AtomicBool::new(true),
            is_stop_requested: AtomicBool::new(false),
            is_paused: AtomicBool::new(false),
        }
    }

    /// Records the progress of the render, and makes a picture of its film with these channels,
    /// unless no page requests one or the last is too recent.
    pub fn update(&self, film: &Film, channels: &[String], progress: LiveProgress) {
        let now = Instant::now();
        {
            let mut state = self.state();
            state.progress = progress;
            if now < state.next || !self.is_wanted.swap(false, Ordering::AcqRel) {
                return;
            }
        }
        // Release the lock first, so that pages get responses while the picture is made.
        self.show(film, channels);
        self.state().next = now + MIN_INTERVAL.max(MIN_INTERVAL_RATIO * now.elapsed());
    }

    /// Makes the picture of a finished render's film.
    pub fn finish(&self, film: &Film, channels: &[String]) {
        self.show(film, channels);
        self.state().ended = Some(Instant::now());
    }

    fn show(&self, film: &Film, channels: &[String]) {
        let picture = Arc::new(Picture::of_film(film, channels));
        let (mean, error) = film.summary();
        let mut state = self.state();
        state.picture = Some(picture);
        state.version += 1;
        (state.mean, state.error) = (mean, error);
    }

    /// Returns true if a page has requested the end of the render.
    pub(crate) fn is_stop_requested(&self) -> bool {
        self.is_stop_requested.load(Ordering::Acquire)
    }

    /// Waits while a page pauses the render, until the page closes or `is_over` returns true.
    pub fn pause(&self, is_over: impl Fn() -> bool) {
        while self.is_paused.load(Ordering::Acquire) && !self.is_stop_requested() && !is_over() {
            if !self.is_watched() {
                self.is_paused.store(false, Ordering::Release);
            }
            std::thread::sleep(CHECK_INTERVAL);
        }
    }

    /// Returns true if a page is open, or was open recently.
    pub fn is_watched(&self) -> bool {
        let last_request = self.state().last_request;
        last_request.is_some_and(|last_request| last_request.elapsed() < CLOSED_TIMEOUT)
    }

    /// Executes a command of a page; returns `false` if there is no such command.
    pub(crate) fn command(&self, name: &str) -> bool {
        match name {
            "stop" => {
                self.is_stop_requested.store(true, Ordering::Release);
                (self.stop)();
            }
            "pause" => self.is_paused.store(true, Ordering::Release),
            "continue" => self.is_paused.store(false, Ordering::Release),
            _ => return false,
        }
        true
    }

    /// Returns the latest picture.
    pub(crate) fn picture(&self) -> Option<Arc<Picture>> {
        self.state().picture.clone()
    }

    /// Returns the progress of the render for a page, and notes that the page requests a new
    /// picture.
    pub(crate) fn status(&self) -> Value {
        let mut state = self.state();
        state.last_request = Some(Instant::now());
        self.is_wanted.store(true, Ordering::Release);
        let ended = state.ended.unwrap_or_else(Instant::now);
        let elapsed = ended.duration_since(state.started).as_secs_f64();
        let fraction = state.progress.fraction(elapsed);
        let left = (fraction > 0.0 && state.ended.is_none())
            .then(|| elapsed * (1.0 - fraction) / fraction);
        json!({
            "version": state.version,
            "done": state.progress.done,
            "total": state.progress.total,
            "fraction": if state.ended.is_some() { 1.0 } else { fraction },
            "elapsed": elapsed,
            "left": left,
            "mean": state.mean,
            "error": state.error,
            "ended": state.ended.is_some(),
            "paused": self.is_paused.load(Ordering::Acquire),
            "stopping": self.is_stop_requested(),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LiveProgress {
    /// Returns the completed fraction of the samples or of the time, whichever is larger.
    fn fraction(&self, elapsed: f64) -> f64 {
        let work = self.total.map_or(0.0, |total| self.done / total);
        let time = self.time.map_or(0.0, |time| elapsed / time.as_secs_f64());
        work.max(time).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(value: f32) -> Film {
        let mut film = Film::new(2, 1, 1);
        for pixel in 0..2 {
            for _ in 0..2 {
                film.add(0, pixel, transport::Spectrum::splat(f64::from(value)));
            }
        }
        film
    }

    #[test]
    fn pictures_are_made_when_somebody_looks() {
        let live = Live::new(|| {});
        let channels = ["Y".to_owned()];
        let progress = LiveProgress {
            done: 1.0,
            total: Some(4.0),
            time: None,
        };
        live.update(&film(1.0), &channels, progress);
        assert_eq!(live.picture().unwrap().plane("", "Y").unwrap()[0], 1.0);
        std::thread::sleep(MIN_INTERVAL);
        // Expect no new picture: no page has requested one.
        live.update(&film(2.0), &channels, progress);
        assert_eq!(live.picture().unwrap().plane("", "Y").unwrap()[0], 1.0);
        let status = live.status();
        assert_eq!(
            (&status["version"], &status["fraction"]),
            (&json!(1), &json!(0.25))
        );
        live.update(&film(3.0), &channels, progress);
        assert_eq!(live.picture().unwrap().plane("", "Y").unwrap()[1], 3.0);
        // Expect no new picture so soon, but one at the end.
        live.status();
        live.update(&film(4.0), &channels, progress);
        assert_eq!(live.status()["version"], 2);
        live.finish(&film(5.0), &channels);
        assert_eq!(live.picture().unwrap().plane("", "Y").unwrap()[1], 5.0);
        assert_eq!(live.status()["ended"], true);
    }

    #[test]
    fn a_pause_ends_when_the_page_goes_on_or_is_gone() {
        let live = Live::new(|| {});
        live.pause(|| false);
        assert!(live.command("pause") && !live.command("shout"));
        // Return at once: no page has ever sent a request.
        live.pause(|| false);
        assert_eq!(live.status()["paused"], false);
        live.command("pause");
        live.pause(|| true);
        let start = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| live.pause(|| false));
            std::thread::sleep(2 * CHECK_INTERVAL);
            live.command("continue");
        });
        assert!(start.elapsed() >= 2 * CHECK_INTERVAL);
        live.command("stop");
        assert!(live.is_stop_requested());
    }
}
