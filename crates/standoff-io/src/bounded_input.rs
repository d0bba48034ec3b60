//! Reads files of unknown origin: checks the type and the size of a file before any byte is read.
//!
//! A program without a file system, such as a page in a browser, [`give`]s files in memory instead.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};

use bytes::Bytes;

thread_local! {
    static GIVEN: RefCell<BTreeMap<PathBuf, Bytes>> = const { RefCell::new(BTreeMap::new()) };
}

/// Gives a file in memory: on this thread, [`open`] reads these bytes in place of a file on disk.
pub fn give(path: &Path, bytes: Bytes) {
    GIVEN.with_borrow_mut(|given| given.insert(path.to_owned(), bytes));
}

/// Runs `read` while a file in memory is given on this thread.
pub fn with_given<T>(path: &Path, bytes: impl AsRef<[u8]> + Send + 'static, read: impl FnOnce() -> T) -> T {
    give(path, Bytes::from_owner(bytes));
    let done = read();
    GIVEN.with_borrow_mut(|given| given.remove(path));
    done
}

/// A file that is open for reading.
#[derive(Debug)]
pub enum Input {
    /// A file on disk.
    Disk(File),
    /// A file in memory.
    Given(Cursor<Bytes>),
}

impl From<File> for Input {
    fn from(file: File) -> Self {
        Self::Disk(file)
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Disk(file) => file.read(buffer),
            Self::Given(bytes) => bytes.read(buffer),
        }
    }
}

/// Opens a file of at most `most` bytes for reading.
///
/// Folders, pipes (reading would wait for a writer), devices (some never end) and files that are too large are rejected
/// unread.
pub fn open(path: &Path, most: u64) -> io::Result<Input> {
    match GIVEN.with_borrow(|given| given.get(path).cloned()) {
        Some(bytes) if bytes.len() as u64 > most => Err(too_large(bytes.len() as u64, most)),
        Some(bytes) => Ok(Input::Given(Cursor::new(bytes))),
        None => open_on_disk(path, most).map(Input::Disk),
    }
}

fn open_on_disk(path: &Path, most: u64) -> io::Result<File> {
    let found = fs::metadata(path).map_err(|reason| match reason.kind() {
        // A page has no file system.
        io::ErrorKind::Unsupported => io::Error::new(io::ErrorKind::NotFound, "drop this file on the page, too"),
        _ => reason,
    })?;
    if !found.is_file() {
        let pipe = "it is a pipe or a device, not a file; write its contents to a file";
        return Err(io::Error::other(if found.is_dir() { "it is a folder, not a file" } else { pipe }));
    }
    if found.len() > most {
        return Err(too_large(found.len(), most));
    }
    File::open(path)
}

/// Reads all bytes of a file of at most `most` bytes.
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // The file may have grown since its size was checked.
    open(path, most)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(bytes.len() as u64, most)) } else { Ok(bytes) }
}

/// Reads the UTF-8 text of a file of at most `most` bytes.
pub fn text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(bytes(path, most)?).map_err(|_| io::Error::other("it is not UTF-8 text"))
}

/// Returns the name of the encoding if the first eight bytes are those of UTF-16 or UTF-32 text, with or without a byte
/// order mark.
pub fn wide_encoding(head: &[u8]) -> Option<&'static str> {
    match head {
        // The byte order mark of UTF-32 begins with that of UTF-16, so UTF-32 is tested first.
        [0xFF, 0xFE, 0, 0, ..] | [0, 0, 0xFE, 0xFF, ..] => Some("UTF-32"),
        [1..=255, 0, 0, 0, 1..=255, 0, 0, 0, ..] | [0, 0, 0, 1..=255, 0, 0, 0, 1..=255, ..] => Some("UTF-32"),
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, 1..=255, ..] | [1..=255, 0, ..] => Some("UTF-16"),
        _ => None,
    }
}

/// Returns whether the cause is the named file rather than the machine: a wrong type or size (detected here, without a
/// system error code), a missing file, or missing permissions.
pub fn is_input_error(reason: &io::Error) -> bool {
    use io::ErrorKind::{InvalidFilename, InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied};
    let wrong = [InvalidFilename, InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied];
    reason.raw_os_error().is_none() || wrong.contains(&reason.kind())
}

