//! Saving a render's samples to a file, periodically and at its end.

use crate::args::KeepArgs;
use crate::command_error::{CommandError, warn};
use crate::config;
use crate::load::named_after;
use io::Run;
use io::diagnostic::shown;
use io::lock::{Lock, LockError};
use io::part::{Body, BodyRef, Header, Part};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A file that is kept up to date.
#[derive(Debug)]
pub struct PartFiles {
    path: PathBuf,
    every: Duration,
    header: Header,
    /// Seconds spent by earlier runs.
    before: f64,
    started: Instant,
    last: Instant,
    /// True if the user knows that the file cannot be written.
    complained: bool,
    /// Lock against other processes.
    _lock: Option<Lock>,
}

/// Returns the file for the samples, if any: the checkpoint, or the part of a shard.
pub fn path(
    args: &KeepArgs,
    outputs: &[PathBuf],
    scene: &Path,
    shard: Option<[u64; 2]>,
) -> Result<Option<PathBuf>, CommandError> {
    let Some([index, count]) = shard else {
        return Ok(args.checkpoint.clone());
    };
    let usage = |message: &str| Err(CommandError::Usage(message.into()));
    match outputs {
        [] => Ok(Some(named_after(
            scene,
            &format!(".{index}-of-{count}.part"),
        ))),
        [path] if path.extension().is_some_and(|e| e == "part") => Ok(Some(path.clone())),
        _ => usage(
            "a shard writes one file: give one -o NAME.part, and make images by morgana merge",
        ),
    }
}

/// A file that a run keeps up to date, with the contents from an earlier run, if there are any.
#[derive(Debug)]
pub struct PartFile {
    path: PathBuf,
    every: Duration,
    part: Option<Part>,
    started: Instant,
    lock: Option<Lock>,
}

impl PartFile {
    /// Opens the file at `path`, and checks that it can be written. If the file exists, `args` must
    /// ask to resume it, so that no samples are lost.
    pub fn open(path: PathBuf, args: &KeepArgs) -> Result<Self, CommandError> {
        config::check_writable(&path)?;
        let lock = lock(&path)?;
        let exists = path.exists();
        if exists && !args.resume {
            let path = shown(&path);
            let message = format!(
                "'{path}' exists already: continue it by --resume, or remove it to start again"
            );
            return Err(CommandError::Usage(message));
        }
        Ok(PartFile {
            part: exists.then(|| Part::read(&path)).transpose()?,
            path,
            every: args.checkpoint_every,
            started: Instant::now(),
            lock,
        })
    }

    /// Returns the header of the existing contents, if there are any.
    pub fn header(&self) -> Option<&Header> {
        self.part.as_ref().map(|part| &part.header)
    }

    /// Continues the file as a part of `run`. Existing contents must belong to this run.
    pub fn keep(
        self,
        header: Header,
        run: &Run,
    ) -> Result<(PartFiles, Option<Body>), CommandError> {
        let path = self.path;
        let refuse = |why: String| {
            CommandError::Usage(format!("'{}' cannot be resumed: {why}", shown(&path)))
        };
        if let Some(kept) = &self.part {
            kept.header
                .agrees(&header)
                .map_err(|e| refuse(e.to_string()))?;
            let same = kept.header.shard == header.shard;
            if !same || header.shard.is_some() && kept.header.total != header.total {
                return Err(refuse(format!(
                    "it is {}, not {}",
                    name(&kept.header),
                    name(&header)
                )));
            }
            let (done, wanted) = (kept.body.done().count(), header.total.unwrap_or(u64::MAX));
            if done > wanted {
                return Err(refuse(format!(
                    "it already has {done} samples, more than {wanted}: raise --spp"
                )));
            }
            // The header agrees, but the contents do not: this occurs only in a forged file.
            if !run.fits(&kept.body) {
                return Err(refuse("its contents do not fit this scene".into()));
            }
        }
        let now = Instant::now();
        let keeper = PartFiles {
            path,
            every: self.every,
            before: self.part.as_ref().map_or(0.0, |k| k.header.seconds),
            header,
            started: self.started,
            last: now,
            complained: false,
            _lock: self.lock,
        };
        Ok((keeper, self.part.map(|k| k.body)))
    }
}

impl PartFiles {
    /// Returns the time spent so far, including earlier runs.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed() + Duration::from_secs_f64(self.before.max(0.0))
    }

    /// Writes the file if it is due. A failure to write does not end the render: there may be room
    /// later.
    pub fn update(&mut self, body: BodyRef) {
        if self.last.elapsed() < self.every {
            return;
        }
        match self.save(body) {
            Ok(()) => self.complained = false,
            Err(error) if !self.complained => {
                self.complained = true;
                warn(&format!("{error}; the render continues without this file"));
            }
            Err(_) => {}
        }
        self.last = Instant::now();
    }

    /// Writes the file.
    pub fn save(&mut self, body: BodyRef) -> Result<(), io::FileError> {
        self.header.seconds = self.elapsed().as_secs_f64();
        io::part::write(&self.path, &self.header, body)
    }
}

/// Locks a file. Two processes that write one file would destroy each other's work.
fn lock(path: &Path) -> Result<Option<Lock>, CommandError> {
    let name = shown(path);
    match Lock::take(path) {
        Ok(lock) => Ok(Some(lock)),
        Err(LockError::Held(holder)) => Err(CommandError::Usage(format!(
            "'{name}' is in use by {holder}: wait until it ends, or use another file"
        ))),
        Err(LockError::Unknown(why)) => {
            warn(&format!(
                "'{name}' cannot be locked ({why}): make sure that no other process uses it"
            ));
            Ok(None)
        }
    }
}

/// Describes the part in a file.
fn name(header: &Header) -> String {
    let total = header
        .total
        .map_or("any number of".into(), |n| n.to_string());
    match header.shard {
        Some([index, count]) => format!("shard {index} of {count} of {total} samples"),
        None => format!("a checkpoint of {total} samples"),
    }
}
