//! `morgana info`.

use crate::support::Folder;

#[test]
fn describes_what_is_in_a_scene() {
    let text = Folder::with_lens().succeed("info scene.xml");
    for part in [
        "8 × 6, R G B",
        "4 samples per pixel, integrator auto",
        "perspective at (0, 0, -4), in 'ambient' (n = 1)",
        "constant     found by connections and by random walks: complete",
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
fn says_where_mitsuba_renders_otherwise() {
    let folder = Folder::with_scene(r#"<shape type="sphere"><bsdf type="dielectric"/></shape>"#);
    for command in ["check scene.xml", "render scene.xml --spp 1"] {
        let told = folder.run(command).stderr;
        assert!(
            told.contains("note: not as in Mitsuba 3 (ext_ior): "),
            "{told}"
        );
        assert!(told.contains("docs/mitsuba.md"), "{told}");
    }
    let told = folder.succeed("info scene.xml");
    assert!(told.contains("(ext_ior)"), "{told}");
    let quiet = folder.run("render scene.xml --spp 1 --quiet").stderr;
    assert_eq!(quiet, "");
}

#[test]
fn shows_extinction_and_albedo() {
    let text = Folder::with_fog().succeed("info scene.xml");
    assert!(text.contains("extinction 0.5 per unit length"), "{text}");
    assert!(text.contains("albedo     0.9"), "{text}");
}

#[test]
fn says_what_finds_an_emitter() {
    let glass = r#"<shape type="sphere"><bsdf type="dielectric"/></shape>"#;
    let light = r#"<emitter type="point"><point name="position" value="0, 3, 0"/>
        <float name="intensity" value="1"/></emitter>"#;
    let metal = r#"<shape type="cube"><transform name="to_world"><translate y="-5"/></transform>
        <bsdf type="conductor"/></shape>"#;
    let path = r#"<integrator type="path"/>"#;
    let bdpt = r#"<integrator type="bdpt"><integer name="reflections" value="2"/></integrator>"#;
    let of = |things: &[&str]| Folder::with_scene(&things.concat()).succeed("info scene.xml");
    for (things, expected) in [
        (
            &[light, path][..],
            "point        found by connections, along all branches: complete",
        ),
        (
            &[light, glass, path],
            "complete but for light that is reflected partially on its way from the emitter",
        ),
        (
            &[light, glass, bdpt],
            "found from both ends: complete but for light that is reflected partially more than 2 times on every",
        ),
        (
            // A scene that names none is rendered by the one that finds the most.
            &[light, glass],
            "found from both ends: complete but for light that is reflected partially on every",
        ),
        (
            &[light, glass, metal, path],
            "reflected by mirrors or partially on its way",
        ),
        (
            &[glass, bdpt],
            "branches     through up to 2 partial reflections, 5 with total ones",
        ),
    ] {
        let text = of(things);
        assert!(text.contains(expected), "{expected}\n{text}");
        assert!(text.contains("constant     found by connections and by random walks: complete"));
    }
}

#[test]
fn json_says_what_the_text_says() {
    let folder = Folder::with_lens();
    let text = folder.succeed("info scene.xml");
    let info: serde_json::Value =
        serde_json::from_str(&folder.succeed("info scene.xml --json")).unwrap();
    assert!(text.contains(info["hash"].as_str().unwrap()));
    assert_eq!(info["film"]["width"], 8);
    assert_eq!(info["channels"], serde_json::json!(["R", "G", "B"]));
    assert_eq!(
        (&info["samples"], &info["integrator"]),
        (&4.into(), &"auto".into())
    );
    assert_eq!(info["sensor"]["type"], "perspective");
    assert_eq!(
        info["sensor"]["position"],
        serde_json::json!([0.0, 0.0, -4.0])
    );
    assert_eq!(info["meters"], serde_json::json!([]));
    assert_eq!(info["emitters"][0]["type"], "constant");
    assert_eq!(info["emitters"][0]["complete"], true);
    let media = info["media"].as_array().unwrap();
    let glass = media.iter().find(|m| m["name"] == "glass").unwrap();
    assert!((glass["index"]["max"].as_f64().unwrap() - 2f64.sqrt()).abs() < 1e-6);
    assert_eq!(
        (&glass["constant"], &glass["unique_branches"]),
        (&false.into(), &false.into())
    );
    let steps = glass["steps_across"].as_f64().unwrap();
    assert!((1.0..100.0).contains(&steps), "{steps}");
    assert!(glass["extinction"].is_null());
    let topics = info["differences"].as_array().unwrap();
    assert!(topics.iter().any(|d| d["topic"] == "border"), "{topics:?}");
    let fog = Folder::with_fog().succeed("info scene.xml --json");
    let fog: serde_json::Value = serde_json::from_str(&fog).unwrap();
    let medium = fog["media"]
        .as_array()
        .unwrap()
        .iter()
        .find(|m| m["name"] == "fog")
        .unwrap();
    assert_eq!(
        medium["extinction"],
        serde_json::json!({ "min": 0.5, "max": 0.5 })
    );
    assert_eq!(medium["albedo"]["max"], 0.9);
    assert_eq!(medium["unique_branches"], true);
}
