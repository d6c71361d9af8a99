//! `morgana render`: its outputs, and their dependence on the seed alone.

use crate::support::Folder;
use io::image::{RgbImage, exr};
use io::npy;

#[test]
fn writes_exr_and_png_named_after_the_scene() {
    let folder = Folder::with_fog();
    let told = folder.succeed("render scene.xml --spp 8");
    let [line, wrote] = told.lines().collect::<Vec<_>>()[..] else {
        panic!("{told}");
    };
    for part in ["8 spp", "samples/s", "mean 0.", "±", "connections failed"] {
        assert!(line.contains(part), "{line}");
    }
    assert_eq!(wrote, "wrote scene.exr, scene.png");
    assert_eq!(folder.files(), ["scene.exr", "scene.png", "scene.xml"]);
    let png = RgbImage::read(&folder.path("scene.png")).unwrap();
    assert_eq!((png.width, png.height), (8, 6));
}

#[test]
fn exr_holds_layers_and_attributes() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --seed 3 --spp 8 -o a.exr -o a.npy");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    assert_eq!((image.width, image.height), (8, 6));
    let main = image.layer("").unwrap();
    for name in ["R", "G", "B"] {
        assert!(main.channel(name).unwrap().iter().all(|v| *v > 0.0));
        let variance = image.layer("variance").unwrap().channel(name).unwrap();
        assert!(variance.iter().all(|v| v.is_finite() && *v >= 0.0));
        // Eight samples are too few for every pixel.
        let few = image.layer("few").unwrap().channel(name).unwrap();
        assert!(few.iter().all(|few| *few == 1.0));
    }
    assert!(image.attribute("trust").unwrap().contains("few_pixels"));
    let counts = image.layer("samples").unwrap().channel("N").unwrap();
    assert!(counts.iter().all(|n| *n == 8.0));
    assert_eq!(image.attribute("seed"), Some("3"));
    assert_eq!(image.attribute("spp"), Some("8"));
    assert_eq!(image.attribute("scene"), Some("scene.xml"));
    assert_eq!(image.attribute("integrator"), Some("path"));
    assert_eq!(image.attribute("options"), Some("--seed 3 --spp 8"));
    assert_eq!(image.attribute("scene_hash").unwrap().len(), 64);
    assert!(
        image
            .attribute("connections")
            .unwrap()
            .contains("failure_rate")
    );
    assert_eq!(
        image.attribute("morgana_version"),
        Some(env!("CARGO_PKG_VERSION"))
    );
    let array = npy::read(&folder.path("a.npy")).unwrap();
    assert_eq!(array.shape, [6, 8, 3]);
}

#[test]
fn a_picture_of_even_light_is_that_light() {
    let folder = Folder::with_scene("");
    folder.succeed("render scene.xml --spp 2 -o a.exr");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    for (name, light) in [("R", 0.2), ("G", 0.4), ("B", 0.8)] {
        let values = image.layer("").unwrap().channel(name).unwrap();
        assert!(
            values.iter().all(|v| (v - light).abs() < 1e-6),
            "{name}: {values:?}"
        );
    }
}

#[test]
fn results_depend_on_the_seed_alone() {
    let folder = Folder::with_fog();
    for threads in 1..=3 {
        let out = format!("-o {threads}.exr -o {threads}.npy");
        folder.succeed(&format!(
            "render scene.xml --spp 5 --seed 7 --threads {threads} {out}"
        ));
    }
    for extension in ["exr", "npy"] {
        let one = folder.read(&format!("1.{extension}"));
        assert!(
            one == folder.read(&format!("2.{extension}")),
            "{extension} of 2 threads"
        );
        assert!(
            one == folder.read(&format!("3.{extension}")),
            "{extension} of 3 threads"
        );
    }
    folder.succeed("render scene.xml --spp 5 --seed 8 -o other.npy");
    assert!(folder.read("1.npy") != folder.read("other.npy"));
}

#[test]
fn the_scene_says_what_the_command_does_not() {
    let folder = Folder::with_fog();
    assert!(
        folder
            .succeed("render scene.xml -o a.npy")
            .contains("4 spp")
    );
    assert!(
        folder
            .succeed("render scene.xml -D spp=3 -o b.npy")
            .contains("3 spp")
    );
    folder.succeed("render scene.xml --spp 3 -o c.npy");
    assert!(folder.read("b.npy") == folder.read("c.npy"));
}

