//! `morgana connect`.

use crate::args::ConnectArgs;
use crate::command_error::CommandError;
use crate::load::load_with_warnings;
use serde_json::{Value, json};
use std::io::Write;
use std::process::ExitCode;
use transport::trace::{Branch, branches};

/// Finds the ray between two points, or all rays, and prints them. Fails if there is none.
pub fn connect(args: &ConnectArgs) -> Result<ExitCode, CommandError> {
    let loaded = load_with_warnings(&args.scene)?;
    let all = args.all.then_some(args.reflections);
    let found = branches(loaded.same_rays(), args.from, args.to, all);
    let answer = json!({
        "branches": found.list.iter().map(json).collect::<Vec<_>>(),
        "certified_unique": found.is_unique,
        "failure": found.failure.map(|f| f.to_string()),
        "occluded": found.is_occluded,
    });
    writeln!(std::io::stdout(), "{answer:#}")?;
    if found.list.is_empty() {
        let why = found.failure.map_or(String::new(), |f| format!(": {f}"));
        return Err(CommandError::Runtime(format!(
            "found no ray between the two points{why}"
        )));
    }
    Ok(ExitCode::SUCCESS)
}

fn json(branch: &Branch) -> Value {
    let ray = &branch.connection;
    json!({
        "direction_out": ray.direction_out.to_array(),
        "direction_in": ray.direction_in.to_array(),
        "arc_length": ray.arc_length,
        "optical_length": ray.optical_length,
        "transmittance": branch.transmittance,
        "jacobian": ray.jacobian,
        "iterations": ray.shots,
        "reflections": ray.pattern.reflections(),
        "occluded": branch.is_occluded,
        "primary": branch.is_primary,
    })
}
