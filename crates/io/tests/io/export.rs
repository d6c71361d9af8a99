//! Export of scenes to XML of Mitsuba 3, and the files beside it.

use crate::common;
use morgana_io::features::{Features, missing};
use morgana_io::{Diagnostics, FileRegistry, SceneDescription, SpectrumValue, json, xml};
use std::fs;
use std::path::Path;

fn hash(scene: &SceneDescription) -> String {
    scene.hash(&FileRegistry::new()).unwrap().to_string()
}

fn written(scene: &SceneDescription) -> String {
    xml::write(scene).unwrap_or_else(|e| panic!("{e}"))
}

fn parsed(text: &str) -> SceneDescription {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics}\n{text}");
    scene.unwrap()
}

#[test]
fn every_example_scene_survives_the_round_trip() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let scenes = files.filter(|f| f.extension().is_some_and(|e| e == "xml"));
    let mut count = 0;
    for path in scenes {
        let mut diagnostics = Diagnostics::new();
        let scene = xml::load(&path, &[], &mut diagnostics).unwrap();
        let text = written(&scene);
        let again = parsed(&text);
        assert_eq!(hash(&again), hash(&scene), "{}\n{text}", path.display());
        assert_eq!(written(&again), text, "{}", path.display());
        count += 1;
    }
    assert!(count >= 9);
}

/// Tests values of all types, references, roles, texts with special characters, and objects in
/// several places.
#[test]
fn a_scene_of_everything_survives_the_round_trip() {
    let text = r##"<scene version="3.0.0">
<bsdf type="twosided" id="a &lt;b&gt; &quot;c&quot; &amp; d"><bsdf type="diffuse">
<rgb name="reflectance" value="0.1, 0.25, 1e-7"/></bsdf></bsdf>
<medium type="homogeneous" id="fog"><spectrum name="sigma_t" value="400:0.5, 700:1.25"/><float name="albedo" value="1"/>
<volume type="acoustic" name="ior"><integer name="order" value="2"/></volume></medium>
<shape type="sphere" id="ball"><point name="center" x="1" y="-2" z="0.1"/><float name="radius" value="1e10"/>
<boolean name="flip_normals" value="true"/><ref id="fog" name="interior"/><ref id="a &lt;b&gt; &quot;c&quot; &amp; d"/></shape>
<shape type="sphere"><ref id="a &lt;b&gt; &quot;c&quot; &amp; d"/><ref id="fog" name="exterior"/>
<emitter type="area"><spectrum name="radiance" type="blackbody"><float name="temperature" value="5000"/></spectrum></emitter>
<transform name="to_world"><rotate y="1" angle="30"/><translate x="3"/></transform></shape>
<emitter type="constant"><spectrum name="radiance" filename="sky.spd"/></emitter>
<emitter type="collimated"><vector name="v" x="0" y="0" z="1"/><string name="s" value=" two&#10;lines "/></emitter>
</scene>"##;
    let scene = parsed(text);
    let again = parsed(&written(&scene));
    assert_eq!(hash(&again), hash(&scene), "{}", written(&scene));
    assert_eq!(json::write(&again), json::write(&scene));
}

/// Scenes of Mitsuba 0.6 and dictionaries become equivalent scenes of Mitsuba 3.
#[test]
fn other_forms_become_mitsuba_3() {
    let mut diagnostics = Diagnostics::new();
    let old = r#"<scene version="0.6.0"><shape type="sphere"><transform name="toWorld"><scale value="2"/></transform>
<bsdf type="roughdielectric"><float name="intIOR" value="1.5"/><string name="distribution" value="as"/></bsdf></shape></scene>"#;
    let scene = xml::parse(old, "old.xml", &[], &mut diagnostics).unwrap();
    let text = written(&scene);
    for part in ["to_world", "int_ior", "\"beckmann\"", "version=\"3.0.0\""] {
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(hash(&parsed(&text)), hash(&scene));

    let dictionary = r#"{"type": "scene", "ball": {"type": "sphere", "radius": 2, "bsdf": {"type": "diffuse", "reflectance": 1}}}"#;
    let scene = json::parse(dictionary, "scene.json", &[], &mut diagnostics).unwrap();
    let text = written(&scene);
    // Mitsuba accepts no integers for real numbers.
    assert!(
        text.contains("<float name=\"radius\" value=\"2\"/>"),
        "{text}"
    );
    assert!(
        text.contains("<float name=\"reflectance\" value=\"1\"/>"),
        "{text}"
    );
    assert_eq!(hash(&parsed(&text)), hash(&scene));
}

#[test]
fn what_xml_cannot_hold_is_refused() {
    let mut diagnostics = Diagnostics::new();
    let dictionary = r#"{"type": "scene", "fog": {"type": "heterogeneous", "sigma_t": {"type": "gridvolume", "data": [[[1, 2]]]}}}"#;
    let scene = json::parse(dictionary, "scene.json", &[], &mut diagnostics).unwrap();
    let error = xml::write(&scene).unwrap_err().to_string();
    assert_eq!(
        error,
        "XML cannot hold an array as 'data' of {\"type\": \"gridvolume\"}"
    );
}

/// Neither language can escape `$`, and XML has no control characters.
#[test]
fn texts_that_would_be_read_otherwise_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut diagnostics = Diagnostics::new();
    let dictionary = r#"{"type": "scene", "ball": {"type": "sphere", "id": "a\u0001b"}}"#;
    let control = json::parse(dictionary, "scene.json", &[], &mut diagnostics).unwrap();
    let text = r#"<scene version="3.0.0"><default name="x" value="5$"/><emitter type="constant"><string name="s" value="$x"/></emitter></scene>"#;
    let dollar = parsed(text);
    for scene in [control, dollar] {
        for name in ["a.xml", "a.json"] {
            let path = folder.path().join(name);
            let error = morgana_io::write_scene(&scene, &path)
                .unwrap_err()
                .to_string();
            assert!(error.contains("which scene files cannot hold"), "{error}");
            assert!(!path.exists());
        }
    }
}

