//! Code and theory cite each other: sources cite sections of docs/theory.md by anchor, and the sections name their code by path and
//! item, as docs/symbols.md does. Nothing is cited by number, so that a section can move without a citation becoming false.

mod sources;

use sources::{below, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// Files that may cite the theory.
const CITING: [&str; 6] = ["rs", "md", "py", "pyi", "ipynb", "toml"];

/// Words that declare the name after them.
const DECLARES: [&str; 9] = [
    "fn", "let", "struct", "enum", "trait", "type", "const", "static", "mod",
];

fn theory() -> String {
    fs::read_to_string(root().join("docs/theory.md")).unwrap()
}

/// The files that may cite the theory: sources, tests, scripts, Python and documents.
fn citing() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for room in ["crates", "docs", "fuzz", "python", "scripts"] {
        found.extend(below(&root().join(room), &CITING));
    }
    for page in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"] {
        found.push(root().join(page));
    }
    found
}

/// A section of the theory: the anchor that GitHub gives its heading, and its text up to the next heading.
struct Section<'a> {
    anchor: String,
    text: &'a str,
}

fn sections(theory: &str) -> Vec<Section<'_>> {
    let starts: Vec<usize> = theory.match_indices("\n#").map(|(at, _)| at + 1).collect();
    let ends = starts.iter().skip(1).copied().chain([theory.len()]);
    let section = |(&start, end): (&usize, usize)| {
        let (heading, text) = theory[start..end].split_once('\n').unwrap();
        Section {
            anchor: anchor(heading.trim_start_matches('#').trim()),
            text,
        }
    };
    starts.iter().zip(ends).map(section).collect()
}

/// The anchor of a heading: lower case, hyphens for spaces, no punctuation.
fn anchor(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    let lower = heading.to_lowercase();
    lower
        .chars()
        .filter(kept)
        .collect::<String>()
        .replace(' ', "-")
}

/// The anchors that follow a prefix in a text.
fn cited<'a>(text: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    let in_anchor = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    text.split(prefix)
        .skip(1)
        .map(move |rest| &rest[..rest.find(|c| !in_anchor(c)).unwrap_or(rest.len())])
        .filter(|anchor| !anchor.is_empty())
}

/// The code spans of a text.
fn spans(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Whether a source declares an item, as `name` or `Type::name`: a declaration, a field or a variant of that name, and the other words
/// somewhere in the code.
fn declares(source: &str, item: &str) -> bool {
    let (scope, name) = item.rsplit_once("::").unwrap_or(("", item));
    let lines = || {
        source
            .lines()
            .map(|line| line.split("//").next().unwrap_or(""))
    };
    let mentions = |word: &str| lines().any(|line| words(line).any(|w| w == word));
    lines().any(|line| is_declaration(line, name))
        && scope.split("::").filter(|s| !s.is_empty()).all(mentions)
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_alphanumeric() && c != '_')
        .filter(|word| !word.is_empty())
}

fn is_declaration(line: &str, name: &str) -> bool {
    let declared = words(line)
        .zip(words(line).skip(1))
        .any(|(before, word)| word == name && DECLARES.contains(&before));
    let line = line.trim_start();
    let visible = ["pub ", "pub(crate) ", "pub(super) "];
    let member = visible.iter().find_map(|v| line.strip_prefix(v));
    let member = member.unwrap_or(line).strip_prefix(name);
    declared || member.is_some_and(|rest| [":", ",", "(", " {"].iter().any(|s| rest.starts_with(s)))
}

/// A text without line breaks and marks of comments.
fn in_one_line(text: &str) -> String {
    let marks = ['/', '!', '#', ' ', '\t'];
    let lines = text.lines().map(|line| line.trim_start_matches(marks));
    lines.collect::<Vec<_>>().join(" ").to_lowercase()
}

/// What follows the word "theory" where it is cited by number.
fn is_number(after: &str) -> bool {
    let after = after
        .trim_start_matches(".md")
        .trim_start_matches([' ', ',', '(', ':']);
    ["§", "eq.", "equation", "section", "chapter"]
        .iter()
        .any(|s| after.starts_with(s))
        || after.starts_with(|c: char| c.is_ascii_digit())
}

#[test]
fn headings_have_anchors_of_their_own_and_no_numbers() {
    let theory = theory();
    let mut known = BTreeSet::new();
    for section in sections(&theory) {
        let anchor = section.anchor;
        assert!(
            !anchor.starts_with(|c: char| c.is_ascii_digit()),
            "{anchor}"
        );
        assert!(known.insert(anchor.clone()), "two headings are {anchor}");
    }
}

#[test]
fn cited_anchors_exist() {
    let theory = theory();
    let known: BTreeSet<String> = sections(&theory).into_iter().map(|s| s.anchor).collect();
    let mut count = 0;
    for path in citing() {
        let text = fs::read_to_string(&path).unwrap();
        for anchor in cited(&text, "theory.md#") {
            assert!(
                known.contains(anchor),
                "{}: no heading {anchor}",
                path.display()
            );
            count += 1;
        }
    }
    for anchor in cited(&theory, "](#") {
        assert!(
            known.contains(anchor),
            "docs/theory.md: no heading {anchor}"
        );
    }
    assert!(count > 50, "only {count} citations found");
}