/// Choosing a sampler by option equals writing it in the scene.
#[test]
fn samplers_can_be_chosen() {
    let folder = Folder::with_fog();
    let scene = std::fs::read_to_string(folder.path("scene.xml")).unwrap();
    let even = scene.replace(r#"type="independent""#, r#"type="ldsampler""#);
    let adaptive = r#"<boolean name="adaptive" value="true"/></sampler>"#;
    let adaptive = even.replace("</sampler>", adaptive);
    assert!(even != scene && adaptive != even);
    std::fs::write(folder.path("even.xml"), even).unwrap();
    std::fs::write(folder.path("adaptive.xml"), adaptive).unwrap();
    for (name, options) in [
        ("even", "--sampler ldsampler"),
        ("adaptive", "--sampler ldsampler --adaptive"),
    ] {
        folder.succeed(&format!("render {name}.xml --spp 32 -o a.npy"));
        let line = folder.succeed(&format!(
            "render scene.xml --spp 32 {options} -o b.npy --stats s.json"
        ));
        assert!(folder.read("a.npy") == folder.read("b.npy"), "{name}");
        let shared = name == "adaptive";
        assert_eq!(line.contains("32 spp ("), shared, "{line}");
        let stats = folder.json("s.json");
        assert!(stats["options"].as_str().unwrap().contains(options));
        let limits = &stats["spp_of_pixels"];
        assert_eq!(limits[0].as_u64() < limits[1].as_u64(), shared, "{limits}");
    }
    let outcome = folder.run("render scene.xml --sampler ldsample");
    assert_eq!(outcome.status, Some(2));
    assert!(
        outcome
            .stderr
            .contains("unknown sampler 'ldsample'\n  = help: did you mean 'ldsampler'?"),
        "{}",
        outcome.stderr
    );
}

#[test]
fn exposure_brightens_png_only() {
    let folder = Folder::with_scene("");
    folder.succeed("render scene.xml --spp 1 --exposure -1 -o a.png");
    let pixel = RgbImage::read(&folder.path("a.png")).unwrap().pixels[0];
    for (value, light) in pixel.into_iter().zip([0.1, 0.2, 0.4]) {
        assert!((value - light).abs() < 0.005, "{pixel:?}");
    }
}

/// Radiances of 0.2, 0.4, 0.8 have luminance 0.39, which needs half a stop to exceed 0.5. A
/// thousandth of them needs ten stops more.
#[test]
fn pictures_are_exposed_unless_told_otherwise() {
    let folder = Folder::with_scene("");
    let said = folder.succeed("render scene.xml --spp 1 -o a.png -o a.npy");
    assert!(said.contains(" · exposure +0.5 stops\nwrote "), "{said}");
    folder.succeed("render scene.xml --spp 1 --exposure 0.5 -o b.png");
    assert_eq!(folder.read("a.png"), folder.read("b.png"));
    assert!(
        folder
            .read("a.png")
            .windows(8)
            .any(|bytes| bytes == b"exposure")
    );
    let said = folder.succeed("render scene.xml --spp 1 --exposure 0 -o plain.png");
    assert!(!said.contains("exposure"), "{said}");
    assert!(
        !folder
            .read("plain.png")
            .windows(8)
            .any(|bytes| bytes == b"exposure")
    );
    let pixel = RgbImage::read(&folder.path("plain.png")).unwrap().pixels[0];
    assert!((pixel[2] - 0.8).abs() < 0.005, "{pixel:?}");
    assert_eq!(
        folder.succeed("tonemap a.npy -o c.png"),
        "c.png: exposure +0.5 stops\n"
    );
    assert_eq!(folder.read("a.png"), folder.read("c.png"));
    assert_eq!(
        folder.succeed("tonemap a.png -o d.png"),
        "d.png: exposure +0.5 stops\n"
    );
    assert_eq!(folder.read("a.png"), folder.read("d.png"));
    folder.refuse("render scene.xml --exposure bright");
}

#[test]
fn all_written_files_are_named() {
    let folder = Folder::with_fog();
    let told = folder.succeed(
        "render scene.xml --integrator bdpt --spp 1 -o a.npy -o b.exr --strategies s.exr --stats s.json --checkpoint c.part",
    );
    assert_eq!(
        told.lines().last(),
        Some("wrote a.npy, b.exr, s.exr, s.json, c.part")
    );
    for part in 0..2 {
        let told = folder.succeed(&format!("render scene.xml --spp 2 --shard {part}/2"));
        let wrote = format!("wrote scene.{part}-of-2.part");
        assert_eq!(told.lines().last(), Some(wrote.as_str()));
    }
    let parts = "scene.0-of-2.part scene.1-of-2.part";
    let told = folder.succeed(&format!("merge {parts} -o m.exr"));
    assert_eq!(told.lines().last(), Some("wrote m.exr"));
    let told = folder.succeed(&format!("merge {parts} -o m.part"));
    assert_eq!(told, "wrote m.part\n");
    assert_eq!(folder.succeed(&format!("merge {parts} -o m.part -q")), "");
}

#[test]
fn numbers_of_samples_may_have_an_exponent() {
    let folder = Folder::with_fog();
    let line = folder.succeed("render scene.xml --spp 1e1 -o a.npy");
    assert!(line.contains(" 10 spp "), "{line}");
}

#[test]
fn a_balance_without_light_says_so() {
    let black = r#"<scene version="3.0.0"><emitter type="constant"><float name="radiance" value="0"/></emitter></scene>"#;
    let told = Folder::with_file(black).succeed("render scene.xml --integrator particle --spp 2");
    assert!(told.contains("\nemitted 0: there is no light\n"), "{told}");
}

#[test]
fn quiet_is_quiet() {
    let folder = Folder::with_fog();
    let outcome = folder.run("render scene.xml --quiet --spp 1");
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), ""));
    assert_eq!(outcome.stderr, "");
}

