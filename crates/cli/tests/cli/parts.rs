//! Renders in parts: files of shards and of interrupted renders equal the files of a render in one
//! piece, and incompatible parts are refused.

use crate::support::{Folder, program};
use std::time::Duration;

/// A scene whose film has every optional content.
fn fog() -> Folder {
    Folder::with_scene(
        r#"<integrator type="moment"><integrator type="aov">
             <string name="aovs" value="dd.y:depth, deflection, optical_length"/>
             <integrator type="path" name="img"/>
           </integrator></integrator>
           <shape type="sphere" id="ball"><bsdf type="null"/>
             <medium type="homogeneous" name="interior" id="fog">
               <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
               <volume name="ior" type="gaussian"><float name="n0" value="1"/><float name="delta" value="0.1"/>
                 <float name="width" value="0.4"/></volume>
             </medium>
           </shape>"#,
    )
}

fn same(folder: &Folder, a: &str, b: &str) {
    assert!(folder.read(a) == folder.read(b), "{a} and {b} differ");
}

#[test]
fn shards_are_the_whole() {
    for (integrator, strategies) in [
        ("path", ""),
        ("path --adaptive", ""),
        ("bdpt", " --strategies"),
        ("vcm", ""),
        ("sppm", ""),
        ("preview", ""),
    ] {
        let folder = fog();
        let with = |name: &str| match strategies {
            "" => String::new(),
            option => format!("{option} {name}"),
        };
        let spp = if integrator.contains("adaptive") {
            40
        } else {
            7
        };
        let common = format!("render scene.xml --spp {spp} --seed 3 --integrator {integrator}");
        folder.succeed(&format!(
            "{common} --threads 2 -o whole.exr -o whole.png -o whole.npy{}",
            with("whole.s.exr")
        ));
        for i in 0..3 {
            let threads = [1, 7, 2][i];
            folder.succeed(&format!(
                "{common} --threads {threads} --shard {i}/3{}",
                with("unused.exr")
            ));
        }
        let parts = "scene.2-of-3.part scene.0-of-3.part scene.1-of-3.part";
        folder.succeed(&format!(
            "merge {parts} -o all.exr -o all.png -o all.npy{}",
            with("all.s.exr")
        ));
        // Merge two parts first, then the third.
        folder.succeed("merge scene.2-of-3.part scene.0-of-3.part -o two.part");
        folder.succeed("merge two.part scene.1-of-3.part -o again.exr");
        for (a, b) in [
            ("all.exr", "whole.exr"),
            ("all.png", "whole.png"),
            ("all.npy", "whole.npy"),
            ("again.exr", "whole.exr"),
        ] {
            same(&folder, a, b);
        }
        if !strategies.is_empty() {
            same(&folder, "all.s.exr", "whole.s.exr");
            assert!(!folder.files().contains(&"unused.exr".to_owned()));
        }
    }
}

#[test]
fn shards_of_measurements_are_the_whole() {
    let folder = Folder::with_file(
        r#"<scene version="3.0.0">
             <integrator type="particle"/>
             <emitter type="point"><point name="position" x="0" y="0" z="0"/><rgb name="intensity" value="1,2,3"/></emitter>
             <shape type="sphere"><bsdf type="diffuse"/>
               <sensor type="irradiancemeter" id="wall"/>
             </shape>
           </scene>"#,
    );
    folder.succeed("render scene.xml --particles 10000 -o whole.npz -o whole.h5");
    for i in 0..3 {
        folder.succeed(&format!(
            "render scene.xml --particles 10000 --shard {i}/3 -o {i}.part"
        ));
    }
    // Particles are traced in groups of 64, which none of the shards divides evenly.
    let text = folder.succeed("status 0.part 1.part 2.part");
    assert!(text.matches(", complete").count() == 3, "{text}");
    assert!(!text.contains("incomplete"), "{text}");
    for (parts, missing) in [
        ("0.part 1.part", "2"),
        ("0.part 2.part", "1"),
        ("1.part 2.part", "0"),
    ] {
        assert_eq!(
            folder
                .output(1, &format!("status --missing {parts}"))
                .trim(),
            missing
        );
    }
    let status = folder.succeed("status 0.part 1.part 2.part");
    assert!(status.contains("10048 of 10048 samples"), "{status}");
    folder.succeed("merge 0.part 1.part 2.part -o all.npz -o all.h5");
    same(&folder, "all.npz", "whole.npz");
    same(&folder, "all.h5", "whole.h5");
}

