//! Input that cannot be used.

use crate::support::Folder;

/// Asserts that the program refuses, with a message that contains all parts, and writes nothing.
fn refused(folder: &Folder, arguments: &str, parts: &[&str]) {
    let before = folder.files();
    let message = folder.refuse(arguments);
    for part in parts {
        assert!(message.contains(part), "{arguments}: {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
    assert_eq!(folder.files(), before);
}

#[test]
fn outputs_are_checked_before_rendering() {
    let folder = Folder::with_fog();
    let unlimited = "render scene.xml --spp 100000000";
    refused(
        &folder,
        &format!("{unlimited} -o a.bmp"),
        &["'.bmp'", ".exr, .png, .npy"],
    );
    refused(
        &folder,
        &format!("{unlimited} -o picture"),
        &["no extension", ".exr"],
    );
    refused(
        &folder,
        &format!("{unlimited} -o gone/a.exr"),
        &["cannot write 'gone/a.exr'", "'gone'"],
    );
    refused(
        &folder,
        &format!("{unlimited} -o scene.xml/a.exr"),
        &["not a folder"],
    );
    refused(
        &folder,
        &format!("{unlimited} --stats gone/s.json"),
        &["gone"],
    );
    std::fs::create_dir(folder.path("folder.exr")).unwrap();
    refused(
        &folder,
        &format!("{unlimited} -o folder.exr"),
        &["not a regular file"],
    );
}

#[cfg(unix)]
#[test]
fn a_folder_without_permission_is_noticed_before_rendering() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_fog();
    std::fs::create_dir(folder.path("locked")).unwrap();
    let mode = std::fs::Permissions::from_mode(0o555);
    std::fs::set_permissions(folder.path("locked"), mode).unwrap();
    if std::fs::write(folder.path("locked/probe"), "").is_ok() {
        return; // Permissions do not bind root: `faults.rs` tests a read-only folder.
    }
    refused(
        &folder,
        "render scene.xml --spp 100000000 -o locked/a.exr",
        &["cannot write"],
    );
}

#[test]
fn options_are_checked() {
    let folder = Folder::with_fog();
    refused(&folder, "render scene.xml --spp 0", &["--spp", "from 1 to"]);
    refused(
        &folder,
        "render scene.xml --target-error 2%",
        &["--target-error", "write it as a fraction, 0.02"],
    );
    refused(
        &folder,
        "render scene.xml --threads 0",
        &["--threads", "from 1 to"],
    );
    refused(
        &folder,
        "render scene.xml --time soon",
        &["--time", "1h30m"],
    );
    refused(&folder, "render scene.xml -D spp", &["NAME=VALUE"]);
    refused(
        &folder,
        "render scene.xml -D spp=1 -D spp=2",
        &["-D spp is given twice"],
    );
    refused(&folder, "render scene.xml -D speed=1", &["speed"]);
    refused(
        &folder,
        "render scene.xml --integrator bdtp",
        &["unknown integrator 'bdtp'", "did you mean 'bdpt'?"],
    );
    refused(
        &folder,
        "render scene.xml --integrator path --strategies s.exr",
        &[
            "--strategies",
            "need the integrator bdpt or particle, not path",
        ],
    );
    refused(
        &folder,
        "render scene.xml --integrator bdpt --strategies s.png",
        &["'.png'", "expected .exr"],
    );
    refused(
        &folder,
        "render scene.xml --integrator bdpt --strategies gone/s.exr",
        &["cannot write 'gone/s.exr'"],
    );
    refused(
        &folder,
        "trace scene.xml --from 0,0 --direction 1,0,0",
        &["three numbers"],
    );
    refused(
        &folder,
        "trace scene.xml --from 0,0,0 --direction 0,0,0",
        &["must not be zero"],
    );
    refused(
        &folder,
        "trace scene.xml --from 0,0,0 --direction 1,0,0 -o a.png",
        &[".svg"],
    );
    refused(&folder, "paint scene.xml", &["paint"]);
}

#[test]
fn a_missing_scene_is_named() {
    refused(&Folder::with_fog(), "render gone.xml", &["gone.xml"]);
}

#[test]
fn every_mistake_is_shown_with_its_place() {
    let folder = Folder::with_scene(
        "<shape type=\"sphere\"><float name=\"raduis\" value=\"1\"/></shape>\n\
         <shape type=\"spere\"/>",
    );
    let line = {
        let text = String::from_utf8(folder.read("scene.xml")).unwrap();
        text.lines().position(|l| l.contains("raduis")).unwrap() + 1
    };
    let place = format!("scene.xml:{line}:");
    let next = format!("scene.xml:{}:", line + 1);
    for command in ["render scene.xml", "info scene.xml"] {
        let suggestions = ["did you mean 'radius'?", "did you mean 'sphere'?"];
        refused(
            &folder,
            command,
            &[&place, &next, suggestions[0], suggestions[1]],
        );
    }
    assert!(
        !folder.refuse("info scene.xml").contains('\u{1b}'),
        "no colours in a file"
    );
}

#[test]
fn help_shows_an_example_of_each_command() {
    let folder = Folder::with_fog();
    assert!(folder.succeed("--version").starts_with("morgana "));
    for command in ["render", "info", "trace", "connect"] {
        let help = folder.succeed(&format!("{command} --help"));
        assert!(
            help.contains(&format!("morgana {command} scenes/")),
            "{help}"
        );
    }
}

#[test]
fn seeds_are_whole_numbers() {
    let folder = Folder::with_fog();
    for seed in ["-1", "1.5", "18446744073709551616"] {
        let error = folder.refuse(&format!("render scene.xml --seed {seed}"));
        assert!(
            error.contains("expected a whole number from 0 to 2⁶⁴ − 1"),
            "{error}"
        );
    }
}
