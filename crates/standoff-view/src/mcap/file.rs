//! The partial file: written next to its final path and renamed when complete. Foreign files are never overwritten.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read as _};
use std::path::{Path, PathBuf};

use standoff_io::atomic_file;

use super::error::McapError;

/// `FILE.partial`, deleted on drop unless it is kept.
pub(super) struct Partial {
    path: PathBuf,
    /// Final path.
    place: PathBuf,
    keep: bool,
}

impl Partial {
    /// Creates the partial file for the final path `place`. A partial file of an interrupted run is overwritten.
    pub(super) fn create(place: &Path) -> Result<(Self, BufWriter<File>), McapError> {
        if place.file_name().is_none() {
            return Err(McapError::NoName { path: place.to_owned() });
        }
        check_replaceable(place)?;
        let path = atomic_file::sibling(place, atomic_file::PARTIAL);
        check_replaceable(&path)?;
        let refused = |reason| McapError::Write { path: path.clone(), reason };
        // The file is truncated only after it is locked.
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(&path).map_err(refused)?;
        // If the file system does not support locks, runs are assumed to use different files.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(McapError::InUse { path });
        }
        file.set_len(0).map_err(refused)?;
        let place = place.to_owned();
        Ok((Self { path, place, keep: false }, BufWriter::new(file)))
    }

    /// Makes the error of a failed write.
    pub(super) fn failed(&self, reason: mcap::McapError) -> McapError {
        let reason = match reason {
            mcap::McapError::Io(reason) => reason,
            other => io::Error::other(other),
        };
        McapError::Write { path: self.path.clone(), reason }
    }

    /// Keeps the file under its partial name.
    pub(super) fn leave(mut self, file: BufWriter<File>) -> Result<PathBuf, McapError> {
        self.sync(file)?;
        Ok(self.path.clone())
    }

    /// Syncs the file to disk and marks it as kept. Returns it, because it holds the lock.
    fn sync(&mut self, file: BufWriter<File>) -> Result<File, McapError> {
        let written = file.into_inner().map_err(io::IntoInnerError::into_error);
        let synced = written.and_then(|file| file.sync_all().map(|()| file));
        let file = synced.map_err(|reason| self.failed(reason.into()))?;
        self.keep = true;
        Ok(file)
    }

    /// Syncs the file and renames it to its final path.
    pub(super) fn publish(mut self, file: BufWriter<File>) -> Result<(), McapError> {
        // The file stays open, and thereby locked, until it is renamed.
        let _file = self.sync(file)?;
        let moved = check_replaceable(&self.place).map_err(io::Error::other);
        moved
            .and_then(|()| fs::rename(&self.path, &self.place))
            .map_err(|reason| McapError::NotMoved { kept: self.path.clone(), reason })
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.keep {
            // An error cannot be reported here; the next run overwrites the file.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Checks that a path does not exist, or is an empty file or an MCAP file. Symbolic links are rejected.
fn check_replaceable(path: &Path) -> Result<(), McapError> {
    let occupied = |what| Err(McapError::Occupied { path: path.to_owned(), what });
    let refused = |reason| McapError::Write { path: path.to_owned(), reason };
    match fs::symlink_metadata(path) {
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(reason) => return Err(refused(reason)),
        Ok(found) if found.is_dir() => return occupied("a folder"),
        Ok(found) if !found.is_file() => return occupied("not a regular file"),
        Ok(_) => {}
    }
    let mut head = Vec::new();
    let opened = File::open(path).and_then(|file| file.take(mcap::MAGIC.len() as u64).read_to_end(&mut head));
    opened.map_err(refused)?;
    if head.is_empty() || head == mcap::MAGIC { Ok(()) } else { occupied("not an MCAP file") }
}
