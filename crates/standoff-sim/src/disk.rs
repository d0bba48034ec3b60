//! Files that are there whole or not at all, whatever ends the process.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// What a file or folder is called until it is whole: this is added to its name.
pub const PARTIAL: &str = ".partial";

/// Writes a file: under another name beside its place, seen onto the disk, then renamed. What was there before is there
/// until then; if it fails, it stays.
pub fn save(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |file| file.write_all(bytes.as_ref()).and_then(|()| file.sync_all()))
}

/// The same for what can be made again: it is whole whatever ends the process, but a power cut soon after may cost it.
pub fn save_quickly(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |file| file.write_all(bytes.as_ref()))
}

fn put(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let partial = beside(path, PARTIAL);
    let write = |mut file: File| write(&mut file);
    let saved = File::create(&partial).and_then(write).and_then(|()| fs::rename(&partial, path));
    if saved.is_err() {
        // The reason of the failure is told, not that of a failing broom.
        let _ = fs::remove_file(&partial);
    }
    saved
}

/// Sees new names in a folder onto the disk, where folders can be opened.
pub fn sync_folder(dir: &Path) -> io::Result<()> {
    // The folder of a bare name is the one we are in.
    let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
    File::open(dir).map_or(Ok(()), |folder| folder.sync_all())
}

/// The path with something added to its name.
#[must_use]
pub fn beside(path: &Path, addition: &str) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, ToOwned::to_owned);
    name.push(addition);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_put_in_its_place_leaves_nothing_beside_it() {
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
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 2);
    }
}
