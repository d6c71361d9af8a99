//! Locks: one process at a time works on a file. Locks belong to open files, so that two in one
//! process represent two processes.

use morgana_io::lock::{Lock, LockError};

#[test]
fn a_file_is_locked_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.part");
    let lock = Lock::take(&path).unwrap();
    let Err(LockError::Held(holder)) = Lock::take(&path) else {
        panic!("it is locked twice");
    };
    let this = format!("process {}", std::process::id());
    assert!(holder.starts_with(&this), "{holder}");
    // Other files are not locked, and the file itself may appear and disappear.
    Lock::take(&folder.path().join("d.part")).unwrap();
    std::fs::write(&path, b"").unwrap();
    assert!(Lock::take(&path).is_err());
    drop(lock);
    drop(Lock::take(&path).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn many_take_turns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.part");
    let inside = std::sync::atomic::AtomicU32::new(0);
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..4000 {
                    if let Ok(_lock) = Lock::take(&path) {
                        use std::sync::atomic::Ordering::SeqCst;
                        assert_eq!(inside.fetch_add(1, SeqCst), 0, "two hold the lock");
                        std::thread::sleep(std::time::Duration::from_micros(50));
                        inside.fetch_sub(1, SeqCst);
                    }
                }
            });
        }
    });
}

#[cfg(unix)]
#[test]
fn two_names_of_a_file_are_one() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("c.part"), folder.path().join("link"));
    std::fs::write(&file, b"").unwrap();
    std::os::unix::fs::symlink("c.part", &link).unwrap();
    let _lock = Lock::take(&file).unwrap();
    assert!(Lock::take(&link).is_err());
}
