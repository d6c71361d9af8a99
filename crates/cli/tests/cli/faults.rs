//! Crashes, full disks and folders that cannot be written to. A render loses at most the work since
//! the last checkpoint, and never writes a wrong image.

use crate::support::{Folder, program};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Largest and smallest number of kills. A render on a fast machine may end before the last kill.
const KILLS: [u64; 2] = [50, 10];

fn done(folder: &Folder, part: &str) -> u64 {
    let outcome = folder.run(&format!("status {part} --json"));
    assert!(outcome.stderr.is_empty(), "{outcome:?}");
    let json: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    json["done"].as_u64().unwrap()
}

/// A render survives repeated kills at arbitrary moments.
#[test]
fn killed_renders_go_on() {
    let render = "render scene.xml --integrator path --spp 20000 --threads 1 --checkpoint c.part --resume -o a.exr -q";
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --integrator path --spp 20000 -o whole.exr");
    let mut last = 0;
    for kill in 0..KILLS[0] {
        let mut child = Command::new(program())
            .current_dir(folder.path("."))
            .args(render.split(' '))
            .args(["--checkpoint-every", "0.003s"])
            .spawn()
            .unwrap();
        // Delays from 5 to 60 ms, in irregular order.
        let delay = 5_000 + kill * kill * 7_919 % 55_000;
        std::thread::sleep(Duration::from_micros(delay));
        child.kill().unwrap();
        if child.wait().unwrap().success() {
            assert!(kill >= KILLS[1], "the render ended before kill {kill}");
            break;
        }
        if folder.path("c.part").exists() {
            let now = done(&folder, "c.part");
            assert!(now >= last, "{now} {last}");
            last = now;
        }
    }
    assert!(last > 0);
    folder.succeed(render);
    assert!(
        folder.read("a.exr") == folder.read("whole.exr"),
        "after {last} samples"
    );
}

/// Runs a shell script that may mount file systems of its own. Returns `None` if the system does
/// not allow this, which fails under `MORGANA_ALL_TESTS`.
fn with_mounts(folder: &Folder, script: &str) -> Option<(bool, String)> {
    let run = |script: &str| {
        Command::new("unshare")
            .args(["--map-root-user", "--mount", "sh", "-ec", script])
            .env("MORGANA", program())
            .current_dir(folder.path("."))
            .stdin(Stdio::null())
            .output()
    };
    let probe = run("mkdir -p m && mount -t tmpfs none m");
    if !probe.is_ok_and(|o| o.status.success()) {
        assert!(
            std::env::var_os("MORGANA_ALL_TESTS").is_none(),
            "this system does not allow mounts, and MORGANA_ALL_TESTS allows no test to be left out"
        );
        eprintln!("not run: this system does not allow mounts");
        return None;
    }
    let output = run(script).unwrap();
    let text = [output.stdout, output.stderr].concat();
    Some((output.status.success(), String::from_utf8(text).unwrap()))
}

/// The disk has room for one checkpoint, but not for the next one beside it.
#[test]
fn a_full_disk_keeps_what_it_has() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --integrator path --spp 20000 -o whole.exr");
    folder
        .succeed("render scene.xml --integrator path --spp 1 --checkpoint small.part -o small.exr");
    let size = folder.read("small.part").len().div_ceil(1024) * 1024;
    let script = format!(
        r#"mount -t tmpfs -o size={}k none m
        $MORGANA render scene.xml --integrator path --spp 1 --checkpoint m/c.part -o a.exr -q
        cp m/c.part before.part
        head -c 1000000 /dev/zero > m/filler 2> /dev/null || true
        status=0
        $MORGANA render scene.xml --integrator path --spp 20000 --checkpoint m/c.part --checkpoint-every 0.01s --resume -o a.exr -q || status=$?
        test $status = 1
        cmp m/c.part before.part
        test "$(ls -A m)" = "c.part
filler"
        rm m/filler
        $MORGANA render scene.xml --integrator path --spp 20000 --checkpoint m/c.part --resume -o b.exr -q"#,
        4 * size / 1024
    );
    let Some((success, text)) = with_mounts(&folder, &script) else {
        return;
    };
    assert!(success, "{text}");
    // The program reports it once while it renders, and once at the end as an error. Images went
    // elsewhere.
    assert_eq!(
        text.matches("the render continues without this file")
            .count(),
        1,
        "{text}"
    );
    assert_eq!(text.matches("No space left on device").count(), 2, "{text}");
    for image in ["a.exr", "b.exr"] {
        assert!(folder.read(image) == folder.read("whole.exr"), "{image}");
    }
}

/// A checkpoint that exceeds a limit on file sizes is reported, and the image is written. Every
/// Unix has this limit.
#[cfg(unix)]
#[test]
fn a_checkpoint_that_cannot_be_written_is_said_and_the_image_is_not_lost() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --spp 4 -o whole.npy");
    let text = folder.fail_within(
        2,
        "render scene.xml --spp 4 --checkpoint c.part -o a.npy -q",
    );
    assert!(
        text.contains("c.part: cannot write: File too large"),
        "{text}"
    );
    assert!(folder.read("a.npy") == folder.read("whole.npy"));
    assert_eq!(folder.files(), ["a.npy", "scene.xml", "whole.npy"]);
}

/// The error is known before any work is done.
#[test]
fn folders_that_cannot_be_written_to_are_refused_at_once() {
    let folder = Folder::with_fog();
    let script = r#"mount -t tmpfs -o ro none m
        for options in "--checkpoint m/c.part" "--shard 0/2 -o m/a.part" "-o m/a.exr" "--stats m/s.json"; do
            status=0
            $MORGANA render scene.xml --spp 200000 $options || status=$?
            test $status = 2
        done"#;
    let Some((success, text)) = with_mounts(&folder, script) else {
        return;
    };
    assert!(success, "{text}");
    assert_eq!(text.matches("Read-only file system").count(), 4, "{text}");
}

/// A checkpoint with a changed byte is refused, and nothing is written.
#[test]
fn damaged_checkpoints_are_refused() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --integrator path --spp 1 --checkpoint c.part -o a.exr");
    std::fs::remove_file(folder.path("a.exr")).unwrap();
    let good = folder.read("c.part");
    // Try some bytes here; io/tests/io/parts.rs tries all, without starting processes.
    for place in (0..good.len()).step_by(good.len() / 20) {
        let mut bad = good.clone();
        bad[place] ^= 0x10;
        std::fs::write(folder.path("c.part"), &bad).unwrap();
        let error = folder.fail(
            1,
            "render scene.xml --spp 2 --checkpoint c.part --resume -o a.exr",
        );
        assert!(
            error.contains("c.part: not a morgana part file"),
            "{place}: {error}"
        );
        assert!(folder.read("c.part") == bad, "it is kept as it is");
    }
    std::fs::write(folder.path("c.part"), &good[..good.len() / 2]).unwrap();
    let error = folder.fail(
        1,
        "render scene.xml --spp 2 --checkpoint c.part --resume -o a.exr",
    );
    assert!(error.contains("incomplete or damaged"), "{error}");
    assert_eq!(folder.files(), ["c.part", "scene.xml"]);
}
