//! Progress bar of a render, with checks of the time limit and of Ctrl-C.

use crate::interrupt::Interrupt;
use crate::numbers;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::Scope;
use std::time::{Duration, Instant};
use transport::render::Handle;

/// Time between two checks.
const INTERVAL: Duration = Duration::from_millis(100);
/// Number of steps of the progress bar.
const STEPS: u64 = 1000;

/// Goal of a render.
#[derive(Clone, Copy, Debug)]
pub struct ProgressGoal {
    /// Number of samples in one sample per pixel: pixels times channel groups.
    pub samples_per_spp: u64,
    /// Requested samples per pixel, if limited.
    pub spp: Option<u64>,
    /// Samples per pixel that exist already.
    pub before: u64,
    /// Name of the unit of these numbers.
    pub unit: &'static str,
    /// Time limit, if there is one.
    pub time: Option<Duration>,
}

/// Guard of the thread that [`watch`] starts; dropping the guard ends the thread.
#[derive(Debug)]
pub struct Watch {
    // Dropping the sender ends the thread, even if the render panics.
    _running: Mutex<Sender<()>>,
}

/// Starts a thread that ends the render of a handle at the time limit, or when the user interrupts
/// it. If `draws` is true and the standard error is a terminal, the thread shows progress there.
pub fn watch<'scope>(
    scope: &'scope Scope<'scope, '_>,
    goal: ProgressGoal,
    draws: bool,
    handle: &'scope Handle,
    stopping: &'scope Interrupt,
) -> Watch {
    let (running, stopped) = channel();
    scope.spawn(move || run(goal, draws, handle, stopping, &stopped));
    Watch {
        _running: Mutex::new(running),
    }
}

fn run(
    goal: ProgressGoal,
    draws: bool,
    handle: &Handle,
    stopping: &Interrupt,
    stopped: &Receiver<()>,
) {
    let target = if draws {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(STEPS), target);
    if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/238} {msg}") {
        bar.set_style(style.progress_chars("━╸─"));
    }
    let started = Instant::now();
    while stopped.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
        if stopping.requested() || goal.time.is_some_and(|t| started.elapsed() >= t) {
            handle.request_end();
        }
        let samples = handle.samples();
        let fraction = goal.fraction(samples, started.elapsed());
        bar.set_position((fraction * STEPS as f64) as u64);
        let message = goal.message(samples, started.elapsed());
        bar.set_message(if stopping.requested() {
            format!("{message} · stopping (Ctrl-C again quits at once)")
        } else {
            message
        });
    }
    bar.finish_and_clear();
}

impl ProgressGoal {
    /// Returns the completed fraction of the work, or of the time.
    fn fraction(&self, samples: u64, elapsed: Duration) -> f64 {
        let work = self.spp.map_or(0.0, |spp| self.done(samples) / spp as f64);
        let time = self
            .time
            .map_or(0.0, |t| elapsed.as_secs_f64() / t.as_secs_f64());
        work.max(time).min(1.0)
    }

    /// Returns the samples per pixel, including `samples` new samples.
    fn done(&self, samples: u64) -> f64 {
        self.before as f64 + samples as f64 / self.samples_per_spp as f64
    }

    /// Describes the progress. The rate is the average since the start: a shorter average would
    /// flicker.
    fn message(&self, samples: u64, elapsed: Duration) -> String {
        let seconds = elapsed.as_secs_f64();
        let fraction = self.fraction(samples, elapsed);
        let done = self.done(samples);
        let start = self.fraction(0, Duration::ZERO);
        let spp = match self.spp {
            Some(total) => format!("{done:.0}/{total} {}", self.unit),
            None => format!("{done:.0} {}", self.unit),
        };
        let rate = numbers::count(samples as f64 / seconds.max(1e-9));
        let left = if fraction > start {
            clock(seconds * (1.0 - fraction) / (fraction - start))
        } else {
            "?".into()
        };
        let percent = 100.0 * fraction;
        format!("{percent:3.0}% · {spp} · {rate} samples/s · {left} left")
    }
}

/// Formats seconds like a clock.
fn clock(seconds: f64) -> String {
    let s = seconds.round() as u64;
    match s {
        0..3600 => format!("{}:{:02}", s / 60, s % 60),
        _ => format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOAL: ProgressGoal = ProgressGoal {
        samples_per_spp: 100,
        spp: Some(10),
        before: 0,
        unit: "spp",
        time: None,
    };

    #[test]
    fn time_left_follows_from_the_share_that_is_done() {
        let text = GOAL.message(250, Duration::from_secs(30));
        assert_eq!(text, " 25% · 2/10 spp · 8 samples/s · 1:30 left");
        assert!(GOAL.message(0, Duration::ZERO).ends_with("? left"));
    }

    #[test]
    fn what_was_there_before_took_no_time() {
        let goal = ProgressGoal { before: 5, ..GOAL };
        let text = goal.message(250, Duration::from_secs(30));
        assert_eq!(text, " 75% · 8/10 spp · 8 samples/s · 0:30 left");
    }

    #[test]
    fn whichever_limit_is_nearer_counts() {
        let goal = ProgressGoal {
            time: Some(Duration::from_secs(40)),
            ..GOAL
        };
        assert_eq!(goal.fraction(250, Duration::from_secs(30)), 0.75);
        assert_eq!(goal.fraction(990, Duration::from_secs(30)), 0.99);
    }
}