#[test]
fn a_checkpoint_goes_on() {
    let folder = fog();
    folder.succeed("render scene.xml --spp 9 -o whole.exr --stats whole.json");
    folder.succeed("render scene.xml --spp 4 --checkpoint c.part -o a.exr");
    // A new render never overwrites it.
    let error = folder.fail(2, "render scene.xml --spp 4 --checkpoint c.part -o a.exr");
    assert!(
        error.contains("'c.part' exists already: continue it by --resume"),
        "{error}"
    );
    folder.succeed("render scene.xml --spp 9 --checkpoint c.part --resume -o b.exr --stats b.json");
    same(&folder, "b.exr", "whole.exr");
    assert_eq!(
        folder.json("b.json")["counters"],
        folder.json("whole.json")["counters"]
    );
    // Repeated, there is nothing left to do, and the image is written again.
    folder.succeed("render scene.xml --spp 9 --checkpoint c.part --resume -o c.exr");
    same(&folder, "c.exr", "whole.exr");
    // Checkpoints are parts, too.
    folder.succeed("merge c.part -o d.exr");
    same(&folder, "d.exr", "whole.exr");
    let fewer = folder.fail(
        2,
        "render scene.xml --spp 5 --checkpoint c.part --resume -o e.exr",
    );
    assert!(
        fewer.contains("it already has 9 samples, more than 5"),
        "{fewer}"
    );
    // A missing checkpoint starts a new render.
    folder.succeed("render scene.xml --spp 9 --checkpoint new.part --resume -o f.exr");
    same(&folder, "f.exr", "whole.exr");
}

#[test]
fn signals_end_a_render_and_it_goes_on() {
    let render = "render scene.xml --spp 20000 --threads 1 --checkpoint c.part --checkpoint-every 0.01s -o a.exr -q";
    for (signal, status) in [("HUP", 129), ("INT", 130), ("TERM", 143)] {
        if signal == "HUP" && is_hangup_ignored() {
            continue;
        }
        let folder = Folder::with_fog();
        folder.succeed("render scene.xml --spp 20000 -o whole.exr");
        let mut child = std::process::Command::new(program())
            .current_dir(folder.path("."))
            .args(render.split(' '))
            .spawn()
            .unwrap();
        while !folder.path("c.part").exists() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let signal = ["-s", signal, &child.id().to_string()];
        std::process::Command::new("kill")
            .args(signal)
            .status()
            .unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(status));
        let json = folder.output(1, "status c.part --json");
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let done = json["done"].as_u64().unwrap();
        assert!(done > 0 && done < 20_000, "{done}");
        // The image of the existing samples is written, too.
        folder.succeed("merge c.part --partial -o part.exr");
        same(&folder, "a.exr", "part.exr");
        folder.succeed("render scene.xml --spp 20000 --checkpoint c.part --resume -o a.exr");
        same(&folder, "a.exr", "whole.exr");
    }
}

/// True if this process and its children ignore SIGHUP, or if the system does not tell.
fn is_hangup_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.is_none_or(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 1 == 1)
}

#[cfg(target_os = "linux")]
#[test]
fn renders_that_ignore_closed_terminals_go_on() {
    let folder = Folder::with_fog();
    let render = "render scene.xml --spp 20000 --threads 1 --checkpoint c.part --checkpoint-every 0.01s -o a.exr -q";
    let script = format!("trap '' HUP; exec {} {render}", program().display());
    let mut child = std::process::Command::new("sh")
        .args(["-c", &script])
        .current_dir(folder.path("."))
        .spawn()
        .unwrap();
    while !folder.path("c.part").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let kill = ["-s", "HUP", &child.id().to_string()];
    let sent = std::process::Command::new("kill").args(kill).status();
    assert!(sent.unwrap().success());
    assert!(child.wait().unwrap().success());
    folder.succeed("render scene.xml --spp 20000 -o whole.exr");
    same(&folder, "a.exr", "whole.exr");
}

#[test]
fn a_shard_goes_on() {
    let folder = fog();
    let shard = "render scene.xml --spp 16 --shard 1/2";
    folder.succeed(&format!("{shard} --time 0.000001"));
    let list = folder.output(1, "status scene.1-of-2.part --missing");
    assert_eq!(list.trim(), "0-1");
    let error = folder.fail(2, shard);
    assert!(error.contains("exists already"), "{error}");
    folder.succeed(&format!("{shard} --resume"));
    assert_eq!(
        folder
            .output(1, "status scene.1-of-2.part --missing")
            .trim(),
        "0"
    );
    folder.succeed("render scene.xml --spp 16 --shard 0/2 --resume");
    assert_eq!(
        folder
            .output(0, "status scene.0-of-2.part scene.1-of-2.part --missing")
            .trim(),
        ""
    );
    let other = folder.fail(
        2,
        "render scene.xml --spp 16 --shard 0/2 --resume -o scene.1-of-2.part",
    );
    assert!(
        other.contains("it is shard 1 of 2 of 16 samples, not shard 0 of 2"),
        "{other}"
    );
}