#[test]
fn without_a_terminal_there_is_no_progress_bar() {
    let outcome = Folder::with_fog().run("render scene.xml --spp 1");
    // Expect only notes.
    let blocks = outcome.stderr.trim().split("\n\n");
    assert!(
        blocks.clone().all(|b| b.starts_with("note[")),
        "{}",
        outcome.stderr
    );
}

#[test]
fn stats_hold_counts_and_settings() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --spp 6 --seed 2 --threads 2 --stats s.json -o a.npy");
    let stats = folder.json("s.json");
    assert_eq!(stats["seed"], 2);
    assert_eq!(stats["spp"], 6);
    assert_eq!(stats["spp_requested"], 6);
    assert_eq!(stats["threads"], 2);
    assert_eq!(stats["samples"], 8 * 6 * 6);
    assert_eq!(stats["channels"], serde_json::json!(["R", "G", "B"]));
    assert!(stats["stopped"].is_null());
    for number in ["mean", "standard_error", "seconds", "samples_per_second"] {
        assert!(stats[number].as_f64().unwrap() > 0.0, "{number}");
    }
    let connections = &stats["connections"];
    let count = |name: &str| connections[name].as_u64().unwrap();
    let failed = count("not_converged") + count("ray_lost") + count("degenerate");
    assert_eq!(count("attempts"), count("found") + failed);
    // The filter reaches two pixels beyond the film, of which a sample reaches three along each axis.
    assert_eq!(stats["counters"]["paths"], (8 + 3) * (6 + 3) * 6);
    assert_eq!(stats["counters"]["lost"], 0);
    assert_eq!(stats["scene_hash"].as_str().unwrap().len(), 64);
}

#[test]
fn stats_tell_how_connections_fared() {
    let folder = Folder::with_fog();
    let line = folder.succeed("render scene.xml --spp 2 --stats s.json -o a.exr");
    assert!(!line.contains("bias"), "{line}");
    let stats = folder.json("s.json");
    let connections = &stats["connections"];
    assert_eq!(connections["success_rate"], 1.0);
    assert_eq!(connections["certificate_coverage"], 1.0, "all is straight");
    assert_eq!(connections["capped"], 0);
    assert!(connections["possible_bias"].is_null());
    assert_eq!(stats["branches"]["reflections"], 0);
    assert_eq!(stats["branches"]["reflections_in_all"], 3);
    let image = exr::read(&folder.path("a.exr")).unwrap();
    let attribute =
        |name| serde_json::from_str::<serde_json::Value>(image.attribute(name).unwrap());
    assert_eq!(attribute("connections").unwrap(), *connections);
    assert_eq!(attribute("branches").unwrap(), stats["branches"]);
}

