//! Files and the file system: names, limits, locks, leftovers, and memory.

use crate::support::{Folder, Outcome, program};
use io::image::RgbImage;
use io::part::Part;
use std::ffi::OsStr;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Runs the program with arguments of arbitrary bytes.
fn run(folder: &Folder, arguments: &[&OsStr]) -> Outcome {
    let output = Command::new(program())
        .current_dir(folder.path("."))
        .args(arguments)
        .output()
        .unwrap();
    Outcome {
        status: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

#[test]
fn the_longest_names_are_written_and_longer_ones_are_refused_before_the_render() {
    let folder = Folder::with_fog();
    let name = |length: usize| "a".repeat(length - 4) + ".npy";
    folder.succeed(&format!("render scene.xml -o {} -q", name(254)));
    folder.succeed(&format!("render scene.xml -o {} -q", name(255)));
    for option in ["-o", "--stats", "--checkpoint"] {
        let name = name(256);
        let error = folder.refuse(&format!("render scene.xml --spp 100000000 {option} {name}"));
        assert!(error.contains("File name too long"), "{error}");
    }
    assert_eq!(folder.files().len(), 3);
}

/// Scenes with different names that are not UTF-8 have different output names.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_utf8_stay_distinct() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::with_fog();
    for byte in [0xfe, 0xff] {
        let stem = [b'a', byte];
        let name = |end: &str| OsStr::from_bytes(&[&stem, end.as_bytes()].concat()).to_owned();
        std::fs::copy(
            folder.path("scene.xml"),
            folder.path(".").join(name(".xml")),
        )
        .unwrap();
        for arguments in [
            &["--spp", "1", "-q"][..],
            &["--spp", "2", "-q", "--shard", "0/2"],
        ] {
            let scene = name(".xml");
            let first = [OsStr::new("render"), &scene];
            let all: Vec<&OsStr> = first
                .into_iter()
                .chain(arguments.iter().map(OsStr::new))
                .collect();
            let outcome = run(&folder, &all);
            assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        }
        for end in [".exr", ".0-of-2.part"] {
            assert!(folder.path(".").join(name(end)).exists(), "{end}");
        }
    }
}

/// A command never overwrites files that it reads, nor outputs that it has already written.
#[test]
fn nothing_is_overwritten_that_is_read_or_written_by_the_same_command() {
    let folder = Folder::with_scene(
        r#"<shape type="sphere"><bsdf type="diffuse">
             <texture name="reflectance" type="bitmap"><string name="filename" value="spots.png"/></texture>
           </bsdf></shape>"#,
    );
    let spots = RgbImage {
        width: 2,
        height: 2,
        pixels: vec![[0.2; 3]; 4],
    };
    let depth = io::image::png::Depth::Eight;
    io::image::png::write(&folder.path("spots.png"), &spots, depth, Default::default()).unwrap();
    folder.succeed("render scene.xml --spp 1 -o a.exr -q");
    std::fs::write(folder.path("v.npy"), [0]).unwrap();
    std::fs::create_dir(folder.path("inner")).unwrap();
    let files: Vec<_> = folder.files();
    let before: Vec<_> = ["scene.xml", "a.exr", "spots.png", "v.npy"]
        .map(|name| folder.read(name))
        .into();
    for (arguments, told) in [
        (
            "render scene.xml --stats scene.xml",
            "scene.xml' is read here",
        ),
        (
            "render scene.xml -o inner/../b.exr --stats b.exr",
            "b.exr' would be written twice",
        ),
        (
            "render scene.xml --shard 0/1 -o b.part --stats b.part",
            "b.part' would be written twice",
        ),
        (
            "render scene.xml --checkpoint b.exr -o b.exr",
            "b.exr' would be written twice",
        ),
        (
            "render scene.xml --integrator bdpt --strategies b.exr -o b.exr",
            "b.exr' would be written twice",
        ),
        (
            "render scene.xml -o spots.png",
            "spots.png' is read here: write to another file",
        ),
        ("compare a.exr a.exr --image a.exr", "a.exr' is read here"),
        ("tonemap a.exr -o a.exr", "a.exr' is read here"),
        ("export scene.xml -o scene.xml", "scene.xml' is read here"),
        ("convert v.npy -o v.npy", "v.npy' is read here"),
    ] {
        let error = folder.refuse(arguments);
        assert!(error.contains(told), "{arguments}: {error}");
    }
    assert_eq!(folder.files(), files);
    for (name, bytes) in ["scene.xml", "a.exr", "spots.png", "v.npy"]
        .into_iter()
        .zip(before)
    {
        assert!(folder.read(name) == bytes, "{name}");
    }
}

/// Tests names that would clear the screen, start a line, or reverse the direction of text.
#[cfg(unix)]
#[test]
fn names_cannot_drive_the_terminal() {
    let folder = Folder::with_fog();
    let name = "a\u{1b}[2J\nerror: \u{202e}b.xml";
    std::fs::copy(folder.path("scene.xml"), folder.path(name)).unwrap();
    let quiet = |text: &str| {
        let drives = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!text.contains(drives), "{text:?}");
        assert!(!text.contains("\nerror: \\u{202e}b"), "{text:?}");
    };
    for arguments in [
        vec!["check", name],
        vec!["info", name],
        vec!["render", name, "-o", "a\u{1b}.x"],
    ] {
        let arguments: Vec<&OsStr> = arguments.into_iter().map(OsStr::new).collect();
        let outcome = run(&folder, &arguments);
        quiet(&outcome.stdout);
        quiet(&outcome.stderr);
        let all = outcome.stdout + &outcome.stderr;
        assert!(all.contains(r"a\u{1b}"), "{all}");
    }
    let outcome = run(&folder, &["check".as_ref(), "no\u{1b}\nsuch.xml".as_ref()]);
    quiet(&outcome.stderr);
    assert!(
        outcome.stderr.contains(r"no\u{1b}\nsuch.xml"),
        "{outcome:?}"
    );
}

