//! `morgana render` for scenes with meters in place of a camera.

use crate::support::Folder;

/// A ball of haze in a beam, with a meter inside and one far away.
fn folder(meters: &str) -> Folder {
    Folder::with_file(&format!(
        r#"<scene version="3.0.0">
  <default name="power" value="1"/>
  <integrator type="particle"/>
  <shape type="sphere"><bsdf type="null"/>
    <medium type="homogeneous" name="interior">
      <float name="sigma_t" value="2"/><float name="albedo" value="0.8"/>
    </medium>
    <sensor type="irradiancemeter" id="skin"/>
  </shape>
  <emitter type="collimated">
    <transform name="to_world"><translate z="-2"/></transform>
    <float name="radius" value="0.3"/><float name="power" value="$power"/>
  </emitter>
  {meters}
</scene>"#
    ))
}

const TANK: &str = r#"<sensor type="fluencemeter" id="tank">
    <string name="coordinates" value="spherical"/><integer name="nr" value="4"/>
  </sensor>"#;

/// `--memory` limits the memory of meters as it does for films.
#[test]
fn meters_keep_within_the_memory() {
    let folder = folder(&TANK.replace("\"4\"", "\"1000\""));
    for command in ["check scene.xml", "render scene.xml --particles 64"] {
        let error = folder.refuse(&format!("{command} --memory 1K"));
        assert!(error.contains("more than the limit of 1.0 KiB"), "{error}");
        folder.succeed(&format!("{command} --memory 1M"));
    }
    folder.succeed("render scene.xml --particles 64 --shard 0/1 -o a.part");
    let error = folder.refuse("merge a.part -o b.npz --memory 1K");
    assert!(error.contains("more than the limit of 1.0 KiB"), "{error}");
    let error = folder.refuse("merge a.part -o b.npz --strategies s.exr");
    assert!(error.contains("--strategies is for pictures"), "{error}");
}

/// With a full disk, only the error is printed, whether the directory of the archive or an array
/// does not fit.
#[cfg(unix)]
#[test]
fn a_limit_on_the_size_of_files_is_one_error() {
    let folder = folder(TANK);
    folder.succeed("render scene.xml --particles 64");
    let blocks = folder.read("scene.npz").len() / 1024;
    for limit in [0, blocks] {
        let text = folder.fail_within(limit, "render scene.xml --particles 64 -o a.npz -q");
        assert!(
            text.starts_with("error: a.npz: cannot write: File too large"),
            "{text}"
        );
        assert_eq!(text.trim().lines().count(), 1, "{text}");
    }
}

/// If one file cannot be completed, the program prints one error and writes the other outputs.
#[cfg(unix)]
#[test]
fn other_outputs_are_written_where_one_fails() {
    let folder = folder(&TANK.replace("\"4\"", "\"5000\""));
    folder.succeed("render scene.xml --particles 64 -o whole.npz");
    let blocks = folder.read("whole.npz").len() / 1024;
    for limit in [blocks / 4, blocks / 2, 3 * blocks / 4] {
        let text = folder.fail_within(
            limit,
            "render scene.xml --particles 64 -o a.npz --stats s.json -q",
        );
        assert_eq!(
            text.trim(),
            "error: a.npz: cannot write: File too large (os error 27)"
        );
        assert!(folder.files().contains(&"s.json".to_owned()));
        std::fs::remove_file(folder.path("s.json")).unwrap();
    }
}

#[test]
fn writes_readings_and_the_energy_balance() {
    let folder = folder(TANK);
    let text = folder.succeed("render scene.xml --particles 2e3 --stats s.json");
    for part in [
        "2.05 k particles",
        "tank: fluence (4 bins",
        "skin: power",
        "emitted 1:",
        "absorbed by media 0.",
        "escaped 0.",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_eq!(folder.files(), ["s.json", "scene.npz", "scene.xml"]);
    let stats = folder.json("s.json");
    // Particles are traced in groups of 64.
    assert_eq!(stats["particles"], 2048);
    assert_eq!(stats["meters"][0]["name"], "tank");
    let fluence = &stats["meters"][0]["readings"][0];
    assert_eq!(fluence["bins_of_few_particles"], 0);
    assert!(fluence["median_effective_particles"].as_f64().unwrap() > 10.0);
    let text = folder.succeed("render scene.xml --particles 64");
    assert!(text.contains("from too few particles to trust"), "{text}");
    let balance = &stats["balance"];
    let entries = [
        "absorbed_by_media",
        "absorbed_by_surfaces",
        "escaped",
        "cut_off",
        "lost",
        "left_over",
    ];
    let sum: f64 = entries
        .iter()
        .map(|e| balance[e]["mean"].as_f64().unwrap())
        .sum();
    assert!((sum - 1.0).abs() < 1e-9, "{balance}");
    assert_eq!(balance["lost"]["mean"], 0.0);
}

#[test]
fn files_depend_on_the_seed_alone() {
    let folder = folder(TANK);
    for threads in [1, 3] {
        folder.succeed(&format!(
            "render scene.xml --particles 1000 --seed 4 --threads {threads} -o {threads}.npz -o {threads}.h5 -q"
        ));
    }
    assert_eq!(folder.read("1.npz"), folder.read("3.npz"));
    assert_eq!(folder.read("1.h5"), folder.read("3.h5"));
    folder.succeed("render scene.xml --particles 1000 --seed 5 -o other.npz -q");
    assert_ne!(folder.read("1.npz"), folder.read("other.npz"));
}

#[test]
fn info_lists_meters() {
    let text = folder(TANK).succeed("info scene.xml");
    for part in [
        "1000000 particles, Y",
        "tank: 8 bins, 336 bytes",
        "skin: 6 bins",
        "collimated",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(!text.contains("film") && !text.contains("sensor"), "{text}");
}

#[test]
fn a_meter_without_light_is_named() {
    let far = TANK.replace("tank", "far").replace(
        "<string",
        "<transform name=\"to_world\"><translate x=\"9\"/></transform><string",
    );
    let outcome = folder(&far).run("render scene.xml --particles 200");
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    assert!(
        outcome.stderr.contains("'far' received no light"),
        "{outcome:?}"
    );
    let dark = folder(TANK).refuse("render scene.xml --particles 200 -D power=0");
    assert!(dark.contains("emits no light"), "{dark}");
}

#[test]
fn options_of_pictures_are_refused_and_the_other_way_round() {
    let folder = folder(TANK);
    for (options, expected) in [
        ("--spp 8", "--particles"),
        ("--integrator path", "--integrator"),
        ("--exposure 1", "--exposure"),
        ("-o a.exr", ".npz"),
        ("-o a.npy", "2 meters"),
        ("--particles 0.5", "whole number"),
    ] {
        let message = folder.refuse(&format!("render scene.xml {options}"));
        assert!(message.contains(expected), "{options}: {message}");
    }
    let message = Folder::with_fog().refuse("render scene.xml --particles 100");
    assert!(message.contains("--spp"), "{message}");
}
