//! `morgana export` and `morgana check --mitsuba`.

use crate::support::Folder;

const OLD: &str = r#"<scene version="0.6.0"><default name="size" value="4"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$size"/><integer name="height" value="3"/></film></sensor>
<emitter type="constant"/><shape type="sphere"><transform name="toWorld"><translate z="4"/></transform></shape></scene>"#;

#[test]
fn an_exported_scene_renders_the_same() {
    let folder = Folder::with_file(OLD);
    let said = folder.succeed("export scene.xml -D size=5 -o new.xml");
    assert!(said.starts_with("new.xml: written"), "{said}");
    folder.succeed("export new.xml -o new.json");
    folder.succeed("render scene.xml -D size=5 --spp 2 -o a.npy");
    for other in ["new.xml", "new.json"] {
        folder.succeed(&format!("render {other} --spp 2 -o b.npy"));
        assert_eq!(folder.read("a.npy"), folder.read("b.npy"), "{other}");
    }
}

#[test]
fn what_mitsuba_lacks_is_noted() {
    let folder = Folder::with_lens();
    let outcome = folder.run("export scene.xml -o new.xml");
    assert!(
        outcome.stderr.contains("Mitsuba 3 does not have: "),
        "{}",
        outcome.stderr
    );
    assert!(
        outcome.stderr.contains("volume 'luneburg'"),
        "{}",
        outcome.stderr
    );
}

#[test]
fn exports_go_to_scene_files() {
    let folder = Folder::with_file(OLD);
    let refused = folder.refuse("export scene.xml -o new.exr");
    assert!(
        refused.contains("the name of a .xml or .json file"),
        "{refused}"
    );
    assert!(!folder.files().contains(&"new.exr".to_owned()));
}

#[test]
fn a_report_lists_features() {
    let folder = Folder::with_file(OLD);
    let report = folder.succeed("check --mitsuba scene.xml");
    for part in [
        "scene.xml: can be used",
        "supported:\n",
        "shape      sphere\n",
        "different from Mitsuba:\n",
        "sample_count: ",
    ] {
        assert!(report.contains(part), "{part:?} in {report}");
    }
    let folder = Folder::with_file(&OLD.replace("\"sphere\"", "\"spheer\""));
    let report = folder.output(2, "check --mitsuba scene.xml");
    assert!(
        report.contains("missing:\n  unknown shape type 'spheer'\n"),
        "{report}"
    );
}
