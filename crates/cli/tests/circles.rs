//! Imports within a folder run one way: modules form no circles, except those that ARCHITECTURE.md
//! gives a reason for.

mod sources;

use sources::{below, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Allowed circles, as folder and modules.
const ALLOWED: &[(&str, &[&str])] = &[
    // The smoothing solver works on the prefilter's lines.
    ("eikonal/field/bspline", &["prefilter", "smooth"]),
    // Values may be transforms, which consist of values.
    ("io/json", &["transforms", "values"]),
    // Nodes hold values; masks of values are masks of nodes.
    ("formats/volume/vdb", &["tree", "values"]),
    // A scene returns its fields, and a field keeps its scene.
    ("python", &["field", "scene"]),
    // Errors state the limits of roughness, and microfacets report these errors.
    ("optics/bsdf", &["error", "microfacet"]),
    // Splatting samples are divided among strategies, and the films of strategies receive splats.
    ("transport/render", &["splats", "strategies"]),
    // Even points and random numbers share a hash.
    ("optics/sampling", &["points", "sampler"]),
];

type Module = Vec<String>;
/// Imports among the modules of each folder.
type Arrows = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// Returns the path of a file's module in its crate.
fn module(file: &Path) -> Module {
    let path = file.with_extension("");
    let parts = path
        .iter()
        .map(|part| part.to_str().unwrap().to_owned())
        .collect::<Vec<_>>();
    match parts.last().map(String::as_str) {
        Some("mod" | "lib" | "main") => parts[..parts.len() - 1].to_vec(),
        _ => parts,
    }
}

/// Returns the source without comments and without the text after `#[cfg(test)]`.
fn code(text: &str) -> String {
    let lines = text
        .lines()
        .take_while(|line| line.trim() != "#[cfg(test)]");
    let bare = lines.map(|line| line.split("//").next().unwrap_or(""));
    bare.collect::<Vec<_>>().join(" ")
}

/// Returns the modules that a source names by `crate::` or `super::`, including members of braces.
fn named(code: &str, module: &Module) -> Vec<Module> {
    let mut found = Vec::new();
    for (at, _) in code
        .match_indices("crate::")
        .chain(code.match_indices("super::"))
    {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let mut rest = &code[at..];
        let mut path = Vec::new();
        if let Some(after) = rest.strip_prefix("crate::") {
            rest = after;
        } else {
            path.clone_from(module);
            while let Some(after) = rest.strip_prefix("super::") {
                path.pop();
                rest = after;
            }
        }
        members(&path, rest, &mut found);
    }
    found
}

/// Adds the paths that begin with `path` and continue with `rest`: a name, or names in braces.
fn members(path: &Module, rest: &str, found: &mut Vec<Module>) {
    let rest = rest.trim_start();
    if let Some(inner) = rest.strip_prefix('{') {
        let mut depth = 0;
        let mut start = 0;
        for (i, c) in inner.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    members(path, &inner[start..i], found);
                    start = i + 1;
                    if c == '}' {
                        return;
                    }
                }
                _ => {}
            }
        }
        return;
    }
    let end = rest
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(rest.len());
    let mut longer = path.clone();
    longer.push(rest[..end].to_owned());
    match rest[end..].strip_prefix("::") {
        Some(more) => members(&longer, more, found),
        None => found.push(longer),
    }
}

/// Returns the imports within the folders of a crate.
fn arrows(root: &Path) -> Arrows {
    let files: Vec<PathBuf> = below(root, &["rs"]);
    let local = |file: &PathBuf| module(file.strip_prefix(root).unwrap());
    let modules: BTreeSet<Module> = files.iter().map(local).collect();
    let mut arrows = Arrows::new();
    for file in &files {
        let from = local(file);
        for to in named(&code(&fs::read_to_string(file).unwrap()), &from) {
            let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            let (Some(source), Some(target)) = (from.get(common), to.get(common)) else {
                continue;
            };
            if modules.contains(&to[..=common]) {
                let folder = arrows.entry(from[..common].join("/")).or_default();
                folder
                    .entry(source.clone())
                    .or_default()
                    .insert(target.clone());
            }
        }
    }
    arrows
}

/// Returns all modules that can be reached from a module along at least one import.
fn reached(from: &str, arrows: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    let mut open = vec![from.to_owned()];
    while let Some(next) = open.pop() {
        for to in arrows.get(&next).into_iter().flatten() {
            if all.insert(to.clone()) {
                open.push(to.clone());
            }
        }
    }
    all
}

/// Returns the circles of a crate: the folder, and the modules that reach one another.
fn circles(name: &str, root: &Path) -> BTreeSet<(String, Vec<String>)> {
    let mut found = BTreeSet::new();
    for (folder, arrows) in arrows(root) {
        for module in arrows.keys() {
            let around = reached(module, &arrows);
            let back = |other: &&String| reached(other, &arrows).contains(module);
            if around.contains(module) {
                let circle = around.iter().filter(back).cloned().collect();
                let place = format!("{name}/{folder}");
                found.insert((place.trim_end_matches('/').to_owned(), circle));
            }
        }
    }
    found
}

#[test]
fn imports_within_folders_make_no_circles() {
    let mut found = BTreeSet::new();
    for name in [
        "eikonal",
        "optics",
        "transport",
        "formats",
        "io",
        "cli",
        "python",
        "testkit",
    ] {
        found.extend(circles(name, &root().join("crates").join(name).join("src")));
    }
    let allowed: BTreeSet<_> = ALLOWED
        .iter()
        .map(|(folder, modules)| {
            let modules = modules.iter().map(ToString::to_string).collect();
            (folder.to_string(), modules)
        })
        .collect();
    let new: Vec<_> = found.difference(&allowed).collect();
    let gone: Vec<_> = allowed.difference(&found).collect();
    assert!(
        new.is_empty() && gone.is_empty(),
        "new: {new:#?}\ngone: {gone:#?}"
    );
}

#[test]
fn paths_in_braces_are_told_apart() {
    let module = ["a", "b"].map(String::from).to_vec();
    let code = "use super::{c, d::{E, f}}; use crate::g::H; fn x() { super::super::i::j() }";
    let named: Vec<String> = named(code, &module).iter().map(|p| p.join("/")).collect();
    assert_eq!(named, ["g/H", "a/c", "a/d/E", "a/d/f", "i/j"]);
}
