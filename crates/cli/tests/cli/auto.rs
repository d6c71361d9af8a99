//! The integrator auto, by the program: its messages, and a common integrator for parts and resumed
//! renders.

use super::support::Folder;

/// A small emitter in fog that bends light: paths from the camera find its light in rare bright
/// samples.
fn folder() -> Folder {
    Folder::with_scene(
        r#"<shape type="sphere"><float name="radius" value="1.5"/><bsdf type="null"/>
        <medium name="interior" type="homogeneous"><float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
        <volume name="ior" type="gaussian"><float name="n0" value="1"/><float name="delta" value="0.05"/><float name="width" value="0.6"/></volume></medium></shape>
        <emitter type="spot"><transform name="to_world"><lookat origin="0, 3, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
        <float name="cutoff_angle" value="4"/><float name="intensity" value="30000"/></emitter>"#,
    )
}

#[test]
fn what_was_chosen_and_why_is_said() {
    let folder = folder();
    let said = folder.succeed("render scene.xml --spp 1000 -o a.exr --stats a.json");
    assert!(said.contains(": a pilot finds it "), "{said}");
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
    let chosen = stats["integrator"].as_str().unwrap();
    assert!(["particle", "bdpt"].contains(&chosen), "{chosen}");
    let reason = stats["integrator_choice"].as_str().unwrap();
    assert!(reason.contains("× as efficient as path"), "{reason}");
    // The image is the image of the chosen integrator.
    folder.succeed(&format!(
        "render scene.xml --spp 1000 --integrator {chosen} -o b.npy"
    ));
    folder.succeed("render scene.xml --spp 1000 -o a.npy");
    assert!(folder.read("a.npy") == folder.read("b.npy"));
    // A sky alone has no noise.
    let sky = Folder::with_scene("").succeed("render scene.xml --spp 1000 -o a.npy");
    assert!(
        sky.contains("integrator path: a pilot finds no noise"),
        "{sky}"
    );
    let short = folder.succeed("render scene.xml --spp 1 -o a.npy");
    assert!(
        short.contains("integrator path: the render is too short for a pilot"),
        "{short}"
    );
}

/// A render that ends at a target error has the evenly distributed samples that a pilot expects in
/// its time limit, and continues with them.
#[test]
fn resumed_renders_keep_the_size_of_replicates() {
    let folder = Folder::with_scene("");
    let text = String::from_utf8(folder.read("scene.xml")).unwrap();
    let open = |line: &&str| !line.contains("<sampler");
    let scene = text.lines().filter(open).collect::<String>();
    std::fs::write(folder.path("scene.xml"), &scene).unwrap();
    let sampler = |options: &str| {
        folder.succeed(&format!(
            "render scene.xml {options} --target-error 0.9 --checkpoint c.part -o a.npy --stats a.json"
        ));
        let stats: serde_json::Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
        stats["sampler"].as_str().unwrap().to_owned()
    };
    let first = sampler("--time 60s");
    let size: u64 = first.strip_prefix("ldsampler:").unwrap().parse().unwrap();
    assert!(size > 4, "{first}");
    assert_eq!(sampler("--time 30s --resume"), first);
}

#[test]
fn parts_have_the_integrator_of_the_whole() {
    let folder = folder();
    folder.succeed("render scene.xml --spp 400 -o whole.exr");
    for shard in 0..2 {
        folder.succeed(&format!(
            "render scene.xml --spp 400 --shard {shard}/2 -o {shard}.part"
        ));
    }
    folder.succeed("merge 0.part 1.part -o merged.exr");
    assert!(folder.read("whole.exr") == folder.read("merged.exr"));
    // A resumed render keeps its integrator.
    let first = folder.succeed("render scene.xml --spp 1 --checkpoint c.part -o a.npy");
    assert!(first.contains("integrator path"), "{first}");
    let more = folder.succeed("render scene.xml --spp 400 --checkpoint c.part --resume -o a.npy");
    assert!(more.contains("integrator path"), "{more}");
    folder.succeed("render scene.xml --spp 400 --integrator path -o b.npy");
    assert!(folder.read("a.npy") == folder.read("b.npy"));
}

/// The pilot does not prefer paths from the camera if they miss the light: a small light reaches
/// the floor only by a mirror.
#[test]
fn light_that_path_hardly_sees_is_not_missed() {
    let folder = Folder::with_scene(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
        <bsdf type="diffuse"/></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="0.002"/><rotate x="1" angle="-90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="1e9"/></emitter></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate x="1" angle="90"/><translate y="5"/></transform>
        <bsdf type="conductor"/></shape>"#,
    );
    let said = folder.succeed("render scene.xml --spp 1000 -o a.npy");
    assert!(said.contains("integrator bdpt: a pilot finds it"), "{said}");
}
