//! Locks on files, over many replacements of the file.
//!
//! The lock is on a file beside the target, because the target is replaced as a whole. The system
//! frees the lock when the process ends for any reason. The file system determines whether locks
//! work between machines that share a folder. NFS (since version 4) and Lustre mounted with `flock`
//! have such locks; other file systems limit locks to one machine, or have none.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::temporary::PREFIX;

/// Number of attempts to lock a file that others remove at the same time.
const MAX_ATTEMPTS: usize = 100;
/// Maximum length of the description of a process, in bytes.
const MAX_DESCRIPTION_LENGTH: u64 = 200;

/// Exclusive right to work on a file, until it is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Lock file. It is locked while it is open.
    _file: File,
}

/// Reason why a file is not locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process works on the file; the text names it.
    #[error("{0} works on it")]
    Held(String),
    /// The file system has no locks, or their state is unknown.
    #[error("it cannot be locked: {0}")]
    Unknown(#[from] io::Error),
}

impl Lock {
    /// Locks a file, which need not exist.
    ///
    /// # Errors
    ///
    /// Another process that works on the file, and a file system without locks.
    pub fn take(path: &Path) -> Result<Self, LockError> {
        // Resolve the path: one file may have several names.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        let name = format!("{PREFIX}{}.lock", &blake3::hash(name).to_hex()[..16]);
        let path = path.with_file_name(name);
        for _ in 0..MAX_ATTEMPTS {
            let mut options = OpenOptions::new();
            let options = options.read(true).write(true).create(true).truncate(false);
            let mut file = options.open(&path)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(LockError::Held(holder(&mut file))),
                Err(TryLockError::Error(error)) => return Err(error.into()),
            }
            // Check the file: its previous holder may have removed it since it was opened.
            if is_same(&file, &path) {
                // Write a description for processes that are refused. Ignore failures, such as a
                // full disk.
                let _ = file
                    .set_len(0)
                    .and_then(|()| write!(file, "{}", this_process()));
                return Ok(Lock { path, _file: file });
            }
        }
        Err(io::Error::other("other processes keep locking it").into())
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Ignore failures: an existing lock file is locked again.
        let _ = fs::remove_file(&self.path);
    }
}

fn this_process() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    match host.trim() {
        "" => format!("process {}", std::process::id()),
        host => format!("process {} on {host}", std::process::id()),
    }
}

/// Returns the description of the process that locked a file.
fn holder(file: &mut File) -> String {
    let mut text = String::new();
    let read = file
        .rewind()
        .and_then(|()| file.take(MAX_DESCRIPTION_LENGTH).read_to_string(&mut text));
    match read {
        Ok(n) if n > 0 => text,
        _ => "another process".to_owned(),
    }
}

#[cfg(unix)]
fn is_same(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |m: fs::Metadata| (m.dev(), m.ino());
    let there = fs::metadata(path).map(number).ok();
    there.is_some() && file.metadata().map(number).ok() == there
}

#[cfg(not(unix))]
fn is_same(_: &File, path: &Path) -> bool {
    path.exists()
}