/// Names in a scene cannot control the terminal either.
#[test]
fn names_in_scenes_cannot_drive_the_terminal() {
    let folder = Folder::with_file("");
    let scene = r#"{"type": "scene", "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 2, "height": 2}},
        "light": {"type": "constant"}, "a\u001b[2J": {"type": "sphere", "bsdf": {"type": "null"},
        "interior": {"type": "homogeneous", "id": "fog\u001b[31m", "sigma_t": 1.0}}}"#;
    std::fs::write(folder.path("a.json"), scene).unwrap();
    for command in ["check", "info"] {
        let outcome = folder.run(&format!("{command} a.json"));
        let all = outcome.stdout + &outcome.stderr;
        assert!(!all.contains('\u{1b}'), "{all:?}");
    }
}

#[test]
fn check_and_render_agree_on_what_fits_into_memory() {
    let folder = Folder::with_fog();
    let text = String::from_utf8(folder.read("scene.xml")).unwrap();
    let large = text.replace(
        "name=\"width\" value=\"8\"",
        "name=\"width\" value=\"30000\"",
    );
    let large = large.replace(
        "name=\"height\" value=\"6\"",
        "name=\"height\" value=\"30000\"",
    );
    std::fs::write(folder.path("large.xml"), large).unwrap();
    for command in ["check", "render"] {
        let error = folder.refuse(&format!("{command} large.xml"));
        assert!(
            error.contains("a film of 30000 × 30000 pixels needs"),
            "{error}"
        );
        let error = folder.refuse(&format!("{command} scene.xml --memory 1K"));
        assert!(
            error.contains("more than the limit of 1.0 KiB (--memory)"),
            "{error}"
        );
    }
    folder.succeed("check scene.xml --memory 1M");
}

