//! `morgana render --frames`.

use crate::support::Folder;
use std::fs;

fn folder() -> Folder {
    Folder::with_file(
        r#"<scene version="3.0.0">
             <default name="shift" value="0"/>
             <integrator type="auto"/>
             <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/></film>
               <transform name="to_world"><lookat origin="0, 0, -5" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
             <shape type="sphere"><point name="center" x="$shift"/><bsdf type="diffuse"/></shape>
             <emitter type="point"><point name="position" z="-5"/></emitter>
           </scene>"#,
    )
}

/// Each frame equals its own render, by the integrator of the first frame.
#[test]
fn frames_are_renders_with_their_number() {
    let folder = folder();
    let said = folder.succeed(
        "render scene.xml --spp 4 --frames 08..12:2 -D shift=0.{frame} -o out_{frame}.npy -o out_{frame}.exr --stats out_{frame}.json",
    );
    for frame in ["08", "10", "12"] {
        assert!(said.contains(&format!("frame {frame}\n")), "{said}");
        let stats = folder.json(&format!("out_{frame}.json"));
        let integrator = stats["integrator"].as_str().unwrap().to_owned();
        folder.succeed(&format!(
            "render scene.xml --spp 4 -D shift=0.{frame} --integrator {integrator} -o alone.npy"
        ));
        let [sequence, alone] =
            [format!("out_{frame}.npy"), "alone.npy".into()].map(|name| folder.read(&name));
        assert_eq!(sequence, alone);
    }
    assert!(!folder.path("out_09.npy").exists());
}

#[test]
fn a_sequence_resumes_at_files_that_are_missing() {
    let folder = folder();
    let sequence = "render scene.xml --spp 1 --frames 1..3 -D shift=0.{frame} -o {frame}.npy";
    folder.succeed(sequence);
    fs::remove_file(folder.path("2.npy")).unwrap();
    let said = folder.succeed(&format!("{sequence} --resume"));
    assert!(
        said.contains("frame 2\n") && !said.contains("frame 1\n") && !said.contains("frame 3\n"),
        "{said}"
    );
    assert!(folder.path("2.npy").exists());
}

#[test]
fn sequences_that_would_be_lost_are_refused() {
    let folder = folder();
    for (arguments, message) in [
        (
            "--frames 1..3 -D shift=0.{frame} -o out.npy",
            "each frame needs its own files: put {frame} into their names",
        ),
        (
            "--frames 1..3 -D shift=0.{frame}",
            "each frame needs its own files",
        ),
        (
            "--frames 1..3 -o {frame}.npy",
            "all frames would be equal: put {frame} into the value of a parameter",
        ),
        (
            "--frames 3..1 -D shift={frame} -o {frame}.npy",
            "expected FIRST..LAST or FIRST..LAST:STEP",
        ),
        (
            "--frames 1..3 -D shift={frame} -o {frame}.npy --checkpoint a.part",
            "leave out --checkpoint and --shard",
        ),
    ] {
        let said = folder.fail(2, &format!("render scene.xml --spp 1 {arguments}"));
        assert!(said.contains(message), "{said}");
    }
}