#[test]
fn what_is_missing_is_told() {
    let folder = fog();
    for i in [0, 2, 3, 6] {
        folder.succeed(&format!(
            "render scene.xml --spp 8 --shard {i}/8 -o {i}.part"
        ));
    }
    let parts = "0.part 2.part 3.part 6.part";
    let text = folder.output(1, &format!("status {parts}"));
    assert!(
        text.contains("shards: 1,4-5,7 (sbatch --array=1,4-5,7)"),
        "{text}"
    );
    assert!(
        text.contains("2.part: shard 2 of 8, samples 2, complete"),
        "{text}"
    );
    let error = folder.fail(2, &format!("merge {parts} -o a.exr"));
    assert!(
        error.contains("4 of 8 samples are missing") && error.contains("--partial"),
        "{error}"
    );
    assert!(!folder.files().contains(&"a.exr".to_owned()));
    folder.succeed(&format!("merge {parts} -o a.exr --partial"));
    // A damaged part is reported, and counts as missing.
    let mut bytes = folder.read("0.part");
    bytes[100] ^= 1;
    std::fs::write(folder.path("0.part"), bytes).unwrap();
    let text = folder.output(1, &format!("status {parts}"));
    assert!(
        text.contains("0.part: not a morgana part file: it is incomplete or damaged"),
        "{text}"
    );
    assert!(text.contains("shards: 0-1,4-5,7"), "{text}");
    let told = folder.run(&format!("status {parts} --missing"));
    assert_eq!(told.stdout, "0-1,4-5,7\n");
    assert!(
        told.stderr
            .contains("warning: 0.part: not a morgana part file"),
        "{}",
        told.stderr
    );
    let error = folder.fail(1, &format!("merge {parts} -o b.exr --partial"));
    assert!(
        error.contains("0.part") && error.contains("damaged"),
        "{error}"
    );
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let folder = fog();
    folder.succeed("render scene.xml --spp 4 --shard 0/2 -o a.part");
    let refused = |render: &str, why: &str| {
        folder.succeed(&format!("render {render} -o b.part"));
        for command in [
            "merge a.part b.part -o x.exr",
            "merge a.part b.part -o x.part",
        ] {
            let error = folder.fail(2, command);
            assert!(
                error.contains("'b.part' does not belong to 'a.part'"),
                "{error}"
            );
            assert!(error.contains(why), "{error}");
        }
        std::fs::remove_file(folder.path("b.part")).unwrap();
        assert!(!folder.files().iter().any(|f| f.starts_with("x.")));
    };
    refused("scene.xml --spp 4 --shard 0/2", "both have samples 0 to 1");
    refused(
        "scene.xml --spp 4 --shard 1/2 --seed 1",
        "with seed = 1, not 0",
    );
    refused(
        "scene.xml --spp 4 --shard 1/2 --integrator bdpt",
        "with integrator = bdpt, not path",
    );
    refused(
        "scene.xml --spp 6 --shard 1/2",
        "its render has 6 samples, not 4",
    );
    let other = String::from_utf8(folder.read("scene.xml"))
        .unwrap()
        .replace("0.9", "0.8");
    std::fs::write(folder.path("other.xml"), &other).unwrap();
    refused("other.xml --spp 4 --shard 1/2", "its scene is different");
    // The scene itself has changed, or moved.
    folder.succeed("render scene.xml --spp 4 --shard 1/2 -o b.part");
    std::fs::rename(folder.path("scene.xml"), folder.path("moved.xml")).unwrap();
    let error = folder.fail(2, "merge a.part b.part -o x.exr");
    assert!(
        error.contains("the scene is no longer at") && error.contains("--scene"),
        "{error}"
    );
    let error = folder.fail(2, "merge a.part b.part -o x.exr --scene other.xml");
    assert!(
        error.contains("do not belong to 'other.xml': its scene is different"),
        "{error}"
    );
    folder.succeed("merge a.part b.part -o x.exr --scene moved.xml");
    std::fs::write(folder.path("scene.xml"), other).unwrap();
    let error = folder.fail(2, "merge a.part b.part -o y.exr");
    assert!(error.contains("its scene is different"), "{error}");
    assert!(!folder.files().contains(&"y.exr".to_owned()));
    // A render does not resume from parts of another scene either.
    let error = folder.fail(
        2,
        "render scene.xml --spp 4 --checkpoint a.part --resume -o y.exr",
    );
    assert!(
        error.contains("'a.part' cannot be resumed: its scene is different"),
        "{error}"
    );
    let error = folder.fail(
        1,
        "render scene.xml --checkpoint moved.xml --resume -o y.exr",
    );
    assert!(
        error.contains("not a morgana part file: it starts with other bytes"),
        "{error}"
    );
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let folder = fog();
    for (options, why) in [
        ("--resume", "needs --checkpoint or --shard"),
        ("--shard 0/9", "9 shards are more than the 4 samples"),
        ("--shard 0/2 -o a.exr", "make images by morgana merge"),
        (
            "--shard auto",
            "neither SLURM_ARRAY_TASK_ID nor AWS_BATCH_JOB_ARRAY_INDEX is set",
        ),
        ("--shard 2/2", "from 0 to N − 1"),
        ("--checkpoint nowhere/c.part", "folder 'nowhere'"),
    ] {
        let error = folder.fail(2, &format!("render scene.xml {options}"));
        assert!(error.contains(why), "{options}: {error}");
    }
    let error = folder.fail(2, "merge a.part -o b.part -o c.exr");
    assert!(error.contains("write only the .part file"), "{error}");
    assert_eq!(folder.files(), ["scene.xml"]);
}
