//! Input files: regular files only, and no more memory than a file justifies or the user allows.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;
use std::time::SystemTime;

use crate::error::{FileError, Problem};

/// Amount of memory, in bytes, from which availability is checked before allocation.
const MIN_CHECKED_MEMORY: u64 = 256 << 20;

/// Beginning and maximum length, in bytes, of Git LFS pointers: specification version 1.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec";
const MAX_POINTER_LENGTH: u64 = 1024;

/// Limits of the memory for the contents of a file.
///
/// A compressed file, or a file whose header states sizes, may become far larger in memory. It may
/// take ten times its size plus 64 MiB, or up to `memory` bytes if that is more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Number of bytes of memory that any file may take, regardless of its size; by default
    /// [`Limits::DEFAULT`].
    pub memory: Option<u64>,
}

impl Limits {
    /// Default number of bytes that any file may take: 2 GiB.
    pub const DEFAULT: u64 = 2 << 30;
    /// Factor on the size of a file. Every file may take memory up to the product.
    const TIMES: u64 = 10;
    /// Number of bytes that a file may take in addition to [`TIMES`](Self::TIMES) its size: 64 MiB.
    const EXTRA: u64 = 64 << 20;

    /// Makes limits of `memory` bytes for files of any size.
    pub fn of(memory: u64) -> Self {
        Limits {
            memory: Some(memory),
        }
    }

    /// Returns the number of bytes that a file of `size` bytes may take.
    pub fn most(self, size: u64) -> u64 {
        let memory = self.memory.unwrap_or(Self::DEFAULT);
        memory.max(size.saturating_mul(Self::TIMES).saturating_add(Self::EXTRA))
    }

    /// Checks that a file of `size` bytes may take memory for `count` items of `each` bytes, and
    /// that the system has the memory.
    ///
    /// # Errors
    /// Too many bytes, for the file or for the system.
    pub fn check(self, count: u64, each: u64, size: u64) -> Result<(), Problem> {
        self.permit(count, each, size)
            .and_then(|()| available(count * each))
    }

    /// Checks that a file of `size` bytes may take memory for `count` items of `each` bytes.
    ///
    /// # Errors
    /// Too many bytes for the file.
    pub fn permit(self, count: u64, each: u64, size: u64) -> Result<(), Problem> {
        let most = self.most(size);
        match count.checked_mul(each) {
            Some(needed) if needed <= most => Ok(()),
            needed => {
                let [needed, most] = beyond(needed.unwrap_or(u64::MAX), most);
                Err(Problem::TooLarge(format!(
                    "it needs {needed} of memory, more than the limit of {most}: raise --memory"
                )))
            }
        }
    }
}

/// Memory for several arrays of one file, whose total stays within the limits of the file.
#[derive(Debug)]
pub struct Budget {
    limits: Limits,
    /// Size of the file, in bytes.
    size: u64,
    /// Number of bytes taken so far.
    taken: u64,
}

impl Budget {
    /// Makes a budget for the arrays of a file of `size` bytes.
    pub fn new(limits: Limits, size: u64) -> Self {
        Budget {
            limits,
            size,
            taken: 0,
        }
    }

    /// Reserves memory for `count` items of `each` bytes, or none if the sum exceeds the limit.
    ///
    /// # Errors
    /// Too many bytes for the file, or for the system.
    pub fn take(&mut self, count: u64, each: u64) -> Result<(), Problem> {
        let all = count.saturating_mul(each).saturating_add(self.taken);
        self.limits.check(all, 1, self.size)?;
        self.taken = all;
        Ok(())
    }
}

/// Checks that the system has the memory: a failed allocation later would end the program.
fn available(needed: u64) -> Result<(), Problem> {
    if needed < MIN_CHECKED_MEMORY {
        return Ok(());
    }
    let reserved = usize::try_from(needed).map(|n| Vec::<u8>::new().try_reserve_exact(n));
    match reserved {
        Ok(Ok(())) => Ok(()),
        _ => Err(Problem::TooLarge(format!(
            "it needs {} of memory, more than this system has",
            bytes(needed)
        ))),
    }
}

/// Formats a number of bytes with a binary prefix, as `--memory` takes it.
pub fn bytes(n: u64) -> String {
    const STEP: f64 = 1024.0;
    let mut value = n as f64;
    for unit in ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB"] {
        if value < STEP {
            return match unit {
                "bytes" => format!("{n} bytes"),
                _ => format!("{value:.1} {unit}"),
            };
        }
        value /= STEP;
    }
    format!("{value:.1} EiB")
}

