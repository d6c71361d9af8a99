//! Files with parts of renders: checkpoints, and shards to be merged.
//!
//! A file contains `morgana\x1a`, the format number, a header, the samples, and a BLAKE3 hash of
//! all preceding bytes. [postcard](https://postcard.jamesmunns.com/wire-format) encodes numbers and
//! structures. A file with a single wrong bit is refused. Only a complete file replaces an existing
//! one.

use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;
use transport::Film;
use transport::render::{MeasureState, MergeError, Ranges, State};
use transport::sampling::Replicates;

const MAGIC: &[u8; 8] = b"morgana\x1a";
/// Format number; it increases with every change of the stored data.
const FORMAT: u32 = 17;
/// Name of the setting that records the integrator of the render.
pub(crate) const INTEGRATOR: &str = "integrator";
/// Name of the setting that records the number of particles of a batch on a device.
pub(crate) const BATCH: &str = "particles of a batch";
/// Name of the setting that records why the integrator was chosen.
pub(crate) const REASON: &str = "choice of the integrator";
const HASH: usize = blake3::OUT_LEN;
/// Bytes that are written at a time.
const BUFFER: usize = 1 << 16;

/// Samples of a render, and the header that identifies the render.
#[derive(Clone, Debug)]
pub struct Part {
    /// Identification of the render.
    pub header: Header,
    /// Samples so far.
    pub body: Body,
}

/// Identification of the render that a part belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the program. Other versions may take other samples.
    pub version: String,
    /// Digest of the results of the estimators and meters used. Builds of one version may differ in
    /// it.
    pub results: String,
    /// Hash of the scene with all its files.
    pub scene_hash: String,
    /// Settings that determine which samples are taken, by name.
    pub settings: Vec<(String, String)>,
    /// Number of samples (or particles) of the whole render; `None` if it has no limit.
    pub total: Option<u64>,
    /// Grouping of samples into replicates. A part contains whole replicates.
    pub replicates: Replicates,
    /// Index of this part, counted from 0, and the number of parts; `None` if this is the whole.
    pub shard: Option<[u64; 2]>,
    /// Scene file and options, in the program's own form; empty if a part does not come from the
    /// program.
    pub origin: String,
    /// Rendering time in seconds, over all runs.
    pub seconds: f64,
}

/// Samples or particles of a part.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Body {
    /// Samples of an image.
    Image(Box<State>),
    /// Particles of a measurement.
    Meters(Box<MeasureState>),
}

/// Difference between parts that do not belong to one render.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartMismatch {
    /// Different versions of the program.
    #[error(
        "it was made by version {0} of morgana, but this is version {1}: use version {0}, or render it again"
    )]
    Version(String, String),
    /// Different builds.
    #[error(
        "it comes from another build of version {0}, whose estimators give other results ({1}, not {2}): render all parts by \
         one"
    )]
    Results(String, String, String),
    /// Different scenes.
    #[error(
        "its scene is different: the scene or one of its data files has changed (hash {0}, not {1})"
    )]
    Scene(String, String),
    /// Different settings: name and both values.
    #[error("it was rendered with {0} = {1}, not {2}")]
    Setting(String, String, String),
    /// Different totals.
    #[error("its render has {0} samples, not {1}")]
    Total(String, String),
    /// Contents that cannot be merged.
    #[error("{0}")]
    Merge(#[from] MergeError),
}

