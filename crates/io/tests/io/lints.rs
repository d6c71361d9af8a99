//! Warning checks, and the names by which users silence them.

use morgana_io::diagnostic::lints;
use morgana_io::{Diagnostics, LoadOptions, Loaded, json};

/// A beam without a width, seen by no camera.
const SCENE: &str = r#"{"type": "scene", "e": {"type": "collimated", "power": 1},
    "s": {"type": "sphere", "interior": {"type": "homogeneous"}, "bsdf": {"type": "dielectric"}}}"#;

fn load(silenced: &[&str]) -> Loaded {
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(SCENE, "scene.json", &[], &mut diagnostics).unwrap();
    let named = silenced.iter().map(|name| lints::named(name).unwrap());
    let options = LoadOptions {
        silenced: named.collect(),
        ..LoadOptions::default()
    };
    morgana_io::assemble(&scene, &options, diagnostics).unwrap()
}

fn names(diagnostics: &Diagnostics) -> Vec<&'static str> {
    diagnostics.iter().map(|d| d.lint.unwrap().name).collect()
}

#[test]
fn names_are_told_with_the_message() {
    let loaded = load(&[]);
    assert_eq!(
        names(&loaded.warnings),
        ["thin_beam", "no_sensor", "missing_light"]
    );
    let text = loaded.warnings.to_string();
    assert!(
        text.starts_with("note[thin_beam]: a beam without"),
        "{text}"
    );
    assert!(text.contains("\nwarning[missing_light]: "), "{text}");
    let notes = loaded.notes_of_differences();
    assert!(!notes.is_empty());
    assert!(!loaded.is_for_mitsuba && loaded.note_of_differences().is_empty());
    assert!(
        names(&notes)
            .iter()
            .all(|name| *name == "differs_from_mitsuba")
    );
}

#[test]
fn silenced_checks_say_nothing_and_change_nothing() {
    let loaded = load(&["thin_beam", "differs_from_mitsuba"]);
    assert_eq!(names(&loaded.warnings), ["no_sensor", "missing_light"]);
    assert!(loaded.notes_of_differences().is_empty());
    assert_eq!(loaded.hash, load(&[]).hash);
}

#[test]
fn unknown_names_get_a_suggestion() {
    let told = lints::named("thin_beem").unwrap_err();
    assert_eq!(
        told,
        "no check has the name 'thin_beem': did you mean 'thin_beam'?"
    );
    let told = lints::named("nothing like it").unwrap_err();
    assert!(told.contains("there are: absent_labels, "), "{told}");
}

/// `docs/checks.md` lists each check with its help.
#[test]
fn the_manual_lists_all_checks() {
    let manual = include_str!("../../../../docs/checks.md");
    let rows: Vec<&str> = manual.lines().filter(|l| l.starts_with("| `")).collect();
    let all = lints::all();
    let expected = all.iter().map(|l| format!("| `{}` | {} |", l.name, l.help));
    assert_eq!(rows, expected.collect::<Vec<_>>());
}
