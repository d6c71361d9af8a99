//! Inputs without an end, and inputs that may never begin, are refused at once.
#![cfg(unix)]

use morgana_io::image::{ImageLayers, RgbImage};
use morgana_io::input::{open, read};
use morgana_io::mesh::MeshData;
use morgana_io::part::Part;
use morgana_io::volume::{AxisOrder, Options, Volume};
use morgana_io::{LoadOptions, ies, load_scene};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;

/// Returns the message of each reader for a file.
fn refusals(folder: &Path, target: &Path) -> Vec<(String, String)> {
    let link = |name: &str| {
        let path = folder.join(name);
        let _ = std::fs::remove_file(&path);
        symlink(target, &path).unwrap();
        path
    };
    let mut all = Vec::new();
    let mut add = |name: &str, error: String| all.push((name.to_owned(), error));
    for extension in [
        "vol", "npy", "npz", "h5", "mat", "nrrd", "nhdr", "vti", "vtk", "vdb",
    ] {
        let name = format!("a.{extension}");
        let options = Options::order(AxisOrder::ZYX).of("a");
        let error = Volume::<f32>::read(&link(&name), options).unwrap_err();
        add(&name, error.to_string());
    }
    for name in ["a.obj", "a.ply", "a.gltf", "a.glb"] {
        add(name, MeshData::read(&link(name)).unwrap_err().to_string());
    }
    for name in ["a.exr", "a.png", "a.jpg"] {
        add(name, RgbImage::read(&link(name)).unwrap_err().to_string());
    }
    let array = ImageLayers::read(&link("b.npy")).unwrap_err();
    add("b.npy", array.to_string());
    add("a.ies", ies::read(&link("a.ies")).unwrap_err().to_string());
    add(
        "a.part",
        Part::read(&link("a.part")).unwrap_err().to_string(),
    );
    for name in ["a.xml", "a.json"] {
        let error = load_scene(&link(name), &LoadOptions::default()).unwrap_err();
        add(name, error.to_string());
    }
    all
}

#[test]
fn only_regular_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let socket = folder.path().join("socket");
    let _listener = UnixListener::bind(&socket).unwrap();
    for (target, what) in [
        (Path::new("/dev/zero"), "a device"),
        (Path::new("/dev/full"), "a device"),
        (pipe.as_path(), "a pipe"),
        (socket.as_path(), "a socket"),
        (folder.path(), "a folder"),
    ] {
        for (name, error) in refusals(folder.path(), target) {
            let expected = format!("{what}, not a regular file: save its data in a file first");
            assert!(error.contains(&expected), "{name}: {error}");
        }
    }
}

/// A header may name a file with the data.
#[test]
fn data_elsewhere_are_no_exception() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nhdr");
    let header =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\ndata file: /dev/zero\n";
    std::fs::write(&path, header).unwrap();
    let error = Volume::<f32>::read(&path, Options::order(AxisOrder::ZYX)).unwrap_err();
    assert!(
        error.to_string().contains("a device, not a regular file"),
        "{error}"
    );
}

#[test]
fn a_file_is_read_as_it_was_when_it_was_opened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    std::fs::write(&path, b"four").unwrap();
    assert_eq!(open(&path).unwrap().1, 4);
    assert_eq!(read(&path).unwrap(), b"four");
    // The system generates this file on reading, without a known size.
    assert_eq!(read(Path::new("/proc/self/status")).unwrap(), b"");
}

/// A pointer of Git LFS in place of a large file is reported by every reader.
#[test]
fn pointers_of_git_lfs_are_named() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, pointer).unwrap();
        path
    };
    let limits = morgana_io::Limits::default();
    let mut errors = Vec::new();
    for name in ["a.exr", "a.hdr", "a.png"] {
        errors.extend(RgbImage::read(&at(name)).err());
    }
    for name in ["a.obj", "a.ply", "a.glb"] {
        errors.extend(MeshData::read(&at(name)).err());
    }
    for name in ["a.vol", "a.vdb", "a.nrrd"] {
        let options = Options::default().within(limits);
        errors.extend(Volume::<f32>::read(&at(name), options).err());
    }
    errors.extend(morgana_io::spd::read(&at("a.spd")).err());
    assert_eq!(errors.len(), 10);
    for error in errors {
        let message = error.to_string();
        assert!(message.contains("run `git lfs pull`"), "{message}");
    }
}
