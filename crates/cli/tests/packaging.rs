//! Names and versions of what releases publish: the archives, and the conda package.

use std::fs;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .unwrap()
}

fn text(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap()
}

/// Returns the rest of the first line that begins with `key`, without quotes.
fn value(text: &str, key: &str) -> String {
    let line = text.lines().find_map(|line| line.trim().strip_prefix(key));
    let line = line.unwrap_or_else(|| panic!("no line '{key}'"));
    line.trim_matches([' ', '=', '"']).to_owned()
}

#[test]
fn binstall_finds_the_archives_of_the_workflow() {
    let workflow = text(".github/workflows/release.yml");
    let manifest = text("crates/cli/Cargo.toml");
    // The workflow packs a tag v0.2.0 as morgana-v0.2.0-TARGET/morgana in morgana-v0.2.0-TARGET.tar.gz.
    let folder = value(&workflow, "folder");
    assert_eq!(
        folder,
        "morgana-${GITHUB_REF_NAME//\\//-}-${{ matrix.target }}"
    );
    assert!(workflow.contains("tar czf \"$folder.tar.gz\" \"$folder\""));
    let name = "morgana-v{ version }-{ target }";
    let url = format!("{{ repo }}/releases/download/v{{ version }}/{name}.tar.gz");
    assert_eq!(value(&manifest, "pkg-url"), url);
    assert_eq!(value(&manifest, "pkg-fmt"), "tgz");
    assert_eq!(
        value(&manifest, "bin-dir"),
        format!("{name}/{{ bin }}{{ binary-ext }}")
    );
}

#[test]
fn versions_agree() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(
        value(&text("packaging/conda/recipe.yaml"), "version:"),
        version
    );
    assert_eq!(value(&text("CITATION.cff"), "version:"), version);
}

/// The images copy everything that the build needs: all members of the workspace.
#[test]
fn images_have_all_sources() {
    let apptainer = text("packaging/morgana.def");
    for part in [
        "Cargo.toml",
        "Cargo.lock",
        "pyproject.toml",
        "crates",
        "fuzz",
        "python",
    ] {
        assert!(root().join(part).exists(), "{part}");
        assert!(
            apptainer.contains(&format!("{part} ")),
            "{part} in morgana.def"
        );
        let ignored = text(".dockerignore");
        assert!(
            !ignored.lines().any(|line| line == part),
            "{part} in .dockerignore"
        );
    }
}
