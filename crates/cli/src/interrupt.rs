//! Ctrl-C.

use crate::failure::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a program that was interrupted.
pub const STATUS: u8 = 130;

/// Whether the user has asked to stop. A second Ctrl-C ends the program at once.
pub fn watch() -> Result<Arc<AtomicBool>, Failure> {
    let asked = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&asked);
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(STATUS));
        }
    };
    let failed = |e| Failure::Runtime(format!("cannot listen for Ctrl-C: {e}"));
    ctrlc::set_handler(handler).map_err(failed)?;
    Ok(asked)
}
