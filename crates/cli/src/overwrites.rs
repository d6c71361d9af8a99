//! Checks that a command overwrites neither its input files nor its other output files.

use crate::command_error::CommandError;
use clap::{Arg, ArgMatches, Command};
use io::diagnostic::shown;
use std::path::{Path, PathBuf};

/// Options that name files to write.
const OUTPUT_OPTIONS: [&str; 6] = ["output", "stats", "strategies", "checkpoint", "map", "zmap"];
/// Options that name files to read.
const INPUT_OPTIONS: [&str; 2] = ["overlay", "scene"];

/// Refuses duplicate output files, and outputs that would overwrite inputs. Parts may be merged
/// into one of themselves.
pub fn check(program: &Command, matches: &ArgMatches) -> Result<(), CommandError> {
    let (mut command, mut matches) = (program, matches);
    while let Some((name, inner)) = matches.subcommand() {
        command = command.find_subcommand(name).unwrap_or(command);
        matches = inner;
    }
    let (mut written, mut read) = (Vec::new(), Vec::new());
    for arg in command.get_arguments() {
        let files = || paths(arg, matches);
        match arg.get_id().as_str() {
            id if !arg.is_positional() && OUTPUT_OPTIONS.contains(&id) => written.extend(files()),
            id if INPUT_OPTIONS.contains(&id) => read.extend(files()),
            _ if arg.is_positional() && command.get_name() != "merge" => read.extend(files()),
            _ => {}
        }
    }
    for (i, file) in written.iter().enumerate() {
        if written[..i].iter().any(|other| is_same(file, other)) {
            let message = format!(
                "'{}' would be written twice: give each output a file of its own",
                shown(file)
            );
            return Err(CommandError::Usage(message));
        }
    }
    check_read(&written, &read)
}

/// Refuses to write over files that are read.
pub fn check_read(written: &[PathBuf], read: &[PathBuf]) -> Result<(), CommandError> {
    let is_read = |file: &&PathBuf| read.iter().any(|other| is_same(file, other));
    match written.iter().find(is_read) {
        Some(file) => {
            let message = format!("'{}' is read here: write to another file", shown(file));
            Err(CommandError::Usage(message))
        }
        None => Ok(()),
    }
}

/// Returns the paths given to an argument.
fn paths(arg: &Arg, matches: &ArgMatches) -> Vec<PathBuf> {
    let given = matches.try_get_many::<PathBuf>(arg.get_id().as_str());
    given
        .ok()
        .flatten()
        .into_iter()
        .flatten()
        .cloned()
        .collect()
}

/// Returns true if two paths lead to one file, which need not exist. Devices do not count, because
/// they may be written to repeatedly.
fn is_same(a: &Path, b: &Path) -> bool {
    let is_device = a.exists() && !a.is_file();
    !is_device && resolved(a) == resolved(b)
}

/// Returns the path without links and `..`, as far as it exists.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(path) = path.canonicalize() {
        return path;
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}
