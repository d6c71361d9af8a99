//! Handling of Ctrl-C, of signals by which batch systems end processes, and of closed terminals.

use crate::command_error::CommandError;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Difference between the exit status of a process that a signal ended and the signal's number.
const STATUS: u8 = 128;

/// Turns SIGXFSZ into an error: a write beyond the limit on file sizes then fails with a message.
/// The signal would end the program without a message. (Rust's runtime ignores SIGPIPE, so a
/// closed pipe is an error already.)
pub fn survive_size_limits() -> Result<(), CommandError> {
    let failed = |e| CommandError::Runtime(format!("cannot listen for signals: {e}"));
    // The flag is never read: the write's error reports the limit.
    flag::register(SIGXFSZ, Arc::default()).map_err(failed)?;
    Ok(())
}

/// Record of requests to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Starts listening for signals. A second signal ends the program at once.
    pub fn watch() -> Result<Self, CommandError> {
        let interrupt = Interrupt::default();
        let listen = |signal| {
            let Interrupt {
                requested,
                signal: number,
            } = interrupt.clone();
            flag::register_conditional_shutdown(
                signal,
                i32::from(STATUS) + signal,
                requested.clone(),
            )?;
            flag::register_usize(signal, number, signal as usize)?;
            flag::register(signal, requested)
        };
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            let failed = |e| CommandError::Runtime(format!("cannot listen for Ctrl-C: {e}"));
            listen(signal).map_err(failed)?;
        }
        Ok(interrupt)
    }

    /// Returns true if a stop was requested.
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// Requests a stop, like a signal.
    pub fn request(&self) {
        self.requested.store(true, Ordering::Relaxed);
    }

    /// Returns true if a signal has arrived.
    pub fn is_signalled(&self) -> bool {
        self.signal.load(Ordering::Relaxed) != 0
    }

    /// Returns the exit status of a program that stopped on request: success unless a signal caused
    /// the stop.
    pub fn status(&self) -> ExitCode {
        match self.signal.load(Ordering::Relaxed) {
            0 => ExitCode::SUCCESS,
            signal => ExitCode::from(STATUS + u8::try_from(signal).unwrap_or(SIGINT as u8)),
        }
    }
}

/// Returns true if the process was started with a signal ignored, as by `nohup`. Only Linux reports
/// this. Elsewhere this returns true, so that the program does not listen and the system's default
/// action applies.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & (1 << (signal - 1)) != 0)
}
