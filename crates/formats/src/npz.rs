//! NPZ: ZIP archives of NumPy arrays, written without compression.
//! <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::atomic;
use crate::error::{FileError, Problem};

/// Size of members, in bytes, from which they need the 64-bit extension, which must be announced.
const MIN_ZIP64_SIZE: usize = 1 << 30;

/// Archive during writing.
pub struct Npz<'a>(ZipWriter<OneError<&'a mut BufWriter<File>>>);

/// Writes an archive with the members that `fill` adds.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write(path: &Path, fill: impl FnOnce(&mut Npz) -> io::Result<()>) -> Result<(), FileError> {
    atomic::write(path, |file| {
        let mut archive = Npz(ZipWriter::new(OneError::new(file)));
        fill(&mut archive)?;
        archive.0.finish().map_err(plain)?;
        Ok(())
    })
}

impl Npz<'_> {
    /// Starts the archive member `name`.npy with `bytes` bytes of data. Its time stamp is the
    /// earliest one: equal arrays give equal files.
    ///
    /// # Errors
    /// The archive cannot be written.
    pub fn member(&mut self, name: &str, bytes: usize) -> io::Result<&mut impl Write> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(bytes >= MIN_ZIP64_SIZE);
        (self.0.start_file(format!("{name}.npy"), options)).map_err(plain)?;
        Ok(&mut self.0)
    }
}

/// Reads a member of an archive by `read`, and then its remaining bytes, because the checksum is
/// compared at the end of the member.
///
/// # Errors
/// Errors of `read`, and a wrong checksum.
pub fn checked<R: Read, T>(
    mut member: R,
    read: impl FnOnce(&mut R) -> Result<T, Problem>,
) -> Result<T, Problem> {
    let found = read(&mut member)?;
    io::copy(&mut member, &mut io::sink()).map_err(Problem::Read)?;
    Ok(found)
}

fn plain(error: ZipError) -> io::Error {
    match error {
        ZipError::Io(error) => error,
        error => error.into(),
    }
}

/// File that reports only its first error. An aborted archive still tries to write its directory,
/// and would print a second error.
struct OneError<W> {
    file: W,
    /// Position in the file; after an error, the position without it.
    position: u64,
    failed: bool,
}

impl<W> OneError<W> {
    fn new(file: W) -> Self {
        OneError {
            file,
            position: 0,
            failed: false,
        }
    }

    fn first<T>(&mut self, later: T, act: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        if self.failed {
            return Ok(later);
        }
        let done = act(&mut self.file);
        self.failed = (done.as_ref()).is_err_and(|e| e.kind() != io::ErrorKind::Interrupted);
        done
    }
}

impl<W: Write> Write for OneError<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.first(bytes.len(), |file| file.write(bytes))?;
        self.position += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.first((), Write::flush)
    }
}

impl<W: Seek> Seek for OneError<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.first(self.position, |file| file.seek(to))?;
        Ok(self.position)
    }
}
