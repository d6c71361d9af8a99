//! Allowed dependencies of modules (ARCHITECTURE.md), taken from the `use` lines and paths of the
//! sources.

mod sources;

use sources::{below, root};
use std::fs;

/// Asserts that no source below `room` mentions any of the `forbidden` paths, except in comments.
fn refuses(room: &str, forbidden: &[&str]) {
    let files = below(&root().join("crates").join(room), &["rs"]);
    assert!(!files.is_empty(), "{room} has no sources");
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            for word in forbidden {
                let place = format!("{}:{}", file.display(), number + 1);
                assert!(!code.contains(word), "{place} uses {word}: {line}");
            }
        }
    }
}

/// Every warning of a scene belongs to a check, whose name users silence.
#[test]
fn warnings_of_scenes_have_names() {
    for room in ["assemble", "draft", "json", "query", "xml"] {
        let nameless = ["Diagnostic::warning(", "Diagnostic::note("];
        refuses(&format!("io/src/{room}"), &nameless);
    }
}

#[test]
fn crates_depend_downwards_only() {
    refuses(
        "eikonal/src",
        &[
            "optics::",
            "transport::",
            "io::",
            "std::fs",
            "std::thread",
            "rayon",
        ],
    );
    refuses(
        "optics/src",
        &[
            "transport::",
            "::io::",
            "use io",
            "std::fs",
            "std::thread",
            "rayon",
        ],
    );
    refuses(
        "transport/src",
        &["::io::", "use io", "std::fs", "clap::", "println!"],
    );
    refuses("gpu/src", &["::io::", "use io", "std::fs", "println!"]);
    refuses(
        "formats/src",
        &[
            "::io::read_scene",
            "use io::scene",
            "::scene",
            "assemble",
            "clap::",
            "println!",
            "process::exit",
            "view::",
        ],
    );
    refuses(
        "io/src",
        &["clap::", "println!", "eprintln!", "process::exit", "view::"],
    );
    refuses(
        "view/src",
        &[
            "clap::",
            "println!",
            "eprintln!",
            "process::exit",
            "std::fs",
        ],
    );
}

#[test]
fn inside_transport_data_flows_one_way() {
    let above_leaves = [
        "crate::scene",
        "crate::path",
        "crate::integrator",
        "crate::render",
    ];
    refuses("transport/src/observe/film", &above_leaves);
    refuses(
        "transport/src/path",
        &["crate::integrator", "crate::render"],
    );
    // Folders of `path` in order: each uses only those before it. `connection` and the walks do not
    // use one another.
    let rooms = [
        "segment",
        "learnt",
        "workspace",
        "connection",
        "walk",
        "random_walk",
        "subpath",
    ];
    for (i, room) in rooms.iter().enumerate() {
        let above = rooms[i + 1..].iter().map(|above| format!("path::{above}"));
        let above: Vec<_> = above.collect();
        let above: Vec<_> = above.iter().map(String::as_str).collect();
        if *room != "workspace" {
            refuses(&format!("transport/src/path/{room}"), &above);
        }
    }
    for walk in ["walk", "random_walk"] {
        refuses(&format!("transport/src/path/{walk}"), &["path::connection"]);
    }
    refuses(
        "transport/src/photons",
        &["crate::integrator", "crate::render"],
    );
    refuses("transport/src/integrator", &["crate::render"]);
    refuses(
        "transport/src/trace",
        &["crate::integrator", "crate::render"],
    );
    refuses(
        "transport/src/observe/meter",
        &[
            "crate::integrator",
            "crate::render",
            "crate::film",
            "crate::device",
        ],
    );
    refuses("transport/src/device", &["crate::render"]);
}

#[test]
fn inside_io_descriptions_know_nothing_of_readers_and_scenes() {
    let readers = ["crate::xml", "crate::json", "crate::draft"];
    let above = ["crate::query", "crate::assemble"];
    for room in [
        "scene",
        "schema",
        "query",
        "assemble/field",
        "assemble/bsdf",
    ] {
        refuses(&format!("io/src/{room}"), &readers);
    }
    for room in ["scene", "schema", "draft", "xml", "json"] {
        refuses(&format!("io/src/{room}"), &above);
    }
    refuses("io/src/scene", &["crate::schema"]);
    refuses("io/src/draft", &["crate::schema"]);
}

/// The server does not depend on what it serves.
#[test]
fn the_server_of_the_viewer_knows_nothing_of_what_it_shows() {
    refuses(
        "view/src/server",
        &[
            "crate::api",
            "crate::item",
            "crate::live",
            "io::image",
            "transport::",
        ],
    );
}

/// Only `path` derives directions, distances and geometry terms between vertices.
#[test]
fn integrators_derive_no_geometry() {
    for room in ["integrator", "observe/meter"] {
        refuses(
            &format!("transport/src/{room}"),
            &[".distance(", "distance_squared", "solver.connect"],
        );
    }
}
