//! `morgana status`.

use crate::args::StatusArgs;
use crate::command_error::{CommandError, warn};
use crate::numbers;
use crate::output::say;
use io::diagnostic::shown;
use io::part::{Body, Header, Part};
use serde_json::{Value, json};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use transport::render::{MeasureOptions, Ranges};

/// A part file that was read.
struct PartFile {
    path: PathBuf,
    header: Header,
    done: Ranges,
    /// Number of samples that are taken at a time.
    unit: u64,
}

impl PartFile {
    fn new(path: PathBuf, Part { header, body }: Part) -> Self {
        PartFile {
            path,
            header,
            done: body.done().clone(),
            unit: match body {
                Body::Image(_) => 1,
                Body::Meters(_) => MeasureOptions::UNIT,
            },
        }
    }

    /// Returns the sample numbers of a complete shard; without `shard`, of this part.
    fn range(&self, shard: Option<[u64; 2]>) -> Range<u64> {
        let shard = shard.or(self.header.shard);
        let header = Header {
            shard,
            ..self.header.clone()
        };
        let Range { start, end } = header.range();
        let whole = |n: u64| n.checked_next_multiple_of(self.unit).unwrap_or(n);
        whole(start)..whole(end)
    }
}

/// Reports existing and missing samples. Returns status 1 if samples are missing.
pub fn status(args: &StatusArgs) -> Result<ExitCode, CommandError> {
    let (mut found, mut unreadable) = (Vec::<PartFile>::new(), Vec::new());
    for path in &args.parts {
        match Part::read(path) {
            Ok(part) => found.push(PartFile::new(path.clone(), part)),
            Err(error) => unreadable.push(error.to_string()),
        }
    }
    let Some(first) = found.first() else {
        return Err(CommandError::Runtime(unreadable.join("\n")));
    };
    check(&first.path, &first.header, &found[1..])?;
    let overview = Overview::of(&found);
    let mut out = std::io::stdout();
    if args.json {
        writeln!(out, "{:#}", overview.json(&found, &unreadable))?;
    } else if args.missing {
        // The standard output is for programs: report unreadable files on the standard error.
        unreadable.iter().for_each(|error| warn(error));
        writeln!(out, "{}", overview.array())?;
    } else {
        for part in &found {
            say(&line(part))?;
        }
        for error in &unreadable {
            say(error)?;
        }
        say(&overview.text())?;
    }
    Ok(if overview.missing.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Checks that all parts belong to one render.
fn check(path: &Path, header: &Header, others: &[PartFile]) -> Result<(), CommandError> {
    for other in others {
        let agrees = other.header.agrees(header);
        agrees.map_err(|e| {
            CommandError::Usage(format!(
                "'{}' does not belong to '{}': {e}",
                shown(&other.path),
                shown(path)
            ))
        })?;
    }
    Ok(())
}

/// Summary of the samples of a render.
struct Overview {
    done: u64,
    /// Samples in two parts.
    twice: Option<Range<u64>>,
    total: Option<u64>,
    /// Ranges of missing samples.
    missing: Vec<Range<u64>>,
    /// Shards that are missing or incomplete.
    shards: Vec<u64>,
    seconds: f64,
}

impl Overview {
    fn of(found: &[PartFile]) -> Self {
        let header = &found[0].header;
        let (mut all, mut twice) = (Ranges::default(), None);
        for part in found {
            twice = twice.or(all.overlap(&part.done));
            part.done.iter().for_each(|range| all.insert(range));
        }
        let total = header.total.map(|total| total.max(part_end(&all)));
        let missing = |range| all.gaps(range);
        let count = found
            .iter()
            .find_map(|p| p.header.shard)
            .map_or(0, |[_, n]| n);
        let is_missing = |index: &u64| !missing(found[0].range(Some([*index, count]))).is_empty();
        Overview {
            done: all.count(),
            twice,
            total,
            missing: total.map_or(Vec::new(), |total| missing(0..total)),
            shards: (0..count).filter(is_missing).collect(),
            seconds: found.iter().map(|p| p.header.seconds).sum(),
        }
    }

    /// Lists numbers of shards in the format of Slurm's `--array`: `1,4-7`.
    fn array(&self) -> String {
        let mut shards = Ranges::default();
        self.shards.iter().for_each(|&i| shards.insert(i..i + 1));
        list(shards.iter())
    }

    fn text(&self) -> String {
        let time = numbers::duration(Duration::try_from_secs_f64(self.seconds).unwrap_or_default());
        let total = self.total.map_or(String::new(), |n| format!(" of {n}"));
        let mut lines = vec![format!(
            "{}{total} samples in {time} of computing",
            self.done
        )];
        if let Some(range) = &self.twice {
            lines.push(format!(
                "two parts have the samples {}: leave out one of them",
                list([range.clone()])
            ));
        }
        if self.shards.is_empty() && !self.missing.is_empty() {
            lines.push(format!("missing: samples {}", list(self.missing.clone())));
        } else if !self.shards.is_empty() {
            lines.push(format!(
                "missing or incomplete shards: {} (sbatch --array={0})",
                self.array()
            ));
        }
        lines.join("\n")
    }

    fn json(&self, found: &[PartFile], unreadable: &[String]) -> Value {
        let pairs = |ranges: Vec<Range<u64>>| -> Value {
            ranges
                .into_iter()
                .map(|r| [r.start, r.end])
                .map(Value::from)
                .collect()
        };
        let part = |part: &PartFile| {
            json!({
                "path": part.path.display().to_string(),
                "shard": part.header.shard,
                "samples": pairs(part.done.iter().collect()),
                "complete": complete(part),
                "seconds": part.header.seconds,
            })
        };
        json!({
            "scene_hash": found[0].header.scene_hash,
            "version": found[0].header.version,
            "done": self.done,
            "total": self.total,
            "seconds": self.seconds,
            "parts": found.iter().map(part).collect::<Vec<_>>(),
            "unreadable": unreadable,
            "twice": self.twice.clone().map(|r| [r.start, r.end]),
            "missing_samples": pairs(self.missing.clone()),
            "missing_shards": self.shards,
        })
    }
}

/// Returns the number after the last sample.
fn part_end(done: &Ranges) -> u64 {
    done.iter().last().map_or(0, |range| range.end)
}

/// Returns true if a part is complete; `None` if it has no limit.
fn complete(part: &PartFile) -> Option<bool> {
    let limited = part.header.total.is_some();
    limited.then(|| part.done.gaps(part.range(None)).is_empty())
}

fn line(part: &PartFile) -> String {
    let name = part
        .header
        .shard
        .map_or("checkpoint".into(), |[i, n]| format!("shard {i} of {n}"));
    let state = match complete(part) {
        Some(true) => "complete",
        Some(false) => "incomplete",
        None => "without limit",
    };
    let samples = match part.done.count() {
        0 => "no samples".into(),
        _ => format!("samples {}", list(part.done.iter())),
    };
    format!("{}: {name}, {samples}, {state}", shown(&part.path))
}

/// Formats ranges with both ends: `1,4-7`.
fn list(ranges: impl IntoIterator<Item = Range<u64>>) -> String {
    let text = |range: Range<u64>| match range.end - range.start {
        1 => range.start.to_string(),
        _ => format!("{}-{}", range.start, range.end - 1),
    };
    let texts: Vec<String> = ranges.into_iter().map(text).collect();
    texts.join(",")
}