#[test]
fn files_take_as_much_memory_as_the_user_says() {
    let folder = Folder::with_fog();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4000 3000 1000\nencoding: gzip\n\n";
    let mut file = header.as_bytes().to_vec();
    file.resize(32 << 20, 0);
    std::fs::write(folder.path("a.nrrd"), &file).unwrap();
    let error = folder.refuse("convert a.nrrd -o b.npy --axes zyx");
    assert!(
        error.contains(
            "it needs 89.4 GiB of memory, more than the limit of 2.0 GiB: raise --memory"
        ),
        "{error}"
    );
    // The user's limit may exceed the available memory.
    let error = folder.refuse("convert a.nrrd -o b.npy --axes zyx --memory 100T");
    assert!(
        error.contains("damaged") || error.contains("more than this system has"),
        "{error}"
    );
}

/// Scenes in files without an end, or in pipes that never deliver, are refused at once.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_at_once() {
    let folder = Folder::with_fog();
    let made = Command::new("mkfifo").arg(folder.path("pipe.xml")).status();
    assert!(made.unwrap().success());
    for (scene, what) in [
        ("pipe.xml", "a pipe"),
        ("/dev/zero", "a device"),
        (".", "a folder"),
    ] {
        let error = folder.refuse(&format!("check {scene}"));
        assert!(
            error.contains(&format!("{what}, not a regular file")),
            "{error}"
        );
    }
    let script = "exec \"$MORGANA\" check <(cat scene.xml)";
    let output = Command::new("bash")
        .args(["-c", script])
        .env("MORGANA", program())
        .current_dir(folder.path("."))
        .output();
    let error = String::from_utf8(output.unwrap().stderr).unwrap();
    assert!(
        error.contains("a pipe, not a regular file: save its data in a file first"),
        "{error}"
    );
}

/// Exceeding a limit on file sizes gives an error message. The parent process has not set its
/// signal to be ignored.
#[cfg(unix)]
#[test]
fn a_limit_on_the_size_of_files_is_an_error_with_a_message() {
    let folder = Folder::with_fog();
    let text = folder.fail_within(0, "render scene.xml -o a.npy -q");
    assert!(
        text.contains("a.npy: cannot write: File too large"),
        "{text}"
    );
    assert_eq!(folder.files(), ["scene.xml"]);
}

fn start(folder: &Folder, arguments: &str) -> Child {
    Command::new(program())
        .current_dir(folder.path("."))
        .args(arguments.split(' '))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn wait_for(mut ready: impl FnMut() -> bool) {
    let started = Instant::now();
    while !ready() {
        assert!(started.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn one_process_works_on_a_checkpoint() {
    let folder = Folder::with_fog();
    let render = "render scene.xml --spp 100000000 --threads 1 --checkpoint c.part --checkpoint-every 0.01s --resume -q -o a.npy";
    let mut first = start(&folder, render);
    wait_for(|| folder.path("c.part").exists());
    // If it were not refused, the time limit would end it.
    let error = folder.refuse(&format!("{render} --time 20s"));
    let holder = format!("'c.part' is in use by process {}", first.id());
    assert!(error.contains(&holder), "{error}");
    // A killed process holds no lock.
    first.kill().unwrap();
    first.wait().unwrap();
    let mut second = start(&folder, render);
    std::thread::sleep(Duration::from_millis(300));
    assert!(second.try_wait().unwrap().is_none());
    second.kill().unwrap();
    second.wait().unwrap();
}

#[test]
fn parts_of_other_builds_are_refused() {
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --shard 0/2 -q");
    folder.succeed("render scene.xml --shard 1/2 -q");
    let path = folder.path("scene.1-of-2.part");
    let mut part = Part::read(&path).unwrap();
    let of_path = transport::render::results(["path"].into_iter());
    assert_eq!(part.header.results, of_path);
    part.header.results = "0123456789abcdef".into();
    part.write(&path).unwrap();
    let error = folder.refuse("merge scene.0-of-2.part scene.1-of-2.part -o a.npy");
    assert!(
        error.contains("it comes from another build of version"),
        "{error}"
    );
    let error = folder.refuse("render scene.xml --shard 1/2 --resume");
    assert!(
        error.contains("whose estimators give other results"),
        "{error}"
    );
}
