//! Renders that end early.

use crate::support::Folder;
use io::image::exr;
use std::time::{Duration, Instant};

#[test]
fn time_ends_a_render() {
    let folder = Folder::with_fog();
    let line = folder.succeed("render scene.xml --time 0.3s --stats s.json -o a.exr");
    assert!(!line.contains("interrupted"), "{line}");
    let stats = folder.json("s.json");
    assert_eq!(stats["stopped"], "time");
    assert!(stats["spp_requested"].is_null());
    let spp = stats["spp"].as_u64().unwrap();
    assert!(
        spp > 4,
        "the scene's own number of samples is no limit: {spp}"
    );
    let seconds = stats["seconds"].as_f64().unwrap();
    // The limit includes the time to load the scene, which is not part of the seconds.
    assert!((0.2..10.0).contains(&seconds), "{seconds}");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    assert_eq!(image.attribute("spp"), Some(spp.to_string().as_str()));
    // The image equals a render of this number of samples.
    folder.succeed(&format!(
        "render scene.xml --integrator path --spp {spp} -o b.exr"
    ));
    let again = exr::read(&folder.path("b.exr")).unwrap();
    assert_eq!(image.layers, again.layers);
}

#[test]
fn samples_bound_a_render_that_has_time() {
    let folder = Folder::with_fog();
    let line = folder.succeed("render scene.xml --time 1h --spp 3 -o a.npy");
    assert!(line.contains("3 spp"), "{line}");
}

#[test]
fn a_target_ends_a_render() {
    let folder = Folder::with_fog();
    let target = "--integrator path --target-error 0.004 --stats s.json -o a.exr";
    let line = folder.succeed(&format!("render scene.xml {target}"));
    assert!(
        line.contains("target reached (stopping adds a slight bias)"),
        "{line}"
    );
    let stats = folder.json("s.json");
    assert_eq!(stats["stopped"], "target");
    assert!(stats["spp_requested"].is_null());
    let reached = &stats["target"];
    assert_eq!(
        (&reached["measure"], &reached["reached"]),
        (&"image".into(), &true.into())
    );
    assert!(reached["error"].as_f64().unwrap() <= 0.004);
    assert_eq!(reached["possible_bias"], "stopping by measured error");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    assert_eq!(
        image.attribute("options"),
        Some("--seed 0 --target-error 0.004 --integrator path")
    );
    let spp = stats["spp"].as_u64().unwrap();
    folder.succeed(&format!(
        "render scene.xml --integrator path --spp {spp} -o b.exr"
    ));
    assert_eq!(
        image.layers,
        exr::read(&folder.path("b.exr")).unwrap().layers
    );
    // Single pixels are less accurate than their mean.
    let line = folder.succeed(&format!(
        "render scene.xml {target} --target pixel --spp {spp}"
    ));
    assert!(line.contains("target of 0.4% not reached"), "{line}");
    assert_eq!(folder.json("s.json")["target"]["reached"], false);
    // A small error of few samples may be random.
    let line = folder.succeed("render scene.xml --target-error 0.9 --spp 2");
    assert!(line.contains("target of 90% not confirmed"), "{line}");
    let message = folder.refuse("render scene.xml --target pixel");
    assert!(message.contains("--target-error"), "{message}");
}

/// A ball of fog with ripples so fine that a sample takes minutes, in front of a camera and a point
/// light, or with a meter.
fn unlimited(instead: &str) -> Folder {
    let camera = r#"<sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/></film>
      </sensor>"#;
    let camera = if instead.is_empty() { camera } else { instead };
    Folder::with_file(&format!(
        r#"<scene version="3.0.0">{camera}
          <emitter type="point">
            <point name="position" x="0.3" y="0.4" z="0.2"/><float name="intensity" value="10"/>
          </emitter>
          <shape type="sphere"><bsdf type="null"/>
            <medium type="homogeneous" name="interior" id="fog">
              <float name="sigma_t" value="2"/><float name="albedo" value="0.99"/>
              <volume name="ior" type="acoustic">
                <float name="n0" value="1"/><float name="amplitude" value="1e-3"/>
                <integer name="order" value="0"/><float name="wave_number" value="1e5"/>
              </volume>
            </medium>
          </shape>
        </scene>"#
    ))
}

