//! Ctrl-C, and the signals by which batch systems ask processes to end, and terminals that are closed.

use crate::command_error::CommandError;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What a process that a signal has ended adds to the signal's number to give its exit status.
const STATUS: u8 = 128;

/// Lets a write beyond a limit on the size of files fail, with a message, where the signal would end the program without one. (A
/// pipe that nobody reads is an error to begin with: Rust's runtime ignores its signal.)
pub fn survive_size_limits() -> Result<(), CommandError> {
    let failed = |e| CommandError::Runtime(format!("cannot listen for signals: {e}"));
    // Nobody asks whether it has come: the error says so.
    flag::register(SIGXFSZ, Arc::default()).map_err(failed)?;
    Ok(())
}

/// Whether somebody has asked to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Listens from now on. A second signal ends the program at once.
    pub fn watch() -> Result<Self, CommandError> {
        let interrupt = Interrupt::default();
        let listen = |signal| {
            let Interrupt {
                asked,
                signal: number,
            } = interrupt.clone();
            flag::register_conditional_shutdown(signal, i32::from(STATUS) + signal, asked.clone())?;
            flag::register_usize(signal, number, signal as usize)?;
            flag::register(signal, asked)
        };
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            let failed = |e| CommandError::Runtime(format!("cannot listen for Ctrl-C: {e}"));
            listen(signal).map_err(failed)?;
        }
        Ok(interrupt)
    }

    /// Whether to stop.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Asks to stop, as a signal does.
    pub fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }

    /// Whether a signal has come.
    pub fn is_signalled(&self) -> bool {
        self.signal.load(Ordering::Relaxed) != 0
    }

    /// Exit status of a program that has stopped because it was asked to: success, if not by a signal.
    pub fn status(&self) -> ExitCode {
        match self.signal.load(Ordering::Relaxed) {
            0 => ExitCode::SUCCESS,
            signal => ExitCode::from(STATUS + u8::try_from(signal).unwrap_or(SIGINT as u8)),
        }
    }
}

/// Whether the process was started with a signal ignored, as by `nohup`. Only Linux tells; elsewhere the answer is yes, so that nobody
/// listens to the signal, and the system does with it what it does by default.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & (1 << (signal - 1)) != 0)
}
