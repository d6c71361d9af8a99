//! `morgana mcx`: runs an input file with the options of MCX, and writes files like MCX.

mod options;
mod patterns;
mod photons;
mod session;

use crate::command_error::{CommandError, warn};
use crate::driver::Driver;
use crate::interrupt::Interrupt;
use crate::load;
use crate::output::say;
use crate::progress::ProgressGoal;
use io::clock::Stopped;
use io::json::Item;
use io::{Diagnostics, LoadOptions, Loaded, Outcome, Run, atomic};
use options::{CommandLine, Show};
use rayon::ThreadPoolBuilder;
use serde_json::Value;
use session::{Report, Session};
use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Beginning of names under which the program behaves like MCX, for example of a link.
const NAME: &str = "mcx";

/// Help text.
const HELP: &str = "\
Runs an input file of MCX on CPUs, with MCX's options, and writes MCX's files.

Usage: morgana mcx -f INPUT.json [OPTIONS], or the same options after a link named mcx to morgana

Input:
  -f, --input FILE       input file, JSON text, or - for the standard input
  -P, --shapes JSON      draw more shapes
  -j, --json JSON        change the input
  -K, --mediabyte NAME   layout of voxels: byte, muamus_float, asgn_float, ... or its number
  -a, --array 0|1        order of raw volumes: 1 if z runs fastest
  --root FOLDER          folder of the input's files and of the output
Run:
  -n, --photon N         number of photons; -r repeats them
  -E, --seed N           seed of the random numbers
  -b, --reflect 0|1      refraction and reflection where the index jumps
  -B, --bc LETTERS       sides: _, r, a or m (mirror) for each, then 1 where a side detects light
  -u, --unitinmm MM      length of a voxel's edge
  -z, --srcfrom0 0|1     coordinates of the volume's corner: 1 for 0,0,0, 0 for 1,1,1
  -V, --specular 0|1     reflection of light that enters
  --srcid N              a single source
Output:
  -s, --session NAME     beginning of the names of all files
  -O, --outputtype X|F|E|R fluence rate, fluence, deposited energy, or the
                         complex fluence rate of modulated light
  -F, --outputformat NAME  jnii, bnii or mc2
  -U, --normalize 0|1    results for one joule, or for all photons
  -S, --save2pt 0|1      write the volume
  -d, --savedet 0|1      write detected photons; -x with positions and directions, -m with momentum
  -w, --savedetflag D|S|P|M|X|V|W  columns of detected photons
  -X, --saveref 0|1      light that leaves, as negative values in voxels of label 0
  -H, --maxdetphoton N   maximum number of detected photons per detector
  -l, --log              write messages to NAME.log
  --dumpjson FILE        write the input after all changes, and end

Options about GPUs have no effect. docs/guides/from-mcx.md has a table of all keys and options.
";

/// Returns true if the program was started by a name like that of MCX.
pub fn is_name(program: &OsStr) -> bool {
    let stem = Path::new(program).file_stem();
    stem.is_some_and(|stem| stem.to_string_lossy().starts_with(NAME))
}

/// Runs an input of MCX.
pub fn mcx(arguments: &[String]) -> Result<ExitCode, CommandError> {
    let line = CommandLine::parse(arguments)?;
    match line.show {
        Some(show) => say(&shown(show))?,
        None if arguments.is_empty() => say(HELP)?,
        None => return run(&line),
    }
    Ok(ExitCode::SUCCESS)
}

fn shown(show: Show) -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    match show {
        Show::Help => HELP.to_owned(),
        Show::Version => format!("morgana {} (mcx)", env!("CARGO_PKG_VERSION")),
        Show::Devices => format!("no GPU is needed: morgana runs on {threads} threads of the CPU"),
    }
}

fn run(line: &CommandLine) -> Result<ExitCode, CommandError> {
    let started = Instant::now();
    let (mut root, path) = input(line)?;
    line.change(&mut root)?;
    if let Some(target) = &line.dump {
        return dump(&root, target);
    }
    let (session, notes) = Session::take(&mut root, path.as_deref(), line)?;
    line.notes.iter().chain(&notes).for_each(|note| warn(note));
    let folder = line.root.as_ref().map(PathBuf::from);
    let folder = folder.or_else(|| path.and_then(|p| p.parent().map(Path::to_owned)));
    find_files(&mut root, &folder.unwrap_or_default());
    let interrupt = Interrupt::watch()?;
    let mut report = Report::default();
    let mut stopped = None;
    for input in patterns::inputs(root) {
        let loaded = loaded(input)?;
        if report.balances.is_empty() {
            load::warn(&loaded);
        }
        let (outcome, end) = measured(&loaded, session.seed, &interrupt)?;
        let Outcome::Readings(measurement) = outcome else {
            return Err(CommandError::Runtime("the input has no meter".into()));
        };
        report.photons += measurement.particles;
        report
            .balances
            .push(crate::balance::text(&measurement.balance));
        report
            .volumes
            .extend(session.volume(&loaded, &measurement)?);
        report.last = Some((loaded, *measurement));
        stopped = end;
        if stopped.is_some() {
            break;
        }
    }
    let written = session.write(&report)?;
    let text = format!(
        "{} photons in {:.1} s\n{}\nwrote {}",
        report.photons,
        started.elapsed().as_secs_f64(),
        report.balances.join("\n"),
        written.join(", ")
    );
    if line.log {
        atomic::write_bytes(&session.file(".log"), text.as_bytes())?;
    } else {
        say(&text)?;
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => interrupt.status(),
        _ => ExitCode::SUCCESS,
    })
}

