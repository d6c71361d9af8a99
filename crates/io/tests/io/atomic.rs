//! Files appear completely or not at all.

use std::fs;
use std::io::{self as std_io, Write};
use std::path::Path;

use morgana_io::atomic;

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
    let expected = "cannot write: it exists, but is not a regular file";
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

/// Writing to a link to a link to a missing file creates the file and keeps the link.
#[cfg(unix)]
#[test]
fn a_link_to_nothing_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |name: &str| folder.path().join(name);
    fs::create_dir(in_folder("data")).unwrap();
    std::os::unix::fs::symlink("data/a.txt", in_folder("first")).unwrap();
    std::os::unix::fs::symlink(in_folder("first"), in_folder("second")).unwrap();
    let link = in_folder("second");
    atomic::probe(&link).unwrap();
    atomic::write_bytes(&link, b"new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(
        fs::symlink_metadata(in_folder("first"))
            .unwrap()
            .is_symlink()
    );
    assert_eq!(fs::read(in_folder("data/a.txt")).unwrap(), b"new");
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

/// The longest possible name can be written, because the temporary file has its own name.
#[test]
fn the_longest_name_can_be_written_and_a_longer_one_is_refused_by_a_probe() {
    let folder = tempfile::tempdir().unwrap();
    let longest = folder.path().join("a".repeat(255));
    atomic::probe(&longest).unwrap();
    atomic::write_bytes(&longest, b"").unwrap();
    let error = atomic::probe(&folder.path().join("a".repeat(256))).unwrap_err();
    assert!(error.to_string().contains("File name too long"), "{error}");
    assert!(atomic::probe(&folder.path().join("none/a")).is_err());
    assert_eq!(names(folder.path()), ["a".repeat(255)]);
}

/// Files left by killed processes are removed. Files that another process may be using stay. It may
/// be a live process of this machine, which locks them. It may also belong to another machine that
/// shares the folder, whose locks may be invisible here.
#[test]
fn what_killed_processes_have_left_is_removed() {
    const MINUTES: u64 = 120;
    const DAYS: u64 = 2 * 24 * 60 * 60;
    let folder = tempfile::tempdir().unwrap();
    let mut ours = String::new();
    atomic::write(&folder.path().join("a.txt"), |_| {
        ours = names(folder.path())[0].clone();
        Ok(())
    })
    .unwrap();
    let machine = ours.split('-').nth(1).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let left = |name: &str, age: u64| {
        let file = fs::File::create(folder.path().join(name)).unwrap();
        let then = std::time::SystemTime::now() - std::time::Duration::from_secs(age);
        file.set_modified(then).unwrap();
        file
    };
    let name = |machine: &str, number: u32| format!(".morgana-{machine}-999999999-{number}.tmp");
    left(&name(machine, 1), MINUTES);
    left(&name(machine, 2), 0);
    let locked = left(&name(machine, 3), MINUTES);
    locked.lock().unwrap();
    left(&name("ffffffff", 4), MINUTES);
    left(&name("ffffffff", 5), DAYS);
    left(".morgana-notes.txt", DAYS);
    left(".morgana-0123456789abcdef.lock", DAYS);
    atomic::write_bytes(&folder.path().join("b.txt"), b"").unwrap();
    let mut found = names(folder.path());
    found.sort();
    let mut kept = [
        name(machine, 2),
        name(machine, 3),
        name("ffffffff", 4),
        ".morgana-notes.txt".into(),
        ".morgana-0123456789abcdef.lock".into(),
        "b.txt".into(),
    ];
    kept.sort();
    assert_eq!(found, kept);
}

#[cfg(unix)]
#[test]
fn what_takes_the_place_of_a_file_has_its_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("secret");
    let mode = || std::fs::metadata(&path).unwrap().permissions().mode() & 0o777;
    atomic::write_bytes(&path, b"one").unwrap();
    for permitted in [0o600, 0o640, 0o444] {
        std::fs::set_permissions(&path, PermissionsExt::from_mode(permitted)).unwrap();
        atomic::write_bytes(&path, b"two").unwrap();
        assert_eq!(mode(), permitted);
    }
}
