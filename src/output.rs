//! Output files that appear whole or not at all.

#[cfg(unix)]
use std::fs::TryLockError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError as TryLock};
use std::thread;
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::cancel::checkpoint;

/// Writes a file that appears whole or not at all.
///
/// `fill` writes to a temporary file beside the target, which replaces the target once it is complete. The next write
/// removes temporary files of processes that were killed. A symbolic link stays a link, and the file that it leads to
/// is replaced. An existing target that is not an ordinary file (a device, a pipe, a file that a process has open) is
/// never replaced: everything is written into it at once.
pub fn replace(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    remove_left_behind(folder_of(&link_target(path)));
    add(path, fill)
}

/// Writes a file as [`replace`] does, but leaves the temporary files of killed processes: a folder of many files takes
/// long to look through.
pub fn add(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    let fill = |file: &mut File| {
        let mut buffered = BufWriter::with_capacity(1 << 16, file);
        fill(&mut buffered)?;
        buffered.flush()
    };
    if is_stream(path) {
        // Writers of archives seek backwards in their file, which a stream does not allow.
        let mut file = tempfile::tempfile()?;
        fill(&mut file)?;
        file.rewind()?;
        io::copy(&mut file, &mut OpenOptions::new().append(true).open(path)?)?;
        return Ok(());
    }
    let target = link_target(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    let (mut file, unfinished) = Unfinished::make(|| builder.make_in(folder_of(&target), make_locked))?;
    fill(file.as_file_mut())?;
    // The last moment at which a stopped operation leaves no file.
    checkpoint();
    file.persist(&target)?;
    drop(unfinished);
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Prefix and suffix of the names of temporary files.
const PREFIX: &str = ".ldi-ops-";
const SUFFIX: &str = ".part";

/// Creates a temporary file and locks it for as long as it is open, so that other processes know that it is being
/// written. It is an ordinary file with the permissions that the umask gives.
fn make_locked(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).create_new(true).open(path)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        // Between creation and locking another process may take the file for an abandoned one, and remove it. With this
        // error another name is tried.
        let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if is_taken || file.metadata()?.nlink() == 0 {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
    }
    Ok(file)
}

/// Removes the temporary files in a folder that no process has locked: their processes were killed. Where files cannot
/// be locked, or may not be removed, they stay.
#[cfg(unix)]
fn remove_left_behind(folder: &Path) {
    let is_ours = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours)) {
        let path = entry.path();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && OpenOptions::new().write(true).open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(not(unix))]
fn remove_left_behind(_folder: &Path) {}

/// The temporary files that are being written.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files of all writes in progress, and blocks all others from beginning or ending: for a process
/// that is about to be terminated and would leave them behind. It must then exit, since writes block from here on.
pub fn abandon() {
    // The thread that calls this when out of memory may itself be beginning or ending a write, so that waiting is
    // limited.
    for _ in 0..PATIENCE_STEPS {
        let mut unfinished = match UNFINISHED.try_lock() {
            Err(TryLock::WouldBlock) => {
                thread::sleep(PATIENCE_STEP);
                continue;
            }
            Err(TryLock::Poisoned(poisoned)) => poisoned.into_inner(),
            Ok(unfinished) => unfinished,
        };
        abandon_those(&mut unfinished, |_| true);
        std::mem::forget(unfinished);
        return;
    }
}

/// One second, in steps.
const PATIENCE_STEPS: u32 = 100;
const PATIENCE_STEP: Duration = Duration::from_millis(10);

fn abandon_those(unfinished: &mut Vec<PathBuf>, chosen: impl Fn(&Path) -> bool) {
    for path in unfinished.extract_if(.., |path| chosen(path)) {
        // A file that has just been completed or removed need not be removed.
        let _ = fs::remove_file(path);
    }
}

/// Keeps a temporary file in the list of unfinished ones for as long as it lives.
struct Unfinished(PathBuf);

impl Unfinished {
    /// Creates a temporary file; every one that exists is in the list of unfinished ones.
    fn make(make: impl FnOnce() -> io::Result<NamedTempFile>) -> io::Result<(NamedTempFile, Unfinished)> {
        let mut unfinished = unfinished();
        let file = make()?;
        let path = file.path().to_path_buf();
        unfinished.push(path.clone());
        Ok((file, Unfinished(path)))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// Returns whether the path names something that exists and must not be replaced.
fn is_stream(path: &Path) -> bool {
    let of_a_process = ["/dev/fd", "/dev/stdout", "/dev/stderr", "/proc"].iter().any(|folder| path.starts_with(folder));
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() || of_a_process)
}

/// Number of links that are followed, since a cycle of them has no end.
const LINKS: usize = 40;

/// Returns the path that a symbolic link leads to, whether that exists or not; any other path unchanged.
pub fn link_target(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    target
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_writes_keep_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        replace(&path, |file| file.write_all(b"old")).unwrap();
        let failed = replace(&path, |file| {
            file.write_all(b"new")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn abandoned_writes_leave_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let abandoned = replace(&path, |file| {
            file.write_all(b"half")?;
            assert_eq!(fs::read_dir(folder.path())?.count(), 1);
            // Only this test's: others write at the same time.
            abandon_those(&mut unfinished(), |path| path.starts_with(folder.path()));
            assert_eq!(fs::read_dir(folder.path())?.count(), 0);
            file.write_all(b"whole")
        });
        assert!(abandoned.is_err() && fs::read_dir(folder.path()).unwrap().count() == 0);
    }

    #[cfg(unix)]
    #[test]
    fn partial_files_of_killed_processes_alone_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in [".ldi-ops-killed.part", ".foreign.part", ".ldi-ops-killed.txt"] {
            fs::write(at(name), "half").unwrap();
        }
        std::os::unix::fs::symlink(".foreign.part", at(".ldi-ops-link.part")).unwrap();
        let names = || {
            let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
            let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
            names.sort();
            names
        };
        let kept = [".foreign.part", ".ldi-ops-killed.txt", ".ldi-ops-link.part"];
        replace(&at("a"), |file| {
            let first: Vec<String> = names().into_iter().filter(|name| !kept.contains(&name.as_str())).collect();
            assert!(matches!(&first[..], [name] if name.ends_with(".part") && name != ".ldi-ops-killed.part"));
            // A second write does not touch the file of the first.
            replace(&at("b"), |file| file.write_all(b"b"))?;
            assert!(names().contains(&first[0]));
            file.write_all(b"a")
        })
        .unwrap();
        assert_eq!(names(), [&kept[..], &["a", "b"]].concat());
        assert_eq!((fs::read(at("a")).unwrap(), fs::read(at("b")).unwrap()), (b"a".to_vec(), b"b".to_vec()));
    }

    #[cfg(unix)]
    #[test]
    fn writing_through_a_link_keeps_the_link() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("inner")).unwrap();
        // Twice: the file is first created and then replaced.
        std::os::unix::fs::symlink("inner/b", at("a")).unwrap();
        for text in ["one", "two"] {
            replace(&at("a"), |file| file.write_all(text.as_bytes())).unwrap();
            assert!(fs::symlink_metadata(at("a")).unwrap().is_symlink());
            assert_eq!(fs::read_to_string(at("inner/b")).unwrap(), text);
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn writing_to_a_device_keeps_the_device() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("full");
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        let failed = replace(&link, |file| file.write_all(b"text"));
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(!fs::metadata(&link).unwrap().is_file());
        replace(Path::new("/dev/null"), |file| file.write_all(b"text")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
