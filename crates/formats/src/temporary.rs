//! Temporary files beside their targets. The next process that writes in a folder removes the files
//! that killed processes left there.
//!
//! Several machines may share a folder, and locks need not work across machines. A file is removed
//! if no process holds its lock, and it was left by this machine since its last start. A file of
//! another machine is removed if nothing was written to it for a day.

use std::collections::HashSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// Prefix of names. It does not contain the target's name, which may be as long as names can be.
pub(crate) const PREFIX: &str = ".morgana-";
const SUFFIX: &str = ".tmp";
/// Number of attempts to find a free name.
const MAX_ATTEMPTS: usize = 100;
/// Age up to which a temporary file is never removed, because its process may not have locked it
/// yet.
const MIN_AGE: Duration = Duration::from_secs(60);
/// Age beyond which a temporary file is also removed if another machine created it, or if the
/// system supports no locks.
const MAX_AGE: Duration = Duration::from_secs(24 * 60 * 60);

/// File that is removed unless it is renamed. It is locked during writing.
pub(crate) struct Temporary {
    path: PathBuf,
    keep: bool,
}

impl Temporary {
    /// Creates a temporary file in the folder of `target`.
    pub(crate) fn create(target: &Path) -> io::Result<(Self, File)> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        if target.file_name().is_none() {
            return Err(io::Error::other("it names no file"));
        }
        collect(target);
        for _ in 0..MAX_ATTEMPTS {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let process = std::process::id();
            let name = format!("{PREFIX}{}-{process}-{number}{SUFFIX}", machine());
            let path = target.with_file_name(name);
            let mut options = OpenOptions::new();
            // Open for reading, too: the content may be read again before the file is complete.
            match options.read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Ignore failures: without locks, files that are left are removed later.
                    let _ = file.try_lock();
                    return Ok((Temporary { path, keep: false }, file));
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("no unused name for a temporary file"))
    }

    /// Moves the file to its target.
    pub(crate) fn rename(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.keep = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.keep {
            // Ignore failures: they cannot be reported, and the first error matters more.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Returns an identifier of this machine, until its next start; equal for all machines if the
/// system has none.
fn machine() -> &'static str {
    static MACHINE: OnceLock<String> = OnceLock::new();
    MACHINE.get_or_init(|| match fs::read("/proc/sys/kernel/random/boot_id") {
        Ok(id) => blake3::hash(&id).to_hex()[..8].to_owned(),
        Err(_) => UNKNOWN.to_owned(),
    })
}

const UNKNOWN: &str = "0";

/// Removes files that killed processes left beside `target`, once for each folder.
fn collect(target: &Path) {
    static DONE: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut done = DONE.lock().unwrap_or_else(PoisonError::into_inner);
    let is_new = done.get_or_insert_default().insert(folder.to_owned());
    drop(done);
    if is_new {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            if let Some(name) = name.to_str().filter(|name| name.starts_with(PREFIX))
                && is_abandoned(&entry.path(), name)
            {
                // Ignore failures: another process may have removed the file, or own it.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// Returns true if no process works on a file any more.
fn is_abandoned(path: &Path, name: &str) -> bool {
    let Some(ours) = name.strip_prefix(PREFIX).filter(|n| n.ends_with(SUFFIX)) else {
        return false;
    };
    let is_ours = machine() != UNKNOWN && ours.split('-').next() == Some(machine());
    let age = fs::symlink_metadata(path).ok().filter(|m| m.is_file());
    let age = age.and_then(|m| m.modified().ok()?.elapsed().ok());
    let Some(age) = age.filter(|age| *age > MIN_AGE && (is_ours || *age > MAX_AGE)) else {
        return false;
    };
    // Open for writing: some systems lock only such files.
    let Ok(file) = OpenOptions::new().read(true).write(true).open(path) else {
        return false;
    };
    match file.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => age > MAX_AGE,
    }
}
