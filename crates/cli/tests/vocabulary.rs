//! Names follow textbooks: words that once stood for standard terms must not come back. Names are
//! unique: no two public types of the libraries share one.

mod sources;

use sources::{below, root};
use std::collections::BTreeMap;
use std::fs;

/// Extensions of the files that are read.
const READ: [&str; 6] = ["rs", "md", "py", "pyi", "ipynb", "xml"];

/// Words that must not occur in any letter case, and their replacements.
const WORDS: [(&str, &str); 13] = [
    ("attractor", "point-like emitter"),
    ("attractors", "point-like emitters"),
    ("cascade", "outlier rejection"),
    ("crowded", "overlapping"),
    ("endless", "non-terminating"),
    ("hindrance", "incompatibility"),
    ("lamp", "emitter, light"),
    ("lamps", "emitters, lights"),
    ("luck", "discovery probability, random search"),
    ("nudge", "ray epsilon"),
    ("outlook", "adjoint estimate, forecast"),
    ("prospects", "adjoint estimates"),
    ("veil", "partial transmission"),
];

/// Parts of names of types that must not occur in Rust, and their replacements. In prose, and in
/// lower case, these words are allowed.
const TYPES: [(&str, &str); 17] = [
    ("Account", "BalanceSums"),
    ("Beginning", "FirstVertexTechniques"),
    ("Books", "BalanceTotals"),
    ("Calm", "homogeneous"),
    ("Carry", "TransportMode"),
    ("Departures", "AdjointTraining"),
    ("Fork", "Split"),
    ("Landing", "end state"),
    ("Launch", "RayFamily"),
    ("Ledger", "ParticleBalance"),
    ("Link", "Connection"),
    ("Passage", "throughput"),
    ("Sets", "Replicates"),
    ("Shot", "Trajectory"),
    ("Station", "PathVertex"),
    ("Survey", "NeeTraining"),
    ("Tube", "EdgeGeometry"),
];

/// Returns the words of a line. Identifiers are divided at underscores, and where a capital follows
/// a small letter.
fn words(line: &str) -> Vec<&str> {
    let is_border = |line: &str, at: usize| {
        let (before, after) = line.split_at(at);
        before.ends_with(|c: char| c.is_lowercase())
            && after.starts_with(|c: char| c.is_uppercase())
    };
    let mut found = Vec::new();
    for part in line.split(|c: char| !c.is_alphabetic()) {
        let mut start = 0;
        for (at, _) in part.char_indices() {
            if is_border(part, at) {
                found.push(&part[start..at]);
                start = at;
            }
        }
        found.push(&part[start..]);
    }
    found
}

/// Returns the first forbidden word in a line, with its replacement; `code` is the Rust part.
fn old_word(line: &str, code: &str) -> Option<(&'static str, &'static str)> {
    let is_old = |word: &str| WORDS.iter().find(|(old, _)| word.eq_ignore_ascii_case(old));
    let anywhere = words(line).into_iter().find_map(is_old);
    let of_type = |word: &str| TYPES.iter().find(|(old, _)| word == *old);
    let named = || words(code).into_iter().find_map(of_type);
    anywhere.or_else(named).copied()
}

#[test]
fn words_are_split_at_borders() {
    let link = Some(("Link", "Connection"));
    for code in ["LinkKind", "Link", "RayLink", "my_Link"] {
        assert_eq!(old_word(code, code), link, "{code}");
    }
    assert_eq!(
        old_word("SLACK_PER_NUDGE", ""),
        Some(("nudge", "ray epsilon"))
    );
    for code in ["blink", "a link", "unveiled", "Linked"] {
        assert_eq!(old_word(code, code), None, "{code}");
    }
}

#[test]
fn old_words_stay_away() {
    let pages = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"];
    let mut files: Vec<_> = pages.iter().map(|page| root().join(page)).collect();
    for room in ["crates", "docs", "fuzz", "python", "scenes", "scripts"] {
        files.extend(below(&root().join(room), &READ));
    }
    files.retain(|path| !path.ends_with("tests/vocabulary.rs"));
    let mut found = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let is_rust = path.extension().is_some_and(|e| e == "rs");
        for (number, line) in text.lines().enumerate() {
            let before_comment = line.split("//").next().unwrap_or_default();
            let code = if is_rust { before_comment } else { "" };
            if let Some((old, new)) = old_word(line, code) {
                let place = path.strip_prefix(root()).unwrap().display();
                found.push(format!("{place}:{}: '{old}': write {new}", number + 1));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Returns the name of the public type that an unindented line declares.
fn public_type(line: &str) -> Option<&str> {
    let kinds = ["struct ", "enum ", "trait ", "type "];
    let rest = line.strip_prefix("pub ")?;
    let name = kinds.iter().find_map(|kind| rest.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric()).next()
}

#[test]
fn one_name_is_one_type() {
    assert_eq!(public_type("pub struct Arc<'a> {"), Some("Arc"));
    assert_eq!(public_type("pub(super) enum Curve {"), None);
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for library in ["eikonal", "optics", "transport", "formats", "io"] {
        for path in below(&root().join("crates").join(library).join("src"), &["rs"]) {
            let text = fs::read_to_string(&path).unwrap();
            for name in text.lines().filter_map(public_type) {
                let place = path.strip_prefix(root()).unwrap().display().to_string();
                places.entry(name.to_string()).or_default().push(place);
            }
        }
    }
    assert!(places.len() > 200, "types are not found");
    places.retain(|_, places| places.len() > 1);
    assert!(places.is_empty(), "{places:#?}");
}
