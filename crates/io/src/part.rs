//! Parts of renders as files: checkpoints, and shards that are to be merged.
//!
//! A file is `morgana\x1a`, the number of the format, a header, what was gathered, and a BLAKE3 hash of all of this.
//! Numbers and structures are encoded by [postcard](https://postcard.jamesmunns.com/wire-format). A file of which one bit is
//! wrong is refused, and one is replaced only by a file that is complete.

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
/// Grows with every change of what is stored.
const FORMAT: u32 = 12;
/// Name of the setting which integrator rendered it.
pub(crate) const INTEGRATOR: &str = "integrator";
/// Name of the setting why that was chosen.
pub(crate) const REASON: &str = "choice of the integrator";
const HASH: usize = blake3::OUT_LEN;
/// What is written at a time.
const BUFFER: usize = 1 << 16;

/// What was gathered so far of a render, and which render that is.
#[derive(Clone, Debug)]
pub struct Part {
    /// Which render.
    pub header: Header,
    /// What was gathered.
    pub body: Body,
}

/// Which render a part is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the program: others may take other samples.
    pub version: String,
    /// What its estimators find, in short: other builds of the same version may find something else.
    pub results: String,
    /// Hash of the scene with all its files.
    pub scene_hash: String,
    /// Settings that decide which samples are taken, by name.
    pub settings: Vec<(String, String)>,
    /// Number of samples (or particles) of the whole render; none if it has no limit.
    pub total: Option<u64>,
    /// How samples belong together: parts have whole replicates.
    pub replicates: Replicates,
    /// Which of how many parts of the whole this one is, counted from 0.
    pub shard: Option<[u64; 2]>,
    /// How to find the scene, and what it was rendered with, as the program knows it; empty if a part comes from elsewhere.
    pub origin: String,
    /// Time that was spent, in seconds, over all runs.
    pub seconds: f64,
}

/// What was gathered.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Body {
    /// Samples of an image.
    Image(Box<State>),
    /// Particles seen by meters.
    Meters(Box<MeasureState>),
}

/// Why parts are not of the same render.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Foreign {
    /// Other programs.
    #[error("it is of version {0}, not {1}")]
    Version(String, String),
    /// Other builds.
    #[error(
        "it comes from another build of version {0}, whose estimators give other results ({1}, not {2}): render all parts by \
         one"
    )]
    Results(String, String, String),
    /// Other scenes.
    #[error(
        "it is of another scene: the description or a file that it uses has changed (hash {0}, not {1})"
    )]
    Scene(String, String),
    /// Other settings: name, and values.
    #[error("it was rendered with {0} = {1}, not {2}")]
    Setting(String, String, String),
    /// Other totals.
    #[error("it is of a render of {0} samples, not {1}")]
    Total(String, String),
    /// Other contents.
    #[error("{0}")]
    Merge(#[from] MergeError),
}

impl Header {
    /// Finds out whether samples with another header are of the same render, whatever their total.
    ///
    /// # Errors
    /// The first difference, as seen from `self`.
    pub fn agrees(&self, other: &Header) -> Result<(), Foreign> {
        let clone = |a: &String, b: &String| (a.clone(), b.clone());
        if self.version != other.version {
            let (a, b) = clone(&self.version, &other.version);
            return Err(Foreign::Version(a, b));
        }
        if self.scene_hash != other.scene_hash {
            let short = |hash: &String| hash.chars().take(12).collect();
            return Err(Foreign::Scene(
                short(&self.scene_hash),
                short(&other.scene_hash),
            ));
        }
        let value = |header: &Header, name: &str| {
            let found = header.settings.iter().find(|(n, _)| n == name);
            found.map_or("(none)".to_owned(), |(_, value)| value.clone())
        };
        // Why the integrator was chosen may differ: a render that goes on for longer would have had a longer pilot.
        let names = self.settings.iter().chain(&other.settings);
        for (name, _) in names.filter(|(name, _)| name != REASON) {
            let (mine, others) = (value(self, name), value(other, name));
            if mine != others {
                return Err(Foreign::Setting(name.clone(), mine, others));
            }
        }
        // Of the same estimator and meters, as the same settings and scene have them.
        if self.results != other.results {
            let (a, b) = clone(&self.results, &other.results);
            return Err(Foreign::Results(self.version.clone(), a, b));
        }
        Ok(())
    }

