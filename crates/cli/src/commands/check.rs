//! `morgana check`.

use crate::args::CheckArgs;
use crate::command_error::{CommandError, show};
use crate::load::{load_as_it_is, options};
use crate::output::say;
use io::diagnostic::shown;
use io::features::{Features, missing};
use io::{Diagnostics, PluginKind, Run, Severity, schema};
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Loads a scene as a render would, and prints its errors, warnings and notes.
pub fn check(args: &CheckArgs) -> Result<ExitCode, CommandError> {
    if args.mitsuba {
        return report(args);
    }
    let loaded = load_as_it_is(&args.scene)?;
    show(&loaded.warnings);
    show(&loaded.notes_of_differences());
    Run::new(&loaded).check(args.scene.memory.limits())?;
    let film = loaded.scene().film();
    let what = match loaded.instruments.len() {
        0 => format!("{} × {} pixels", film.width, film.height),
        1 => "1 meter".into(),
        n => format!("{n} meters"),
    };
    let warnings = match loaded.warnings.iter().count() {
        0 => "no warnings".to_owned(),
        1 => "1 warning or note".into(),
        n => format!("{n} warnings and notes"),
    };
    let name = shown(&args.scene.path);
    say(&format!("{name}: can be used ({what}; {warnings})"))?;
    Ok(ExitCode::SUCCESS)
}

/// Reports the features of Mitsuba 3 that a scene uses, and which of them are rendered differently
/// or missing.
fn report(args: &CheckArgs) -> Result<ExitCode, CommandError> {
    let mut diagnostics = Diagnostics::new();
    let mut lines = Vec::new();
    let mut approximated = Vec::new();
    let (path, defines) = (&args.scene.path, &args.scene.defines);
    let limits = args.scene.memory.limits();
    if let Some(scene) = io::read_scene(path, defines, limits, &mut diagnostics) {
        let features = Features::of(&scene);
        lines.extend(section("supported", supported(&features)));
        lines.extend(section("only in morgana", features.own));
        let read = std::mem::take(&mut diagnostics);
        match io::assemble(&scene, &options(&args.scene), read) {
            Ok(loaded) => {
                let differences = loaded.differences.iter();
                approximated.extend(differences.map(|d| format!("{}: {}", d.topic, d.text)));
                diagnostics = loaded.warnings;
            }
            Err(errors) => diagnostics = errors,
        }
    }
    let missing = missing(&diagnostics).into_iter();
    let missing: Vec<_> = missing
        .map(|(message, count)| match count {
            1 => message,
            _ => format!("{message} ({count} times)"),
        })
        .collect();
    let can_be_used = !diagnostics.has_errors();
    lines.extend(section("different from Mitsuba", approximated));
    lines.extend(section("missing", missing));
    let warnings = diagnostics.iter().filter(|d| d.severity != Severity::Error);
    let warnings = warnings.map(|d| {
        let check = d.lint.map(|lint| format!("[{lint}]")).unwrap_or_default();
        format!("{}{check}: {}", d.severity, d.message)
    });
    lines.extend(section("warnings", warnings.collect()));
    let name = shown(&args.scene.path);
    let verdict = if can_be_used {
        "can be used"
    } else {
        "cannot be used"
    };
    say(&format!("{name}: {verdict}\n{}", lines.join("\n")))?;
    Ok(if can_be_used {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(2)
    })
}

/// Lists the known plugins of each kind, with the number of uses.
fn supported(features: &Features) -> Vec<String> {
    let mut kinds: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let known = |kind: &PluginKind, plugin: &str| schema::find(*kind, plugin).is_some();
    let plugins = features.plugins.iter();
    for ((kind, plugin), count) in plugins.filter(|((kind, plugin), _)| known(kind, plugin)) {
        let times = if *count > 1 {
            format!(" ×{count}")
        } else {
            String::new()
        };
        let plugins = kinds.entry(kind.to_string()).or_default();
        plugins.push(format!("{plugin}{times}"));
    }
    let line =
        |(kind, plugins): (String, Vec<String>)| format!("{kind:<10} {}", plugins.join(", "));
    kinds.into_iter().map(line).collect()
}

/// Returns a heading with items below it; nothing if there are no items.
fn section(heading: &str, items: Vec<String>) -> Vec<String> {
    if items.is_empty() {
        return Vec::new();
    }
    let items = items.into_iter().map(|item| format!("  {item}"));
    std::iter::once(format!("{heading}:"))
        .chain(items)
        .collect()
}