/// Returns the advice for a file that cannot be read or written; `usual` is the advice for most errors.
pub fn advice<'a>(reason: &io::Error, usual: &'a str) -> &'a str {
    // EMFILE and ENFILE have no `ErrorKind` yet.
    let too_many_open = cfg!(unix) && matches!(reason.raw_os_error(), Some(23 | 24));
    match reason.kind() {
        _ if too_many_open => "close other programs, or raise the limit (ulimit -n)",
        io::ErrorKind::PermissionDenied => "check its permissions, or choose a file that you may access",
        _ => usual,
    }
}

fn too_large(bytes: u64, most: u64) -> io::Error {
    let message = format!("it has {}; at most {}", size(bytes), size(most));
    io::Error::new(io::ErrorKind::FileTooLarge, message)
}

/// Formats a number of bytes for messages; rounds up, so that a size above a limit never looks like the limit.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} bytes"),
        10_000..=9_999_999 => format!("{} KiB", bytes.div_ceil(1 << 10)),
        _ => format!("{} MiB", bytes.div_ceil(1 << 20)),
    }
}

/// Formats the message for a file that cannot be read, with advice if the machine is the cause.
pub fn cannot_be_read(reason: &io::Error) -> String {
    match is_input_error(reason) {
        true => format!("cannot be read: {reason}"),
        false => format!("cannot be read: {reason}; {}", advice(reason, "check the disk")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_in_memory_take_the_place_of_files_on_disk() {
        let path = Path::new("not/on/disk.csv");
        assert_eq!(text(path, 5).unwrap_err().kind(), io::ErrorKind::NotFound);
        assert_eq!(with_given(path, *b"t", || text(path, 5)).unwrap(), "t");
        assert_eq!(text(path, 5).unwrap_err().kind(), io::ErrorKind::NotFound);
        give(path, Bytes::from_static(b"t,id"));
        assert_eq!(text(path, 4).unwrap(), "t,id");
        assert!(text(path, 3).unwrap_err().to_string().contains("3 bytes"));
    }

    #[test]
    fn oversized_files_are_rejected_with_both_sizes() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("file");
        fs::write(&path, "12345").unwrap();
        assert_eq!(text(&path, 5).unwrap(), "12345");
        assert_eq!(text(&path, 4).unwrap_err().to_string(), "it has 5 bytes; at most 4 bytes");
        File::create(&path).unwrap().set_len(1_000_000_000).unwrap();
        assert_eq!(open(&path, 512 << 20).unwrap_err().to_string(), "it has 954 MiB; at most 512 MiB");
    }

    #[test]
    fn folders_and_devices_are_rejected_unread() {
        let home = tempfile::tempdir().unwrap();
        assert_eq!(open(home.path(), 9).unwrap_err().to_string(), "it is a folder, not a file");
        assert_eq!(open(&home.path().join("none"), 9).unwrap_err().kind(), io::ErrorKind::NotFound);
        #[cfg(unix)]
        assert_eq!(
            open(Path::new("/dev/zero"), 9).unwrap_err().to_string(),
            "it is a pipe or a device, not a file; write its contents to a file"
        );
    }

    #[test]
    #[cfg(unix)]
    fn machine_errors_are_not_input_errors() {
        let system = io::Error::from_raw_os_error;
        for (wrong, codes) in [(true, &[2, 13, 20, 21][..]), (false, &[5, 12, 23, 24])] {
            assert!(codes.iter().all(|&code| is_input_error(&system(code)) == wrong), "{codes:?}");
        }
        assert!(is_input_error(&too_large(2, 1)));
        assert_eq!(advice(&system(24), "usual"), "close other programs, or raise the limit (ulimit -n)");
        assert_eq!((advice(&system(5), "usual"), advice(&too_large(2, 1), "usual")), ("usual", "usual"));
    }

    #[test]
    fn non_utf8_bytes_are_rejected() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("file");
        fs::write(&path, b"a\xff").unwrap();
        assert_eq!(text(&path, 5).unwrap_err().to_string(), "it is not UTF-8 text");
    }
}
