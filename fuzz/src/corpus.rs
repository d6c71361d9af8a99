//! Corpora from which the fuzzer makes inputs: small files of the tests, files of `fuzz/corpus`,
//! and generated files.

use crate::targets::Target;
use std::path::{Path, PathBuf};

/// Size of the longest file that the corpus includes, in bytes.
const MAX_FILE_SIZE: u64 = 20_000;

/// Returns the corpus of a target, always in the same order.
pub fn of(target: &Target) -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths = files(&root.join("fuzz/corpus").join(target.name));
    for folder in ["volumes", "meshes", "images", "json", "hostile"] {
        let all = files(&root.join("crates/io/tests/data").join(folder));
        let is_its = |path: &PathBuf| {
            let extension = path.extension().and_then(|e| e.to_str());
            extension.is_some_and(|e| target.extensions.contains(&e))
        };
        paths.extend(all.into_iter().filter(is_its));
    }
    let mut corpus: Vec<Vec<u8>> = paths.iter().filter_map(|p| std::fs::read(p).ok()).collect();
    corpus.extend((target.written)());
    assert!(!corpus.is_empty(), "{} has no corpus", target.name);
    corpus
}

/// Returns the small files of a folder, sorted by name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let small = entries.filter(|e| {
        e.metadata()
            .is_ok_and(|m| m.is_file() && m.len() <= MAX_FILE_SIZE)
    });
    let mut paths: Vec<PathBuf> = small.map(|e| e.path()).collect();
    paths.sort();
    paths
}