/// Reads the input. Returns its path, too, if it is a file.
fn input(line: &CommandLine) -> Result<(Value, Option<PathBuf>), CommandError> {
    let Some(given) = &line.input else {
        return Err(CommandError::Usage(
            "give an input file by -f; morgana mcx --help lists the options".into(),
        ));
    };
    let (text, path) = if given.starts_with('{') {
        (given.clone(), None)
    } else if given == "-" {
        let mut text = String::new();
        std::io::stdin()
            .read_to_string(&mut text)
            .map_err(|e| CommandError::Runtime(format!("cannot read the standard input: {e}")))?;
        (text, None)
    } else {
        let path = PathBuf::from(given);
        let bytes = io::input::read(&path)?;
        (String::from_utf8_lossy(&bytes).into_owned(), Some(path))
    };
    let shown = path
        .as_deref()
        .map_or("input".into(), Path::to_string_lossy);
    let root: Value = serde_json::from_str(&with_escapes(&text))
        .map_err(|e| CommandError::Usage(format!("{shown}: it is not JSON: {e}")))?;
    if !root.is_object() {
        return Err(CommandError::Usage(format!("{shown}: it is not an object")));
    }
    Ok((root, path))
}

/// Returns a text of JSON with escapes instead of control characters in its strings. Strings of MCX's
/// own examples have line breaks.
fn with_escapes(text: &str) -> String {
    let mut found = String::with_capacity(text.len());
    let (mut is_string, mut is_escaped) = (false, false);
    for c in text.chars() {
        if is_string && c.is_ascii_control() {
            found.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            found.push(c);
        }
        is_string ^= c == '"' && !is_escaped;
        is_escaped = is_string && c == '\\' && !is_escaped;
    }
    found
}

fn dump(root: &Value, target: &str) -> Result<ExitCode, CommandError> {
    let text = format!("{root:#}\n");
    if target == "-" || target.starts_with(|c: char| c.is_ascii_digit()) {
        say(&text)?;
    } else {
        atomic::write_bytes(Path::new(target), text.as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Replaces names of files that do not exist in the current folder by names in another folder.
fn find_files(root: &mut Value, folder: &Path) {
    for place in [
        "/Domain/VolumeFile",
        "/Optode/Source/Pattern",
        "/Optode/Source/Pattern/Data",
    ] {
        let Some(Value::String(name)) = root.pointer_mut(place) else {
            continue;
        };
        if !name.is_empty() && !Path::new(name.as_str()).exists() {
            *name = folder.join(&*name).to_string_lossy().into_owned();
        }
    }
}

fn loaded(root: Value) -> Result<Loaded, CommandError> {
    let options = LoadOptions::default();
    let mut diagnostics = Diagnostics::new();
    let described = io::json::build(item(root), &[], options.limits, &mut diagnostics);
    match described {
        Some(description) => Ok(io::assemble(&description, &options, diagnostics)?),
        None => Err(diagnostics.into()),
    }
}

/// Converts a value of JSON.
fn item(value: Value) -> Item {
    match value {
        Value::Null => Item::Null,
        Value::Bool(v) => Item::Boolean(v),
        Value::Number(v) => v
            .as_i64()
            .map_or_else(|| Item::Float(v.as_f64().unwrap_or(0.0)), Item::Integer),
        Value::String(v) => Item::String(v),
        Value::Array(items) => Item::Array(items.into_iter().map(item).collect()),
        Value::Object(entries) => {
            Item::Object(entries.into_iter().map(|(k, v)| (k, item(v))).collect())
        }
    }
}

fn measured(
    loaded: &Loaded,
    seed: u64,
    interrupt: &Interrupt,
) -> Result<(Outcome, Option<Stopped>), CommandError> {
    let pool = ThreadPoolBuilder::new()
        .build()
        .map_err(|e| CommandError::Runtime(format!("cannot start threads: {e}")))?;
    let driver = Driver {
        pool: &pool,
        interrupt,
        quiet: false,
    };
    let mut run = Run {
        seed,
        ..Run::new(loaded)
    };
    run.check(io::Limits::default())?;
    if driver.choose(&mut run).is_break() {
        warn("interrupted before the first photon: no file was written");
        return Err(CommandError::Interrupted(interrupt.status()));
    }
    let mut body = run.start()?;
    let goal = ProgressGoal {
        samples_per_spp: loaded.groups.len() as u64,
        spp: Some(loaded.samples),
        before: 0,
        unit: "photons",
        time: None,
    };
    let (advanced, stopped) = driver.drive(goal, |handle, clock| {
        run.advance(&mut body, handle, clock, |_| {})
    });
    advanced?;
    Ok((run.finish(body)?, stopped))
}