/// Behind a glass ball a point light has further branches, which the render searches for.
#[test]
fn searches_for_branches_are_counted() {
    let folder = Folder::with_scene(
        r#"<integrator type="path"><integer name="reflections" value="1"/></integrator>
           <emitter type="point"><point name="position" value="0, 0, -3"/>
             <float name="intensity" value="5"/></emitter>
           <shape type="sphere"><bsdf type="dielectric"/></shape>
           <shape type="rectangle"><transform name="to_world">
             <scale value="3"/><rotate y="1" angle="180"/><translate z="5"/>
           </transform></shape>"#,
    );
    folder.succeed("render scene.xml --spp 256 --stats s.json -o a.npy");
    let stats = folder.json("s.json");
    let connections = &stats["connections"];
    for name in ["searches", "secondary", "trials"] {
        assert!(
            connections[name].as_u64().unwrap() > 0,
            "{name}: {connections}"
        );
    }
    let number = |name: &str| connections[name].as_f64().unwrap();
    assert!((1.0 / 16.0..=1.0).contains(&number("search_probability")));
    assert!((0.0..1.0).contains(&number("certificate_coverage")));
    assert!(number("shots_per_attempt") > 1.0);
    assert_eq!(stats["branches"]["reflections"], 1);
}

/// Behind a focus the error of `path` depends on a few samples. The last line says so, and suggests
/// an alternative.
#[test]
fn errors_that_cannot_be_trusted_are_told() {
    let folder = Folder::with_file(
        r#"<scene version="3.0.0"><default name="integrator" value="path"/>
        <integrator type="$integrator"><integer name="max_depth" value="2"/></integrator>
        <sensor type="perspective">
          <float name="fov" value="40"/>
          <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
          <film type="hdrfilm">
            <integer name="width" value="16"/> <integer name="height" value="16"/>
            <string name="pixel_format" value="luminance"/> <rfilter type="box"/>
          </film>
        </sensor>
        <medium id="fog" type="homogeneous">
          <float name="sigma_t" value="0.5"/> <float name="albedo" value="1"/>
          <volume name="ior" type="gaussian">
            <float name="n0" value="1"/> <float name="delta" value="0.6"/> <float name="width" value="0.2"/>
          </volume>
        </medium>
        <shape type="sphere">
          <float name="radius" value="1.2"/> <bsdf type="null"/> <ref name="interior" id="fog"/>
        </shape>
        <emitter type="point">
          <point name="position" x="-1.5" y="0" z="0"/> <float name="intensity" value="1"/>
        </emitter></scene>"#,
    );
    let told = folder.succeed("render scene.xml --spp 64 --stats a.json");
    assert!(
        told.contains("the error is unreliable: a single sample contributes"),
        "{told}"
    );
    assert!(told.contains("try the integrator bdpt"), "{told}");
    assert_eq!(folder.json("a.json")["trust"]["few"], true);
    let told = folder.succeed("render scene.xml --spp 64 -D integrator=bdpt --stats a.json");
    assert!(!told.contains("unreliable"), "{told}");
    assert_eq!(folder.json("a.json")["trust"]["few"], false);
}

/// A sensor in a closed box, with the light outside.
#[test]
fn black_images_are_told() {
    let folder = Folder::with_file(
        r#"<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
        <shape type="cube"><transform name="to_world"><scale value="2"/></transform><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
        <emitter type="point"><point name="position" x="5" y="0" z="0"/></emitter></scene>"#,
    );
    let told = folder.succeed("render scene.xml --spp 4 --stats a.json");
    assert_eq!(folder.json("a.json")["trust"]["few"], true);
    assert!(
        told.contains("the picture is black: morgana check lists what may keep light"),
        "{told}"
    );
}