/// Formats a needed and an allowed amount of memory: to the byte if they would be equal in larger
/// units.
pub fn beyond(needed: u64, most: u64) -> [String; 2] {
    let rounded = [needed, most].map(bytes);
    if rounded[0] == rounded[1] {
        [needed, most].map(|n| format!("{n} bytes"))
    } else {
        rounded
    }
}

/// Time of the last write of a file, and its size. A file with another stamp has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp {
    modified: SystemTime,
    size: u64,
}

impl FileStamp {
    /// Returns the current stamp of a file; `None` if it does not exist, or the system does not
    /// state the time.
    pub fn of(path: &Path) -> Option<Self> {
        let about = fs::metadata(path).ok()?;
        Some(FileStamp {
            modified: about.modified().ok()?,
            size: about.len(),
        })
    }
}

/// Opens a regular file, and returns its size in bytes. Other objects might be infinite, and a pipe
/// might block.
///
/// # Errors
///
/// A file that cannot be opened, a folder, a pipe, a socket, a device, and a Git LFS pointer
/// instead of a file.
pub fn open(path: &Path) -> Result<(BufReader<File>, u64), FileError> {
    let open = || {
        let metadata = fs::metadata(path).map_err(Problem::Read)?;
        if !metadata.is_file() {
            return Err(Problem::NotRegular(kind(&metadata.file_type())));
        }
        let mut file = File::open(path).map_err(Problem::Read)?;
        let size = file.metadata().map_err(Problem::Read)?.len();
        if size <= MAX_POINTER_LENGTH && is_pointer(&mut file).map_err(Problem::Read)? {
            return Err(Problem::LfsPointer);
        }
        Ok((BufReader::new(file), size))
    };
    open().map_err(|problem| problem.at(path))
}

/// Returns true if a file begins like a Git LFS pointer. Rewinds the file afterwards.
fn is_pointer(file: &mut File) -> io::Result<bool> {
    let mut start = Vec::with_capacity(POINTER.len());
    file.by_ref()
        .take(POINTER.len() as u64)
        .read_to_end(&mut start)?;
    file.rewind()?;
    Ok(start == POINTER)
}

/// Reads the bytes of a regular file: the number that it has when opened, even if it grows.
///
/// # Errors
///
/// As for [`open`].
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let (file, size) = open(path)?;
    available(size).map_err(|problem| problem.at(path))?;
    let mut bytes = Vec::with_capacity(size as usize);
    // Read from the file directly: a buffer would be useless.
    let read = file.into_inner().take(size).read_to_end(&mut bytes);
    read.map_err(|e| Problem::Read(e).at(path))?;
    Ok(bytes)
}

/// Names the kind of an object that is not a regular file.
#[cfg(unix)]
fn kind(kind: &fs::FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match () {
        () if kind.is_dir() => "a folder",
        () if kind.is_fifo() => "a pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

/// Names the kind of an object that is not a regular file.
#[cfg(not(unix))]
fn kind(kind: &fs::FileType) -> &'static str {
    if kind.is_dir() {
        "a folder"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_files_may_become_what_the_user_allows_and_large_ones_ten_times_their_size() {
        assert_eq!(Limits::default().most(100), 2 << 30);
        assert_eq!(Limits::of(0).most(100), 1000 + (64 << 20));
        assert_eq!(Limits::of(1 << 20).most(1 << 30), (10 << 30) + (64 << 20));
        assert!(Limits::of(1 << 30).check(1 << 28, 4, 100).is_ok());
        let error = |count| Limits::of(1 << 30).check(count, 4, 100).unwrap_err();
        let text =
            "too large: it needs 1.5 GiB of memory, more than the limit of 1.0 GiB: raise --memory";
        assert_eq!(error(3 << 27).to_string(), text);
        let text = "too large: it needs 1073741828 bytes of memory, more than the limit of 1073741824 bytes: raise \
                    --memory";
        assert_eq!(error((1 << 28) + 1).to_string(), text);
        assert_eq!(
            [0, 1023, 1024, 3 << 19].map(bytes),
            ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 MiB"]
        );
        assert!(Limits::default().check(u64::MAX, 2, 100).is_err());
    }
}