#[test]
fn files_are_named_as_the_new_folder_sees_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("scene/meshes")).unwrap();
    fs::create_dir_all(at("elsewhere")).unwrap();
    fs::create_dir_all(at("out")).unwrap();
    for name in ["scene/meshes/a.ply", "elsewhere/b.ply", "elsewhere/c.spd"] {
        fs::write(at(name), "").unwrap();
    }
    let text = r#"<scene version="3.0.0"><path value="../elsewhere"/>
<shape type="ply"><string name="filename" value="meshes/a.ply"/></shape>
<shape type="ply"><string name="filename" value="b.ply"/></shape>
<emitter type="constant"><spectrum name="radiance" filename="c.spd"/></emitter></scene>"#;
    fs::write(at("scene/scene.xml"), text).unwrap();
    let mut diagnostics = Diagnostics::new();
    let scene = xml::load(&at("scene/scene.xml"), &[], &mut diagnostics).unwrap();
    let moved = scene.relocated(&at("out")).unwrap();
    assert!(moved.folders.is_empty());
    let text = written(&moved);
    for name in [
        "../scene/meshes/a.ply",
        "../elsewhere/b.ply",
        "../elsewhere/c.spd",
    ] {
        assert!(text.contains(name), "{text}");
    }
    let same = written(&scene.relocated(&at("scene")).unwrap());
    assert!(same.contains("\"meshes/a.ply\""), "{same}");
    let file = SpectrumValue::File("../elsewhere/c.spd".into());
    let sky = &moved.root.children[2].object;
    assert_eq!(
        *common::value(sky, "radiance"),
        morgana_io::scene::Value::Spectrum(file)
    );
}

#[test]
fn features_tell_what_mitsuba_lacks() {
    let scene = parsed(
        r#"<scene version="3.0.0"><integrator type="bdpt"><float name="tolerance" value="1e-5"/></integrator>
<medium type="homogeneous" id="fog"><float name="sigma_t" value="1"/><volume type="luneburg" name="ior"/></medium>
<shape type="sphere"><ref id="fog" name="interior"/></shape><shape type="sphere"><ref id="fog" name="interior"/></shape></scene>"#,
    );
    let features = Features::of(&scene);
    let counts: Vec<String> = features
        .plugins
        .iter()
        .map(|((kind, plugin), count)| format!("{kind} {plugin} {count}"))
        .collect();
    assert_eq!(
        counts,
        [
            "integrator bdpt 1",
            "shape sphere 2",
            "medium homogeneous 1",
            "volume luneburg 1"
        ]
    );
    assert_eq!(
        features.own,
        [
            "'ior' of medium 'homogeneous'",
            "integrator 'bdpt'",
            "volume 'luneburg'"
        ]
    );
    let tagged = parsed(
        r#"<scene version="3.0.0"><integrator type="tagged"><float name="wavelength" value="1e-3"/></integrator>
<shape type="sphere"><sensor type="irradiancemeter"><boolean name="tagged" value="true"/><integer name="max_records" value="9"/></sensor></shape>
<sensor type="thinlens"><boolean name="diffraction" value="true"/></sensor></scene>"#,
    );
    assert_eq!(
        Features::of(&tagged).own,
        [
            "'diffraction' of sensor 'thinlens'",
            "'max_records' of sensor 'irradiancemeter'",
            "'tagged' of sensor 'irradiancemeter'",
            "integrator 'tagged'"
        ]
    );
}

/// Mitsuba accepts only extinction and albedo.
#[test]
fn scattering_and_absorption_become_extinction_and_albedo() {
    let scene = parsed(
        r#"<scene version="3.0.0"><shape type="sphere"><medium type="homogeneous" name="interior"><rgb name="sigma_s" value="0.5, 0.75, 0"/>
<float name="sigma_a" value="0.25"/></medium></shape><shape type="cube"><medium type="homogeneous" name="interior">
<float name="sigma_s" value="3"/><float name="sigma_a" value="1"/></medium></shape></scene>"#,
    );
    let exported = scene.with_extinctions();
    assert_eq!(Features::of(&exported).own, Vec::<String>::new());
    let text = written(&exported);
    for said in [
        r#"<rgb name="sigma_t" value="0.75, 1, 0.25"/>"#,
        r#"<rgb name="albedo" value="0.6666666666666666, 0.75, 0"/>"#,
        r#"<float name="sigma_t" value="4"/>"#,
        r#"<float name="albedo" value="0.75"/>"#,
    ] {
        assert!(text.contains(said), "{text}");
    }
}

#[test]
fn missing_counts_messages() {
    let messages = r#"<scene version="3.0.0"><shape type="spere"/><shape type="spere"/><bsdf type="difuse" id="d"/></scene>"#;
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(messages, "scene.xml", &[], &mut diagnostics).unwrap();
    let errors = morgana_io::assemble(&scene, &Default::default(), diagnostics).unwrap_err();
    let missing = missing(&errors);
    assert_eq!(missing[0], ("unknown shape type 'spere'".to_owned(), 2));
}