impl Header {
    /// Checks that samples with another header belong to this render. The total numbers of samples
    /// may differ.
    ///
    /// # Errors
    /// Returns the first difference, as seen from `self`.
    pub fn agrees(&self, other: &Header) -> Result<(), PartMismatch> {
        let clone = |a: &String, b: &String| (a.clone(), b.clone());
        if self.version != other.version {
            let (a, b) = clone(&self.version, &other.version);
            return Err(PartMismatch::Version(a, b));
        }
        if self.scene_hash != other.scene_hash {
            let short = |hash: &String| hash.chars().take(12).collect();
            return Err(PartMismatch::Scene(
                short(&self.scene_hash),
                short(&other.scene_hash),
            ));
        }
        let value = |header: &Header, name: &str| {
            let found = header.settings.iter().find(|(n, _)| n == name);
            found.map_or("(none)".to_owned(), |(_, value)| value.clone())
        };
        // Skip the reason for the integrator: a continued render would have had a longer pilot.
        let names = self.settings.iter().chain(&other.settings);
        for (name, _) in names.filter(|(name, _)| name != REASON) {
            let (mine, others) = (value(self, name), value(other, name));
            if mine != others {
                return Err(PartMismatch::Setting(name.clone(), mine, others));
            }
        }
        // Scene and settings are equal here, so both digests cover one set of estimator and meters.
        if self.results != other.results {
            let (a, b) = clone(&self.results, &other.results);
            return Err(PartMismatch::Results(self.version.clone(), a, b));
        }
        Ok(())
    }

    /// Returns the value of the setting `name`, if there is one.
    pub fn setting(&self, name: &str) -> Option<&str> {
        let mut settings = self.settings.iter();
        settings
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.as_str())
    }

    /// Returns the numbers of the samples of this part.
    pub fn range(&self) -> Range<u64> {
        let total = self.total.unwrap_or(u64::MAX);
        let end = |index, count| self.replicates.whole(share(total, index, count));
        match self.shard {
            None => 0..total,
            Some([index, count]) => end(index, count)..end(index + 1, count),
        }
    }
}

/// Returns `total · index / count`.
fn share(total: u64, index: u64, count: u64) -> u64 {
    let product = u128::from(total) * u128::from(index);
    u64::try_from(product / u128::from(count.max(1))).unwrap_or(u64::MAX)
}

impl Body {
    /// Returns the numbers of the samples, or particles, taken so far.
    pub fn done(&self) -> &Ranges {
        BodyRef::of(self).done()
    }

    /// Returns true if a picture has reached its target error.
    pub fn reached(&self) -> bool {
        matches!(self, Body::Image(state) if state.reached())
    }
}

impl Part {
    /// Adds a part of this render.
    ///
    /// # Errors
    /// Returns an error for a part of another render, or one with samples that are already here.
    /// `self` then remains unchanged.
    pub fn merge(&mut self, other: &Part) -> Result<(), PartMismatch> {
        other.header.agrees(&self.header)?;
        if other.header.total != self.header.total {
            let text = |total: Option<u64>| total.map_or("any number of".into(), |n| n.to_string());
            let totals = (text(other.header.total), text(self.header.total));
            return Err(PartMismatch::Total(totals.0, totals.1));
        }
        match (&mut self.body, &other.body) {
            (Body::Image(a), Body::Image(b)) => a.merge(b)?,
            (Body::Meters(a), Body::Meters(b)) => a.merge(b)?,
            _ => return Err(MergeError::Different.into()),
        }
        self.header.seconds += other.header.seconds;
        self.header.shard = None;
        Ok(())
    }

    /// Writes a file, completely or not at all.
    ///
    /// # Errors
    /// Returns the errors of [`atomic::write()`].
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        write(path, &self.header, BodyRef::of(&self.body))
    }

    /// Returns the bytes of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Writing to memory fails only if the memory is exhausted.
        let _ = encode(&mut bytes, &self.header, BodyRef::of(&self.body));
        bytes
    }

    /// Reads a file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not a part, has another format number, or is
    /// incomplete or damaged.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = input::read(path)?;
        Part::from_bytes(&bytes).map_err(|problem| problem.at(path))
    }

    /// Decodes the bytes of a file.
    ///
    /// # Errors
    /// Returns the errors of [`Part::read`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Problem> {
        let content = checked(bytes)?;
        let damaged = |e: postcard::Error| Problem::Malformed(format!("not readable: {e}"));
        let (header, rest) = postcard::take_from_bytes(content).map_err(damaged)?;
        let (body, rest) = postcard::take_from_bytes(rest).map_err(damaged)?;
        match rest.len() {
            0 => Ok(Part { header, body }),
            n => Err(Problem::TrailingBytes { extra: n as u64 }),
        }
    }
}

