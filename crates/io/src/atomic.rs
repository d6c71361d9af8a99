//! Writing a file completely or not at all.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{FileError, Problem};

/// Attempts to find a free temporary name.
const ATTEMPTS: usize = 100;

/// Writes a file: `write` fills a temporary file in the same folder, which takes the place of
/// `path` only once everything is on disk. After a failure the temporary is removed and whatever
/// was at `path` is still there. A symbolic link is followed.
///
/// ```no_run
/// use std::io::Write;
/// io::atomic::write("report.txt".as_ref(), |file| writeln!(file, "done"))?;
/// # Ok::<(), io::FileError>(())
/// ```
///
/// # Errors
///
/// [`Problem::Write`] with the system's reason (a missing or read-only folder, no space left, an
/// error from `write`), and [`Problem::NotAFile`] if `path` is a folder or a device.
pub fn write(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), FileError> {
    let target = target(path)?;
    let fail = |error| Problem::Write(error).at(path);
    let (temporary, file) = Temporary::create(&target).map_err(fail)?;
    let mut writer = BufWriter::new(file);
    write(&mut writer).map_err(fail)?;
    let file = writer.into_inner().map_err(|e| fail(e.into_error()))?;
    file.sync_all().map_err(fail)?;
    drop(file);
    temporary.rename(&target).map_err(fail)?;
    sync_folder(&target);
    Ok(())
}

/// Writes bytes; see [`write()`].
///
/// # Errors
///
/// As for [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write(path, |file| file.write_all(bytes))
}

/// Where the file really lies. Anything but a regular file must not be replaced: as root, renaming
/// over a device would succeed.
fn target(path: &Path) -> Result<PathBuf, FileError> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => Err(Problem::NotAFile.at(path)),
        Ok(_) => path.canonicalize().map_err(|e| Problem::Write(e).at(path)),
        Err(_) => Ok(path.to_owned()),
    }
}

/// A file that is removed unless it is renamed.
struct Temporary {
    path: PathBuf,
    keep: bool,
}

impl Temporary {
    fn create(target: &Path) -> io::Result<(Self, File)> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let name = target
            .file_name()
            .ok_or_else(|| io::Error::other("it names no file"))?;
        for _ in 0..ATTEMPTS {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let mut temporary = OsString::from(".");
            temporary.push(name);
            temporary.push(format!(".{}-{number}.part", std::process::id()));
            let path = target.with_file_name(temporary);
            let mut options = OpenOptions::new();
            // What was written may be looked at again before the file is whole.
            match options.read(true).write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Temporary { path, keep: false }, file)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("no free name for a temporary file"))
    }

    fn rename(mut self, target: &Path) -> io::Result<()> {
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

/// Makes the new name durable where the system can; the content is safe in any case.
fn sync_folder(target: &Path) {
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        let _ = folder.sync_all();
    }
}
