//! Files appear completely or not at all.

use std::fs;
use std::io::{self as std_io, Write};
use std::path::Path;

use io::atomic;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn a_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    atomic::write_bytes(&path, b"one").unwrap();
    atomic::write_bytes(&path, b"two").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"two");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_failure_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    atomic::write_bytes(&path, b"old").unwrap();
    let full = || std_io::Error::from(std_io::ErrorKind::StorageFull);
    let error = atomic::write(&path, |file| file.write_all(b"half").and(Err(full()))).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("{}: cannot write: no storage space", path.display())
    );
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_panic_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    let panics = || atomic::write(&path, |_| panic!("in the middle"));
    assert!(std::panic::catch_unwind(panics).is_err());
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn a_folder_that_does_not_exist() {
    let error = atomic::write_bytes("no/such/a.txt".as_ref(), b"")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("no/such/a.txt: cannot write: No such file or directory"),
        "{error}"
    );
}

#[test]
fn a_file_is_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.txt");
    fs::write(&file, b"").unwrap();
    let error = atomic::write_bytes(&file.join("b.txt"), b"")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("b.txt: cannot write: Not a directory"),
        "{error}"
    );
}

#[test]
fn what_is_not_a_file_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let expected = "cannot write: it exists and is not a regular file";
    let error = atomic::write_bytes(folder.path(), b"")
        .unwrap_err()
        .to_string();
    assert_eq!(error, format!("{}: {expected}", folder.path().display()));
    #[cfg(unix)]
    {
        let error = atomic::write_bytes("/dev/null".as_ref(), b"")
            .unwrap_err()
            .to_string();
        assert_eq!(error, format!("/dev/null: {expected}"));
    }
    let error = atomic::write_bytes("".as_ref(), b"")
        .unwrap_err()
        .to_string();
    assert_eq!(error, ": cannot write: it names no file");
}

#[cfg(unix)]
#[test]
fn a_link_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.txt"), folder.path().join("link"));
    fs::write(&file, b"old").unwrap();
    std::os::unix::fs::symlink("a.txt", &link).unwrap();
    atomic::write_bytes(&link, b"new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read(&file).unwrap(), b"new");
}

#[test]
fn threads_do_not_get_in_each_others_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    std::thread::scope(|scope| {
        for i in 0..8u8 {
            let path = &path;
            scope.spawn(move || atomic::write_bytes(path, &[i; 10_000]).unwrap());
        }
    });
    let content = fs::read(&path).unwrap();
    assert_eq!(content.len(), 10_000);
    assert!(content.iter().all(|b| *b == content[0]));
    assert_eq!(names(folder.path()), ["a.txt"]);
}