    /// The value of a setting, if there is one of that name.
    pub fn setting(&self, name: &str) -> Option<&str> {
        let mut settings = self.settings.iter();
        settings
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.as_str())
    }

    /// Numbers of the samples that this part is to have.
    pub fn range(&self) -> Range<u64> {
        let total = self.total.unwrap_or(u64::MAX);
        let end = |index, count| self.replicates.whole(share(total, index, count));
        match self.shard {
            None => 0..total,
            Some([index, count]) => end(index, count)..end(index + 1, count),
        }
    }
}

/// `total · index / count`.
fn share(total: u64, index: u64, count: u64) -> u64 {
    let product = u128::from(total) * u128::from(index);
    u64::try_from(product / u128::from(count.max(1))).unwrap_or(u64::MAX)
}

impl Body {
    /// Numbers of the samples, or particles, that were taken.
    pub fn done(&self) -> &Ranges {
        BodyRef::of(self).done()
    }

    /// Returns whether a picture has reached its target error.
    pub fn reached(&self) -> bool {
        matches!(self, Body::Image(state) if state.reached())
    }
}

impl Part {
    /// Adds a part of the same render.
    ///
    /// # Errors
    /// A part of another render, or one with samples that are here already; nothing is added then.
    pub fn merge(&mut self, other: &Part) -> Result<(), Foreign> {
        other.header.agrees(&self.header)?;
        if other.header.total != self.header.total {
            let text = |total: Option<u64>| total.map_or("any number of".into(), |n| n.to_string());
            let totals = (text(other.header.total), text(self.header.total));
            return Err(Foreign::Total(totals.0, totals.1));
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
    /// As for [`atomic::write()`].
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        write(path, &self.header, BodyRef::of(&self.body))
    }

    /// The bytes of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Nothing can fail but the memory's size.
        let _ = encode(&mut bytes, &self.header, BodyRef::of(&self.body));
        bytes
    }

    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, that is none of these, of another format, incomplete or damaged.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = input::read(path)?;
        Part::from_bytes(&bytes).map_err(|problem| problem.at(path))
    }

    /// Decodes the bytes of a file.
    ///
    /// # Errors
    /// As for [`Part::read`].
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

/// Header and body of a file that is whole.
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

/// What a file of these contents ends with.
pub fn checksum(contents: &[u8]) -> [u8; HASH] {
    *blake3::hash(contents).as_bytes()
}

/// A body that is somewhere else; it is encoded as [`Body`] is.
#[derive(Clone, Copy, Debug, Serialize)]
pub enum BodyRef<'a> {
    /// Samples of an image.
    Image(&'a State),
    /// Particles seen by meters.
    Meters(&'a MeasureState),
}

impl<'a> BodyRef<'a> {
    /// Refers to a body.
    pub fn of(body: &'a Body) -> Self {
        match body {
            Body::Image(state) => BodyRef::Image(state),
            Body::Meters(state) => BodyRef::Meters(state),
        }
    }

    /// Numbers of the samples, or particles, that were taken.
    pub fn done(self) -> &'a Ranges {
        match self {
            BodyRef::Image(state) => state.done(),
            BodyRef::Meters(state) => state.done(),
        }
    }

    /// The picture so far; none of meters.
    pub fn film(self) -> Option<&'a Film> {
        match self {
            BodyRef::Image(state) => Some(state.film()),
            BodyRef::Meters(_) => None,
        }
    }
}

/// Writes a part while it is being worked on: see [`Part::write`].
///
/// # Errors
/// As for [`atomic::write()`].
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
        // It does not say what the system said; a second attempt to write does.
        Err(error) => Err(to.flush().err().unwrap_or(io::Error::other(error))),
    }
}

/// Passes bytes on and hashes them.
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
