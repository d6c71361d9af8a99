//! Atomic writing of files: completely or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{FileError, Problem};
use crate::temporary::Temporary;

/// Maximum length of a chain of symbolic links, as on Linux.
const MAX_LINKS: usize = 40;

/// Writes a file atomically.
///
/// `write` fills a temporary file in the same folder. The temporary file replaces `path` after all
/// data is on disk. After a failure, the temporary file is removed, and the old file at `path`
/// remains. A later process removes the temporary files of killed processes. Symbolic links are
/// followed, also to files that do not exist yet. The new file has the permissions of the replaced
/// file.
///
/// ```no_run
/// use std::io::Write;
/// morgana_formats::atomic::write("report.txt".as_ref(), |file| writeln!(file, "done"))?;
/// # Ok::<(), morgana_formats::FileError>(())
/// ```
///
/// # Errors
///
/// Returns [`Problem::Write`] with the system's reason: a missing or read-only folder, no space
/// left, or an error from `write`. Returns [`Problem::NotAFile`] if `path` is a folder or a device.
pub fn write(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), FileError> {
    let target = target(path)?;
    let fail = |error| Problem::Write(error).at(path);
    let (temporary, file) = Temporary::create(&target).map_err(fail)?;
    if let Ok(replaced) = fs::metadata(&target) {
        // Set permissions before the file has content that others may not read. Ignore failures:
        // some file systems have no permissions.
        let _ = file.set_permissions(replaced.permissions());
    }
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
/// Fails like [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write(path, |file| file.write_all(bytes))
}

/// Resolves the path of a file. Other objects than regular files must not be replaced: as root,
/// renaming over a device would succeed.
fn target(path: &Path) -> Result<PathBuf, FileError> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => Err(Problem::NotAFile.at(path)),
        Ok(_) => path.canonicalize().map_err(|e| Problem::Write(e).at(path)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(end_of_links(path)),
        // Report other failures, such as a name that is too long.
        Err(e) => Err(Problem::Write(e).at(path)),
    }
}

/// Returns the end of a chain of symbolic links, at which no file exists.
fn end_of_links(path: &Path) -> PathBuf {
    let mut place = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&place) {
            Ok(next) => place = place.with_file_name("").join(next),
            Err(_) => break,
        }
    }
    place
}

/// Tries whether a file can be placed at `path`, so that a failure is known before hours of work.
///
/// # Errors
///
/// Fails like [`write()`].
pub fn probe(path: &Path) -> Result<(), FileError> {
    let target = target(path)?;
    let created = Temporary::create(&target).map(drop);
    created.map_err(|e| Problem::Write(e).at(path))
}

/// Writes the folder's entry for the new name to disk if the system supports it. The content of the
/// file is on disk already.
fn sync_folder(target: &Path) {
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        let _ = folder.sync_all();
    }
}
