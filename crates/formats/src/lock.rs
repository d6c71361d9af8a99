//! Files on which one process at a time works, over many replacements of the file.
//!
//! A file beside it is locked, since the file itself is replaced as a whole. The system frees the lock when its process ends,
//! however it ends. Whether locks hold between machines that share a folder is up to its file system: NFS (since version 4) and
//! Lustre mounted with `flock` have them, others keep them to one machine or have none.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::temporary::PREFIX;

/// Attempts to lock a file that others remove at the same time.
const ATTEMPTS: usize = 100;
/// Longest description of a process that is read, in bytes.
const LONGEST: u64 = 200;

/// The right to work on a file, until it is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Locked while it is open.
    _file: File,
}

/// Why a file is not locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process works on it: which one.
    #[error("{0} works on it")]
    Held(String),
    /// The file system has no locks, or does not say.
    #[error("it cannot be locked: {0}")]
    Unknown(#[from] io::Error),
}

impl Lock {
    /// Locks a file, which need not exist.
    ///
    /// # Errors
    ///
    /// Another process that works on it, and a file system without locks.
    pub fn take(path: &Path) -> Result<Self, LockError> {
        // One file may go by several names.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        let name = format!("{PREFIX}{}.lock", &blake3::hash(name).to_hex()[..16]);
        let path = path.with_file_name(name);
        for _ in 0..ATTEMPTS {
            let mut options = OpenOptions::new();
            let options = options.read(true).write(true).create(true).truncate(false);
            let mut file = options.open(&path)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(LockError::Held(holder(&mut file))),
                Err(TryLockError::Error(error)) => return Err(error.into()),
            }
            // Whoever had it before may have removed it since it was opened.
            if is_same(&file, &path) {
                // For whoever is refused; on a full disk they are not told.
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
        // If it stays, it is locked again.
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

/// Who has locked a file, as far as it says.
fn holder(file: &mut File) -> String {
    let mut text = String::new();
    let read = file
        .rewind()
        .and_then(|()| file.take(LONGEST).read_to_string(&mut text));
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