/// Returns header and body of a complete file.
fn checked(bytes: &[u8]) -> Result<&[u8], Problem> {
    let not_one = |reason: &str| Problem::WrongFormat {
        format: "morgana part",
        reason: reason.into(),
    };
    let start = MAGIC.len() + size_of_val(&FORMAT);
    let magic = bytes.get(..MAGIC.len().min(bytes.len()));
    if magic != Some(&MAGIC[..bytes.len().min(MAGIC.len())]) || bytes.is_empty() {
        return Err(not_one("it starts with other bytes"));
    }
    let damaged = "it is incomplete or damaged (its checksum is wrong)";
    let Some(end) = bytes.len().checked_sub(HASH).filter(|end| *end >= start) else {
        return Err(not_one(damaged));
    };
    if checksum(&bytes[..end])[..] != bytes[end..] {
        return Err(not_one(damaged));
    }
    let format = bytes[MAGIC.len()..start].try_into().map(u32::from_le_bytes);
    match format {
        Ok(FORMAT) => Ok(&bytes[start..end]),
        _ => Err(Problem::Unsupported(
            "parts of renders by other versions of morgana".into(),
        )),
    }
}

/// Returns the hash that ends a file with these contents.
pub fn checksum(contents: &[u8]) -> [u8; HASH] {
    *blake3::hash(contents).as_bytes()
}

/// A body that is borrowed; it is encoded like [`Body`].
#[derive(Clone, Copy, Debug, Serialize)]
pub enum BodyRef<'a> {
    /// Samples of an image.
    Image(&'a State),
    /// Particles of a measurement.
    Meters(&'a MeasureState),
}

impl<'a> BodyRef<'a> {
    /// Borrows a body.
    pub fn of(body: &'a Body) -> Self {
        match body {
            Body::Image(state) => BodyRef::Image(state),
            Body::Meters(state) => BodyRef::Meters(state),
        }
    }

    /// Returns the numbers of the samples, or particles, taken so far.
    pub fn done(self) -> &'a Ranges {
        match self {
            BodyRef::Image(state) => state.done(),
            BodyRef::Meters(state) => state.done(),
        }
    }

    /// Returns the picture so far; `None` for meters.
    pub fn film(self) -> Option<&'a Film> {
        match self {
            BodyRef::Image(state) => Some(state.film()),
            BodyRef::Meters(_) => None,
        }
    }
}

/// Writes a part that is still in progress: see [`Part::write`].
///
/// # Errors
/// Returns the errors of [`atomic::write()`].
pub fn write(path: &Path, header: &Header, body: BodyRef) -> Result<(), FileError> {
    atomic::write(path, |file| encode(file, header, body))
}

fn encode(to: &mut impl Write, header: &Header, body: BodyRef) -> io::Result<()> {
    let mut hashing = io::BufWriter::with_capacity(BUFFER, Hashing::new(to));
    hashing.write_all(MAGIC)?;
    hashing.write_all(&FORMAT.to_le_bytes())?;
    put(header, &mut hashing)?;
    put(&body, &mut hashing)?;
    let Hashing { hasher, to } = hashing
        .into_inner()
        .map_err(io::IntoInnerError::into_error)?;
    to.write_all(hasher.finalize().as_bytes())
}

fn put(value: &impl Serialize, to: &mut impl Write) -> io::Result<()> {
    match postcard::to_io(value, &mut *to) {
        Ok(_) => Ok(()),
        // This error lacks the message of the system; flushing again returns it.
        Err(error) => Err(to.flush().err().unwrap_or(io::Error::other(error))),
    }
}

/// Writer that passes bytes on and hashes them.
struct Hashing<'a, W> {
    hasher: blake3::Hasher,
    to: &'a mut W,
}

impl<'a, W> Hashing<'a, W> {
    fn new(to: &'a mut W) -> Self {
        let hasher = blake3::Hasher::new();
        Hashing { hasher, to }
    }
}

impl<W: Write> Write for Hashing<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.to.write(bytes)?;
        self.hasher.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}
