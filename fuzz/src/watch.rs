//! Checks that an input does not panic, run for long, or take too much memory.

use crate::targets::Target;
use peak_alloc::PeakAlloc;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Memory in bytes that an input may take beyond ten times its size, including the tables of its
/// reader.
const EXTRA: usize = (64 << 20) + (4 << 20);
/// Longest time that an input may take, also on a busy machine.
const TIME_LIMIT: Duration = Duration::from_secs(30);

/// Tries an input. If it fails, keeps it and ends the program.
pub fn attempt(target: &Target, input: &[u8]) {
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let (done, waiting) = sync_channel::<()>(0);
    let ended = std::thread::scope(|scope| {
        // Wait for the input: nothing is sent, and the channel closes when the input has been
        // tried.
        scope.spawn(move || {
            if waiting.recv_timeout(TIME_LIMIT) == Err(RecvTimeoutError::Timeout) {
                give_up(target, input, &format!("took more than {TIME_LIMIT:?}"));
            }
        });
        let ended = catch_unwind(AssertUnwindSafe(|| (target.read)(input)));
        drop(done);
        ended
    });
    if ended.is_err() {
        give_up(target, input, "panicked");
    }
    let peak = ALLOCATOR.peak_usage().saturating_sub(before);
    if target.is_bounded && peak > 10 * input.len() + EXTRA {
        give_up(target, input, &format!("took {peak} bytes"));
    }
}

fn give_up(target: &Target, input: &[u8], why: &str) -> ! {
    let kept = keep(target, input);
    let place = kept.map_or_else(
        |e| format!("not kept: {e}"),
        |path| path.display().to_string(),
    );
    eprintln!(
        "{}: an input of {} bytes {why}: {place}",
        target.name,
        input.len()
    );
    std::process::exit(1)
}

fn keep(target: &Target, input: &[u8]) -> std::io::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/fuzz");
    std::fs::create_dir_all(&folder)?;
    let sum = input
        .iter()
        .fold(0u32, |h, b| h.wrapping_mul(16_777_619) ^ u32::from(*b));
    let path = folder.join(format!("{}-{sum:08x}", target.name));
    std::fs::write(&path, input)?;
    Ok(path)
}
