//! Temporary files beside those that they become. Those that a killed process has left are removed by the next that writes in
//! the same folder.
//!
//! Several machines may share a folder, and locks need not reach from one to another. A file is removed if nobody holds its
//! lock and it was left by this machine, since it was last started; or, from elsewhere, if nothing was written to it for a day.

use std::collections::HashSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// How names begin; the name of what a file becomes may be as long as names can be.
pub(crate) const PREFIX: &str = ".morgana-";
const SUFFIX: &str = ".tmp";
/// Attempts to find a free name.
const ATTEMPTS: usize = 100;
/// A file this old has been locked by the process that made it, if that is alive.
const YOUNG: Duration = Duration::from_secs(60);
/// Nobody writes for so long without a byte.
const OLD: Duration = Duration::from_secs(24 * 60 * 60);

/// A file that is removed unless it is renamed. It is locked while it is written.
pub(crate) struct Temporary {
    path: PathBuf,
    keep: bool,
}

impl Temporary {
    /// Creates one in the folder of `target`.
    pub(crate) fn create(target: &Path) -> io::Result<(Self, File)> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        if target.file_name().is_none() {
            return Err(io::Error::other("it names no file"));
        }
        collect(target);
        for _ in 0..ATTEMPTS {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let process = std::process::id();
            let name = format!("{PREFIX}{}-{process}-{number}{SUFFIX}", machine());
            let path = target.with_file_name(name);
            let mut options = OpenOptions::new();
            // What was written may be looked at again before the file is whole.
            match options.read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Without locks, files that are left are removed later.
                    let _ = file.try_lock();
                    return Ok((Temporary { path, keep: false }, file));
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("no unused name for a temporary file"))
    }

    /// Puts it in the place of a file.
    pub(crate) fn rename(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.keep = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.keep {
            // There is nobody left to tell if this fails, and the first error matters more.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// What tells this machine from others, until it is started anew; the same for all if the system does not say.
fn machine() -> &'static str {
    static MACHINE: OnceLock<String> = OnceLock::new();
    MACHINE.get_or_init(|| match fs::read("/proc/sys/kernel/random/boot_id") {
        Ok(id) => blake3::hash(&id).to_hex()[..8].to_owned(),
        Err(_) => UNKNOWN.to_owned(),
    })
}

const UNKNOWN: &str = "0";

/// Removes what killed processes have left beside `target`, once for each folder.
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
                && is_left(&entry.path(), name)
            {
                // Somebody else may have been faster, or may have the right to do so.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// Whether nobody works on a file any more.
fn is_left(path: &Path, name: &str) -> bool {
    let Some(ours) = name.strip_prefix(PREFIX).filter(|n| n.ends_with(SUFFIX)) else {
        return false;
    };
    let is_ours = machine() != UNKNOWN && ours.split('-').next() == Some(machine());
    let age = fs::symlink_metadata(path).ok().filter(|m| m.is_file());
    let age = age.and_then(|m| m.modified().ok()?.elapsed().ok());
    let Some(age) = age.filter(|age| *age > YOUNG && (is_ours || *age > OLD)) else {
        return false;
    };
    // Some systems lock only what may be written to.
    let Ok(file) = OpenOptions::new().read(true).write(true).open(path) else {
        return false;
    };
    match file.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => age > OLD,
    }
}
