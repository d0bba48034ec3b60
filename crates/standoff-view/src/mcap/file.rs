//! The file while it grows: beside its place, moved there when whole; what is never overwritten.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read as _};
use std::path::{Path, PathBuf};

use standoff_sim::disk;

use super::error::McapError;

/// `FILE.partial`, removed when dropped.
pub(super) struct Partial {
    path: PathBuf,
    /// Where it is to lie.
    place: PathBuf,
    keep: bool,
}

impl Partial {
    /// Begins the file that is to lie at `place`. What an interrupted run left is overwritten.
    pub(super) fn create(place: &Path) -> Result<(Self, BufWriter<File>), McapError> {
        if place.file_name().is_none() {
            return Err(McapError::NoName { path: place.to_owned() });
        }
        check_replaceable(place)?;
        let path = disk::beside(place, disk::PARTIAL);
        check_replaceable(&path)?;
        let refused = |reason| McapError::Write { path: path.clone(), reason };
        // Emptied only once it is known to be ours.
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(&path).map_err(refused)?;
        // Where files cannot be locked, runs are trusted to have files of their own.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(McapError::InUse { path });
        }
        file.set_len(0).map_err(refused)?;
        let place = place.to_owned();
        Ok((Self { path, place, keep: false }, BufWriter::new(file)))
    }

    /// The error of a failed write.
    pub(super) fn failed(&self, reason: mcap::McapError) -> McapError {
        let reason = match reason {
            mcap::McapError::Io(reason) => reason,
            other => io::Error::other(other),
        };
        McapError::Write { path: self.path.clone(), reason }
    }

    /// Leaves the file where it is.
    pub(super) fn leave(mut self, file: BufWriter<File>) -> Result<PathBuf, McapError> {
        self.sync(file)?;
        Ok(self.path.clone())
    }

    /// Sees the whole file onto the disk, and keeps it; gives it, because it holds the lock.
    fn sync(&mut self, file: BufWriter<File>) -> Result<File, McapError> {
        let written = file.into_inner().map_err(io::IntoInnerError::into_error);
        let synced = written.and_then(|file| file.sync_all().map(|()| file));
        let file = synced.map_err(|reason| self.failed(reason.into()))?;
        self.keep = true;
        Ok(file)
    }

    /// Moves the whole file to its place.
    pub(super) fn publish(mut self, file: BufWriter<File>) -> Result<(), McapError> {
        // Open until it is moved.
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
            // Nobody is left to tell, and the next run overwrites it.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Nothing, an empty file or an MCAP file may lie there; links are never ours.
fn check_replaceable(path: &Path) -> Result<(), McapError> {
    let occupied = |what| Err(McapError::Occupied { path: path.to_owned(), what });
    let refused = |reason| McapError::Write { path: path.to_owned(), reason };
    match fs::symlink_metadata(path) {
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(reason) => return Err(refused(reason)),
        Ok(found) if found.is_dir() => return occupied("a folder"),
        Ok(found) if !found.is_file() => return occupied("no regular file"),
        Ok(_) => {}
    }
    let mut head = Vec::new();
    let opened = File::open(path).and_then(|file| file.take(mcap::MAGIC.len() as u64).read_to_end(&mut head));
    opened.map_err(refused)?;
    if head.is_empty() || head == mcap::MAGIC { Ok(()) } else { occupied("no MCAP file") }
}
