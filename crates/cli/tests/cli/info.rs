//! `morgana info`.

use crate::support::Folder;
use serde_json::json;
use std::path::Path;

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
        "several rays may connect two points: renders search for them",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

/// Half of the light of a round aperture lies within 0.267 λ/(a/f) (Rayleigh): 0.0064 and 0.0096 of
/// this image.
#[test]
fn says_how_far_an_aperture_diffracts() {
    let scene = |diffraction: bool| {
        let film = json!({"type": "hdrfilm", "width": 100, "height": 50, "pixel_format": "spectral", "wavelengths": "600, 900"});
        let mut sensor =
            json!({"type": "thinlens", "fov": 1.432_394_5, "aperture_radius": 1, "film": film});
        if diffraction {
            sensor["diffraction"] = true.into();
            sensor["metres_per_unit"] = 1e-3.into();
        }
        json!({"type": "scene", "sensor": sensor, "sky": {"type": "constant"}}).to_string()
    };
    let folder = Folder::with_fog();
    std::fs::write(folder.path("scene.json"), scene(true)).unwrap();
    let text = folder.succeed("info scene.json");
    assert!(
        text.contains("half of the light within 0.64 to 0.96 pixels"),
        "{text}"
    );
    let told: serde_json::Value =
        serde_json::from_str(&folder.succeed("info scene.json --json")).unwrap();
    assert_eq!(told["sensor"]["diffraction"].as_array().unwrap().len(), 2);
    std::fs::write(folder.path("scene.json"), scene(false)).unwrap();
    let text = folder.succeed("info scene.json");
    assert!(!text.contains("diffraction"), "{text}");
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
        text.contains("warning[") && text.contains("--> scene.xml:"),
        "{text}"
    );
    assert!(text.contains("index      1.5: straight rays"), "{text}");
}

/// `--silence` omits the warnings of a check.
#[test]
fn silences_checks_by_name() {
    let folder = Folder::with_scene(r#"<medium type="homogeneous" id="m"/>"#);
    let silenced = "--silence unreferenced --silence differs_from_mitsuba";
    for command in ["check scene.xml", "render scene.xml --spp 1"] {
        let told = folder.run(command).stderr;
        assert!(told.contains("note[unreferenced]: "), "{told}");
        let told = folder.run(&format!("{command} {silenced}")).stderr;
        assert!(
            !told.contains("unreferenced") && !told.contains("Mitsuba"),
            "{told}"
        );
    }
    let told = folder.run("check scene.xml --silence unreferencd");
    assert_eq!(told.status, Some(2));
    assert!(
        told.stderr.contains("did you mean 'unreferenced'?"),
        "{}",
        told.stderr
    );
}

#[test]
fn differences_from_mitsuba_are_listed() {
    let folder = Folder::with_scene(r#"<shape type="sphere"><bsdf type="dielectric"/></shape>"#);
    let all = folder.run("check scene.xml").stderr;
    for topic in ["border", "ext_ior"] {
        let note = format!("note[differs_from_mitsuba]: not as in Mitsuba 3 ({topic}): ");
        assert!(all.contains(&note), "{all}");
    }
    assert!(all.contains("docs/mitsuba.md"), "{all}");
    let one = "note[differs_from_mitsuba]: differs from Mitsuba 3 in: border, ext_ior; `morgana check` explains";
    let told = folder.run("render scene.xml --spp 1").stderr;
    assert_eq!(told.trim(), one);
    let told = folder.succeed("info scene.xml");
    assert!(told.contains(one), "{told}");
    let quiet = folder.run("render scene.xml --spp 1 --quiet").stderr;
    assert_eq!(quiet, "");
    // Mitsuba cannot render a medium with an index: only `check` lists differences.
    let own = Folder::with_lens();
    assert_eq!(own.run("render scene.xml --spp 1").stderr, "");
    let all = own.run("check scene.xml").stderr;
    assert!(all.contains("not as in Mitsuba 3 (border): "), "{all}");
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
            "complete, except for light that is reflected partially on its way from the emitter",
        ),
        (
            &[light, glass, bdpt],
            "found from both ends: complete, except for light that is reflected partially more than 2 times on every",
        ),
        (
            // A scene that names no integrator uses the one that finds the most light.
            &[light, glass],
            "found from both ends: complete, except for light that is reflected partially on every",
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

/// Information on a time series states whether it comes from the file or the scene.
#[test]
fn shows_what_volumes_of_sound_are_made_of() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../io/tests/data/volumes/sound.h5");
    let of = |more: &str| {
        let folder = Folder::with_scene(&format!(
            r#"<shape type="cube"><bsdf type="dielectric"/><medium type="transparent" name="interior">
               <volume name="ior" type="pressure"><string name="filename" value="sound.h5"/>
               <string name="dataset" value="p"/><string name="axis_order" value="zyx"/>
               <float name="n0" value="1.33"/><float name="dn_dp" value="1e-10"/>{more}</volume></medium></shape>"#
        ));
        std::fs::copy(&data, folder.path("sound.h5")).unwrap();
        let json = folder.succeed("info scene.xml --json");
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        (folder.succeed("info scene.xml"), json["sounds"][0].clone())
    };
    let sound = r#"<float name="frequency" value="1e6"/><float name="sound_speed" value="1.5e3"/>"#;
    // Cells of 0.1, 0.2 and 0.3 mm from a file in metres, converted to millimetres.
    let millimetres = r#"<string name="placement" value="centers"/><boolean name="use_grid_bbox" value="true"/>
        <transform name="to_world"><scale value="1e3"/></transform>"#;
    let (text, json) = of(&format!("{sound}{millimetres}"));
    for line in [
        "pressure of sound.h5",
        "grid       2 × 3 × 4 (file)",
        "spacing    (0.1, 0.2, 0.3) scene units (file)",
        "origin     (0.05, 0.1, 0.15) (file)",
        "frequency  1.000e6 Hz (scene)",
        "time step  1.250e-7 s (file)",
        "frames     the last 8 of 28 (file)",
        "residual   0% of the pressure",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert_eq!(json["size"], json!({"value": [2, 3, 4], "from": "file"}));
    assert_eq!(json["series"]["used"], 8);
    assert!(json["series"]["residual"].as_f64().unwrap() < 1e-6);
    let nodes =
        r#"<string name="placement" value="nodes"/><float name="time_step" value="1.2e-7"/>"#;
    let (text, json) = of(&format!("{sound}{nodes}"));
    assert_eq!(
        json["spacing"],
        json!({"value": [1.0, 0.5, 1.0 / 3.0], "from": "scene"})
    );
    assert_eq!(json["origin"]["value"], json!([0.0, 0.0, 0.0]));
    assert_eq!(
        json["series"]["time_step"],
        json!({"value": 1.2e-7, "from": "scene"})
    );
    assert!(
        json["series"]["residual"].as_f64().unwrap() > 0.05,
        "{text}"
    );
    let frame = r#"<string name="placement" value="nodes"/><integer name="frame" value="3"/>"#;
    let (text, json) = of(frame);
    assert!(text.contains("frame      3 of 28 (file)"), "{text}");
    assert_eq!(
        (&json["frequency"], &json["series"]["residual"]),
        (&json!(null), &json!(null))
    );
}
