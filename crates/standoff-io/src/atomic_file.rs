//! Atomic file writes: a file is either complete or absent, even if the process is killed.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// Suffix of the name of a file or folder that is not complete yet.
pub const PARTIAL: &str = ".partial";

/// Writes a file atomically and durably: writes a temporary file in the same folder, flushes it to disk and renames it.
/// Until the rename, and if any step fails, the previous file stays unchanged.
pub fn save(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |file| file.write_all(bytes.as_ref()).and_then(|()| file.sync_all()))
}

/// Like [`save`], for files that can be created again: also atomic, but not flushed, so a power failure soon afterwards
/// may lose the file.
pub fn save_quickly(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |file| file.write_all(bytes.as_ref()))
}

fn put(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let partial = sibling(path, PARTIAL);
    let write = |mut file: File| write(&mut file);
    let saved = File::create(&partial).and_then(write).and_then(|()| fs::rename(&partial, path));
    if saved.is_err() {
        // Return the first error, not that of the cleanup.
        let _ = fs::remove_file(&partial);
    }
    saved
}

/// Flushes new entries of a folder to disk, on systems where folders can be opened.
pub fn sync_folder(dir: &Path) -> io::Result<()> {
    // The parent of a bare file name is the current folder.
    let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
    File::open(dir).map_or(Ok(()), |folder| folder.sync_all())
}

/// Gives a file its final path, durably: `FILE.partial`, which must be complete and flushed to disk, becomes `FILE`.
pub fn publish(path: &Path) -> io::Result<()> {
    fs::rename(sibling(path, PARTIAL), path)?;
    sync_folder(path.parent().unwrap_or(Path::new("")))
}

/// Returns the path with `addition` appended to the file name.
#[must_use]
pub fn sibling(path: &Path, addition: &str) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, ToOwned::to_owned);
    name.push(addition);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_save_leaves_no_temporary_file() {
        let home = tempfile::tempdir().unwrap();
        let taken = home.path().join("taken");
        fs::create_dir_all(taken.join("by a folder")).unwrap();
        assert!(save(&taken, "text").is_err());
        assert!(save(&home.path().join("no/such/folder"), "text").is_err());
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);

        let path = home.path().join("file");
        save(&path, "older").unwrap();
        save(&path, "newer").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "newer");
        fs::write(sibling(&path, PARTIAL), "newest").unwrap();
        publish(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "newest");
        assert!(publish(&path).is_err());
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 2);
    }
}