/// The equations in LaTeX: between double dollars on separate lines, or between single dollars in a line.
fn latex(theory: &str) -> Vec<String> {
    let theory = theory.replace("$$", "$");
    let parts: Vec<&str> = theory.split('$').collect();
    assert!(parts.len() % 2 == 1, "an equation has no end");
    let equations = parts.into_iter().skip(1).step_by(2);
    equations.map(str::to_string).collect()
}

/// The labels of equations, such as (transfer) for `\tag{transfer}`.
fn labels(theory: &str) -> BTreeSet<String> {
    let mut known = BTreeSet::new();
    for equation in theory.split("\n$$\n").skip(1).step_by(2) {
        let mut tags = equation.split("\\tag{").skip(1);
        let Some(tag) = tags.next() else { continue };
        let label = tag.strip_suffix('}').expect("a tag ends its equation");
        assert!(known.insert(format!("({label})")), "two equations: {label}");
        assert_eq!(tags.next(), None, "{label} has another label");
    }
    known
}

/// GitHub takes a backslash before punctuation for an escape, an underscore after punctuation for emphasis, and a bar in a table for the
/// end of a cell.
#[test]
fn equations_survive_markdown() {
    for equation in latex(&theory()) {
        let pairs = equation.chars().zip(equation.chars().skip(1));
        for (first, second) in pairs {
            let is_escape = first == '\\' && !second.is_alphabetic();
            let is_emphasis = second == '_' && !first.is_alphanumeric();
            assert!(!is_escape && !is_emphasis, "{first}{second} in {equation}");
        }
        assert!(!equation.contains(['*', '|', '<', '>']), "{equation}");
    }
}

#[test]
fn cited_equations_exist() {
    let theory = theory();
    let known = labels(&theory);
    let is_number = |label: &&String| label.trim_matches(['(', ')']).parse::<f64>().is_ok();
    assert_eq!(known.iter().find(is_number), None, "labels are names");
    assert!(known.len() > 50, "only {} labels found", known.len());
    for path in citing() {
        let text = fs::read_to_string(&path).unwrap();
        for rest in text.split("eq.").filter_map(|rest| rest.strip_prefix(" (")) {
            let label = format!("({})", rest.split(')').next().unwrap());
            let place = path.display();
            assert!(known.contains(&label), "{place}: no equation {label}");
        }
    }
}

#[test]
fn nothing_is_cited_by_number() {
    for path in citing() {
        let text = in_one_line(&fs::read_to_string(&path).unwrap());
        for (at, word) in text.match_indices("theory") {
            let after = &text[at + word.len()..];
            let shown: String = after.chars().take(30).collect();
            assert!(!is_number(after), "{}: theory{shown}", path.display());
        }
    }
    let theory = in_one_line(&theory());
    assert!(!theory.contains('§'));
    for after in theory.split("section ").skip(1) {
        assert!(
            !after.starts_with(|c: char| c.is_ascii_digit()),
            "section {after:.20}"
        );
    }
}

/// The sources that a text names as `path` or `path::item`, each of which must exist.
fn sources_named(place: &str, text: &str) -> Vec<String> {
    let mut sources = Vec::new();
    for span in spans(text).filter(|span| span.starts_with("crates/")) {
        let (path, item) = span.split_once("::").unwrap_or((span, ""));
        let file = root().join(path);
        assert!(file.is_file(), "{place}: no file {path}");
        let source = fs::read_to_string(file).unwrap();
        let found = item.is_empty() || declares(&source, item);
        assert!(found, "{place}: no {item} in {path}");
        sources.push(source);
    }
    sources
}

#[test]
fn code_that_the_theory_names_exists() {
    let theory = theory();
    for section in sections(&theory) {
        let place = &section.anchor;
        let sources = sources_named(place, section.text);
        for span in spans(section.text).filter(|span| !span.starts_with("crates/")) {
            assert!(!span.contains(".rs"), "{place}: {span} is no full path");
            let found = !span.contains("::") || sources.iter().any(|s| declares(s, span));
            assert!(found, "{place}: no file that it names has {span}");
        }
    }
}

#[test]
fn code_that_the_glossary_names_exists() {
    let symbols = fs::read_to_string(root().join("docs/symbols.md")).unwrap();
    let count = sources_named("docs/symbols.md", &symbols).len();
    assert!(count > 50, "only {count} names found");
}

/// The files in the line "Code:" of a section cite that section.
#[test]
fn code_cites_its_sections() {
    let theory = theory();
    for section in sections(&theory) {
        let lists = section
            .text
            .lines()
            .filter(|line| line.starts_with("Code:"));
        for span in lists.flat_map(spans) {
            let path = span.split("::").next().unwrap();
            let source = fs::read_to_string(root().join(path)).unwrap();
            let cites = cited(&source, "docs/theory.md#").any(|a| a == section.anchor);
            assert!(
                cites,
                "{path} does not cite docs/theory.md#{}",
                section.anchor
            );
        }
    }
}
