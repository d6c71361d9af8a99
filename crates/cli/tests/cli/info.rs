//! `morgana info`.

use crate::support::Folder;

#[test]
fn describes_what_is_in_a_scene() {
    let text = Folder::with_lens().succeed("info scene.xml");
    for part in [
        "8 × 6, R G B",
        "4 samples per pixel, integrator path",
        "perspective at (0, 0, -4), in 'ambient' (n = 1)",
        "constant     found by connections and by chance: complete",
        "glass",
        "1.4142 (bounds)",
        "not certified",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn shows_warnings_with_their_place() {
    let folder = Folder::with_scene(
        r#"<shape type="sphere"><bsdf type="null"/>
             <medium type="transparent" name="interior"><float name="ior" value="1.5"/></medium>
           </shape>"#,
    );
    let text = folder.succeed("info scene.xml");
    assert!(
        text.contains("warning: ") && text.contains("--> scene.xml:"),
        "{text}"
    );
    assert!(text.contains("index      1.5: straight rays"), "{text}");
}

#[test]
fn shows_extinction_and_albedo() {
    let text = Folder::with_fog().succeed("info scene.xml");
    assert!(text.contains("extinction 0.5 per unit length"), "{text}");
    assert!(text.contains("albedo     0.9"), "{text}");
}