/// Time limits act within passes and pilots, for every estimator. Incomplete passes are not shown.
#[test]
fn time_ends_samples_that_take_minutes() {
    let folder = unlimited("");
    for integrator in ["path", "particle", "bdpt", "photon"] {
        let started = Instant::now();
        let line = folder.succeed(&format!(
            "render scene.xml --time 0.5s --integrator {integrator} --stats s.json -o a.exr"
        ));
        assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
        let empty =
            "the image is empty: no sample of the whole image was completed; allow more time";
        let stats = folder.json("s.json");
        assert_eq!(stats["stopped"], "time");
        assert_eq!(line.contains(empty), stats["spp"] == 0, "{line}");
        let image = exr::read(&folder.path("a.exr")).unwrap();
        assert_eq!(
            image.attribute("spp"),
            Some(stats["spp"].to_string().as_str())
        );
    }
    let meter = r#"<integrator type="particle"/><sensor type="fluencemeter">
        <string name="coordinates" value="spherical"/><integer name="nr" value="4"/>
      </sensor>"#;
    let folder = unlimited(meter);
    let started = Instant::now();
    folder.succeed("render scene.xml --time 0.5s --stats s.json -o a.npz");
    assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
    assert_eq!(folder.json("s.json")["stopped"], "time");
}

/// The warning comes before the render, with the number and the parameter.
#[test]
fn dear_parameters_are_warned_of() {
    let folder = unlimited("");
    for command in ["check", "info"] {
        let outcome = folder.run(&format!("{command} scene.xml"));
        let said = outcome.stdout + &outcome.stderr;
        assert!(
            said.contains("a ray across medium 'fog' takes about 1e5 steps"),
            "{said}"
        );
        assert!(said.contains("given up after 20000"), "{said}");
        assert!(said.contains("'wave_number'"), "{said}");
    }
    let usual = Folder::with_lens().run("info scene.xml");
    assert!(
        usual.stdout.contains("steps      about "),
        "{}",
        usual.stdout
    );
    assert!(!usual.stderr.contains("a ray across"), "{}", usual.stderr);
}

/// A scene of 8 × 6 pixels that takes minutes to load: two thousand rough coats, each with its own
/// tables.
fn slow_to_load() -> Folder {
    let coat = |i: usize| {
        format!(
            r#"<shape type="rectangle"><bsdf type="roughplastic"><float name="alpha" value="{}"/>
               <boolean name="nonlinear" value="true"/></bsdf></shape>"#,
            0.05 + 1e-4 * i as f64
        )
    };
    Folder::with_scene(&(0..2000).map(coat).collect::<String>())
}

/// Loading stops in time, and the message states how far it got.
#[test]
fn time_ends_loading() {
    let (folder, started) = (slow_to_load(), Instant::now());
    for options in ["", " --frames 1..3 -D spp={frame} -o {frame}.npy"] {
        let error = folder.fail(1, &format!("render scene.xml --time 1s{options}"));
        let said = "the time limit of 1s was reached while building <shape type=\"rectangle\"> at scene.xml:";
        assert!(error.contains(said), "{error}");
    }
    assert!(
        started.elapsed() < 2 * TIME_LIMIT,
        "{:?}",
        started.elapsed()
    );
    assert_eq!(folder.files(), ["scene.xml"]);
}

/// Time that exceeds the time limits of these tests and their allowed delays, on a busy machine.
const TIME_LIMIT: Duration = Duration::from_secs(8);

#[cfg(unix)]
mod interruption {
    use super::*;
    use crate::support::program;
    use std::process::{Child, Command, Stdio};

