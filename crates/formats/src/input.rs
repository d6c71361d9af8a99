//! Data files as they are read: regular files only, and no more memory than a file justifies or the user allows.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;
use std::time::SystemTime;

use crate::error::{FileError, Problem};

/// Memory that is asked for before it is taken, in bytes.
const LARGE: u64 = 256 << 20;

/// How pointers of Git LFS begin, and the longest one, in bytes: its specification, version 1.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec";
const LONGEST_POINTER: u64 = 1024;

/// How much memory the contents of a file may take.
///
/// A compressed file, or one whose header states sizes, may become far larger than it is. Without more ado it may take ten
/// times its size and 64 MiB; more if what it states is within `memory`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that any file may take, however small it is; [`Limits::DEFAULT`] if none are given.
    pub memory: Option<u64>,
}

impl Limits {
    /// Bytes that any file may take unless the user says otherwise: 2 GiB.
    pub const DEFAULT: u64 = 2 << 30;
    /// How often its own size a file may take in any case.
    const TIMES: u64 = 10;
    /// What it may take beyond that, in bytes: 64 MiB.
    const EXTRA: u64 = 64 << 20;

    /// These many bytes, beyond what files of any size may take.
    pub fn of(memory: u64) -> Self {
        Limits {
            memory: Some(memory),
        }
    }

    /// Bytes that a file of `size` bytes may take.
    pub fn most(self, size: u64) -> u64 {
        let memory = self.memory.unwrap_or(Self::DEFAULT);
        memory.max(size.saturating_mul(Self::TIMES).saturating_add(Self::EXTRA))
    }

    /// Refuses contents of `count` things of `each` bytes that a file of `size` bytes must not take, or that the system has no
    /// memory for.
    ///
    /// # Errors
    /// Too many bytes, for the file or for the system.
    pub fn check(self, count: u64, each: u64, size: u64) -> Result<(), Problem> {
        self.permit(count, each, size)
            .and_then(|()| available(count * each))
    }

    /// Refuses contents of `count` things of `each` bytes that a file of `size` bytes must not take.
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
                    "it takes {needed} of memory once it is read, more than the limit of {most} (--memory)"
                )))
            }
        }
    }
}

/// Memory for several arrays of one file, which together stay within its limits.
#[derive(Debug)]
pub struct Budget {
    limits: Limits,
    /// Bytes of the file.
    size: u64,
    /// Bytes that have been taken.
    taken: u64,
}

impl Budget {
    /// For the arrays of a file of `size` bytes.
    pub fn new(limits: Limits, size: u64) -> Self {
        Budget {
            limits,
            size,
            taken: 0,
        }
    }

    /// Takes memory for `count` things of `each` bytes, or none if that is too much.
    ///
    /// # Errors
    /// The system has no memory for them.
    pub fn take(&mut self, count: u64, each: u64) -> Result<(), Problem> {
        let all = count.saturating_mul(each).saturating_add(self.taken);
        self.limits.check(all, 1, self.size)?;
        self.taken = all;
        Ok(())
    }
}

/// Refuses more memory than the system hands out, which would end the program later.
fn available(needed: u64) -> Result<(), Problem> {
    if needed < LARGE {
        return Ok(());
    }
    let reserved = usize::try_from(needed).map(|n| Vec::<u8>::new().try_reserve_exact(n));
    match reserved {
        Ok(Ok(())) => Ok(()),
        _ => Err(Problem::TooLarge(format!(
            "it takes {} of memory once it is read, which this system does not have",
            bytes(needed)
        ))),
    }
}

/// A number of bytes with a binary prefix, as `--memory` takes it.
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

/// Texts of a needed and of an allowed amount of memory: to the byte if they would read alike in larger units.
pub fn beyond(needed: u64, most: u64) -> [String; 2] {
    let rounded = [needed, most].map(bytes);
    if rounded[0] == rounded[1] {
        [needed, most].map(|n| format!("{n} bytes"))
    } else {
        rounded
    }
}

/// When a file was last written, and its size: a file with another stamp has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp {
    modified: SystemTime,
    size: u64,
}

impl FileStamp {
    /// That of a file as it is now; none if it is gone, or the system does not say when it was written.
    pub fn of(path: &Path) -> Option<Self> {
        let about = fs::metadata(path).ok()?;
        Some(FileStamp {
            modified: about.modified().ok()?,
            size: about.len(),
        })
    }
}

/// Opens a regular file; also returns its size in bytes. Anything else might have no end, and a pipe might never begin.
///
/// # Errors
///
/// A file that cannot be opened, a folder, a pipe, a socket and a device, and a pointer of Git LFS in place of a file.
pub fn open(path: &Path) -> Result<(BufReader<File>, u64), FileError> {
    let open = || {
        let metadata = fs::metadata(path).map_err(Problem::Read)?;
        if !metadata.is_file() {
            return Err(Problem::NotRegular(kind(&metadata.file_type())));
        }
        let mut file = File::open(path).map_err(Problem::Read)?;
        let size = file.metadata().map_err(Problem::Read)?.len();
        if size <= LONGEST_POINTER && is_pointer(&mut file).map_err(Problem::Read)? {
            return Err(Problem::LfsPointer);
        }
        Ok((BufReader::new(file), size))
    };
    open().map_err(|problem| problem.at(path))
}

/// Whether a file begins as pointers of Git LFS do. It is read from the start again afterwards.
fn is_pointer(file: &mut File) -> io::Result<bool> {
    let mut start = Vec::with_capacity(POINTER.len());
    file.by_ref()
        .take(POINTER.len() as u64)
        .read_to_end(&mut start)?;
    file.rewind()?;
    Ok(start == POINTER)
}

/// The bytes of a regular file: as many as it has when it is opened, even if it grows.
///
/// # Errors
///
/// As for [`open`].
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let (file, size) = open(path)?;
    available(size).map_err(|problem| problem.at(path))?;
    let mut bytes = Vec::with_capacity(size as usize);
    // Straight from the file: a buffer of its own has no use here.
    let read = file.into_inner().take(size).read_to_end(&mut bytes);
    read.map_err(|e| Problem::Read(e).at(path))?;
    Ok(bytes)
}

/// What something is that is no regular file.
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

/// What something is that is no regular file.
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
        let text = "too large: it takes 1.5 GiB of memory once it is read, more than the limit of 1.0 GiB (--memory)";
        assert_eq!(error(3 << 27).to_string(), text);
        let text = "too large: it takes 1073741828 bytes of memory once it is read, more than the limit of 1073741824 bytes \
                    (--memory)";
        assert_eq!(error((1 << 28) + 1).to_string(), text);
        assert_eq!(
            [0, 1023, 1024, 3 << 19].map(bytes),
            ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 MiB"]
        );
        assert!(Limits::default().check(u64::MAX, 2, 100).is_err());
    }
}
