//! Overlapping shapes, meshes without area, and their messages.

use morgana_io::{LoadOptions, Loaded, Severity};

fn load(contents: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("flat.obj"), flat).unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="volpath"/><sensor type="perspective">
             <transform name="to_world"><lookat origin="0,0,9" target="0,0,0" up="0,1,0"/></transform>
             <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
           <emitter type="constant"/>{contents}</scene>"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|e| e.to_string())
}

/// Returns the messages of a severity.
fn said(loaded: &Loaded, severity: Severity) -> Vec<String> {
    let messages = loaded.warnings.iter();
    let messages = messages.filter(|d| d.severity == severity);
    messages.map(|d| d.message.clone()).collect()
}

#[test]
fn a_mesh_without_area_is_left_out() {
    let flat =
        r#"<shape type="obj" id="flat"><string name="filename" value="flat.obj"/>MORE</shape>"#;
    for more in ["", "<emitter type='area'/>", "<bsdf type='dielectric'/>"] {
        let scene = format!("<shape type='sphere'/>{}", flat.replace("MORE", more));
        let loaded = load(&scene).unwrap();
        assert_eq!(loaded.scene().objects().len(), 1);
        let warnings = said(&loaded, Severity::Warning);
        let expected = "the mesh 'flat' has no triangle of positive area and is left out";
        assert!(warnings.iter().any(|w| w == expected), "{warnings:?}");
    }
    // A meter on it would read nothing.
    let metered = flat.replace("MORE", "<sensor type='irradiancemeter'/>");
    let error = load(&metered).unwrap_err();
    assert!(
        error.contains("needs a triangle of positive area"),
        "{error}"
    );
}

fn glass(id: &str, x: f64, radius: f64, outer: &str) -> String {
    format!(
        r#"<shape type="sphere" id="{id}"><point name="center" x="{x}" y="0" z="0"/><float name="radius" value="{radius}"/>
             <bsdf type="dielectric"><float name="int_ior" value="1.5"/>{outer}</bsdf></shape>"#
    )
}

/// Spheres that overlap deeply, only at the rim, or completely, each with the surrounding index of
/// air, as exporters write it. The scene equals the scene without this index. A warning names both
/// spheres, or a note if only the rims overlap.
#[test]
fn glass_with_air_around_may_overlap() {
    let outer = r#"<float name="ext_ior" value="1"/>"#;
    for (b, radius) in [(1.0, 1.0), (1.8, 1.0), (0.0, 0.6)] {
        let scene = |outer| glass("a", 0.0, 1.0, outer) + &glass("b", b, radius, outer);
        let (with, without) = (load(&scene(outer)).unwrap(), load(&scene("")).unwrap());
        let indices = |l: &Loaded| {
            let media = l.scene().media().iter();
            let indices = media.map(|m| m.index.n(glam::DVec3::ZERO));
            indices.collect::<Vec<_>>()
        };
        assert_eq!(indices(&with), indices(&without));
        let says = |severity, words: &[&str]| {
            let messages = said(&with, severity);
            let all = |m: &&String| words.iter().all(|word| m.contains(word));
            assert_eq!(messages.iter().filter(all).count(), 1, "{b}: {messages:?}");
        };
        if b < 1.5 {
            says(Severity::Warning, &["'a'", "'b'", "ext_ior 1 ", "as 1.5"]);
        }
        if b > 0.0 {
            says(Severity::Note, &["'a'", "'b'", "overlap"]);
        }
    }
    // Separate spheres give no message.
    let apart = glass("a", 0.0, 1.0, outer) + &glass("b", 3.0, 1.0, outer);
    let loaded = load(&apart).unwrap();
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
}

fn cube(id: &str, z: f64, size: f64) -> String {
    format!(
        r#"<shape type="cube" id="{id}"><transform name="to_world"><scale value="{size}"/><translate z="{z}"/></transform>
             <bsdf type="null"/><medium name="interior" type="homogeneous"><float name="sigma_t" value="1"/></medium></shape>"#
    )
}

/// Overlapping media give a note with the rule; nested, touching and separate ones give none.
#[test]
fn overlapping_media_draw_a_note() {
    let notes = |scene: &str| said(&load(scene).unwrap(), Severity::Note);
    let in_order = |first: &str, second: &str, scene: String| {
        let notes = notes(&scene);
        assert_eq!(notes.len(), 1, "{notes:?}");
        let at = |id: &str| notes[0].find(&format!("'{id}'")).unwrap();
        assert!(at(first) < at(second), "{notes:?}");
        assert!(notes[0].contains("overlap"), "{notes:?}");
    };
    in_order("a", "b", cube("a", 0.25, 0.5) + &cube("b", -0.25, 0.5));
    in_order("b", "a", cube("a", 0.25, 0.5) + &cube("b", -0.25, 0.4));
    in_order("a", "b", cube("a", 0.25, 0.4) + &cube("b", -0.25, 0.5));
    for (z, size) in [
        (-0.75, 0.5),
        (0.25, 0.3),
        (-2.0, 0.5),
        (0.35, 0.4),
        (0.25, 1.0),
    ] {
        let scene = cube("a", 0.25, 0.5) + &cube("b", z, size);
        assert_eq!(notes(&scene), [""; 0], "{z} {size}");
    }
}