    fn start(folder: &Folder, integrator: &str) -> Child {
        let options = "--spp 100000000 --threads 1 -o a.exr --stats s.json";
        let line = format!("render scene.xml --integrator {integrator} {options}");
        let child = Command::new(program())
            .current_dir(folder.path("."))
            .args(line.split(' '))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(700));
        child
    }

    fn interrupt(child: &Child) {
        let status = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status();
        assert!(status.unwrap().success());
    }

    /// The first signal arrives within the first pass.
    #[test]
    fn ends_samples_that_take_minutes() {
        let folder = unlimited("");
        let (child, started) = (start(&folder, "path"), Instant::now());
        interrupt(&child);
        let output = child.wait_with_output().unwrap();
        assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
        assert_eq!(output.status.code(), Some(130));
        let line = String::from_utf8(output.stdout).unwrap();
        assert!(
            line.starts_with("interrupted: ") && line.contains("the image is empty"),
            "{line}"
        );
        assert_eq!(folder.json("s.json")["spp"], 0);
    }

    /// Within the pilot that chooses the integrator, nothing exists yet that could be resumed.
    #[test]
    fn ends_pilots() {
        let folder = unlimited("");
        let (child, started) = (start(&folder, "auto"), Instant::now());
        interrupt(&child);
        let output = child.wait_with_output().unwrap();
        assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
        assert_eq!(output.status.code(), Some(130));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            said.contains("interrupted before the first sample"),
            "{said}"
        );
        assert_eq!(folder.files(), ["scene.xml"]);
    }

    #[test]
    fn ends_loading() {
        let folder = slow_to_load();
        let (child, started) = (start(&folder, "path"), Instant::now());
        interrupt(&child);
        let output = child.wait_with_output().unwrap();
        assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
        assert_eq!(output.status.code(), Some(130));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("interrupted while "), "{said}");
        assert_eq!(folder.files(), ["scene.xml"]);
    }

    #[test]
    fn writes_what_there_is() {
        let folder = Folder::with_fog();
        let child = start(&folder, "path");
        interrupt(&child);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        let line = String::from_utf8(output.stdout).unwrap();
        assert!(line.starts_with("interrupted: "), "{line}");
        assert_eq!(folder.files(), ["a.exr", "s.json", "scene.xml"]);
        let stats = folder.json("s.json");
        assert_eq!(stats["stopped"], "interrupted");
        let spp = stats["spp"].as_u64().unwrap();
        let image = exr::read(&folder.path("a.exr")).unwrap();
        let counts = image.layer("samples").unwrap().channel("N").unwrap();
        assert!(counts.iter().all(|n| *n == spp as f32));
    }
}

/// Tests a reference of optical path differences with structure far finer than the length of the
/// ray.
#[test]
fn too_fine_references_are_given_up_and_in_time() {
    let scene = r#"<scene version="3.0.0">
      <default name="width" value="2"/>
      <integrator type="aov"><string name="aovs" value="optical_path_difference"/>
        <volume name="reference_index" type="acoustic"><float name="n0" value="1"/><float name="amplitude" value="1e-6"/>
          <float name="wave_number" value="1e6"/></volume></integrator>
      <sensor type="orthographic">
        <transform name="to_world"><lookat origin="0, 0, -0.9" target="0, 0.1, 1" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="$width"/><integer name="height" value="1"/><rfilter type="box"/></film></sensor>
      <shape type="cube"><bsdf type="null"/><medium name="interior" type="transparent"/></shape></scene>"#;
    let folder = Folder::with_file(scene);
    folder.succeed("render scene.xml --spp 1 --stats s.json -o a.exr");
    let counters = &folder.json("s.json")["counters"];
    assert_eq!(counters["lost"], 2, "{counters}");
    assert_eq!(counters["over_budget"]["rays"], 2, "{counters}");
    // A thousand rays would take minutes; they are abandoned within a pass.
    let started = Instant::now();
    folder.succeed("render scene.xml -D width=1000 --spp 1 --time 1s -o a.exr");
    assert!(started.elapsed() < Duration::from_secs(15));
}
