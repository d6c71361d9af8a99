//! `morgana completions` and `morgana man`.

use crate::support::Folder;

#[test]
fn completions_know_the_commands() {
    let folder = Folder::with_scene("");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = folder.succeed(&format!("completions {shell}"));
        for word in ["render", "compare", "target-error"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    folder.refuse("completions dos");
}

#[test]
fn every_command_has_a_page() {
    let folder = Folder::with_scene("");
    std::fs::create_dir(folder.path("man")).unwrap();
    folder.succeed("man man");
    for name in ["morgana", "morgana-render", "morgana-plot-slice"] {
        let page = String::from_utf8(folder.read(&format!("man/{name}.1"))).unwrap();
        assert!(page.contains(".SH NAME"), "{page}");
    }
    let render = String::from_utf8(folder.read("man/morgana-render.1")).unwrap();
    assert!(render.contains("luneburg_fog"), "the example of the help");
    let outcome = folder.run("man gone");
    assert!(
        outcome.status == Some(1) && outcome.stderr.contains("'gone'"),
        "{outcome:?}"
    );
}
