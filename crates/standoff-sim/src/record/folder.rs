//! The folder of a record: what may be replaced or removed, and what is never touched.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::rows::TABLES;
use super::{Manifest, RecordError};

/// The manifest's file name.
pub(super) const MANIFEST: &str = "run.json";
/// The resolved scenario's file name.
pub(super) const SCENARIO: &str = "scenario.toml";

/// What lies where a record should go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occupancy {
    /// Nothing, or an empty folder.
    Free,
    /// An older run of standoff and nothing else: [`super::Writer`] replaces it.
    OlderRun,
    /// Anything else, or something that cannot be looked into: it is not replaced.
    Other,
}

/// Tells what lies at `dir`. A symbolic link counts as [`Occupancy::Other`].
#[must_use]
pub fn occupancy(dir: &Path) -> Occupancy {
    match contents(dir) {
        Ok(Contents::Nothing) => Occupancy::Free,
        Ok(Contents::OnlyOurs) if Manifest::is_in(dir) => Occupancy::OlderRun,
        _ => Occupancy::Other,
    }
}

/// Makes the folder in which the record of `dir` grows, with the parents it needs; gives it, and the parents it had to
/// make, innermost first.
pub(super) fn make_partial(dir: &Path) -> Result<(PathBuf, Vec<PathBuf>), RecordError> {
    let Some(name) = dir.file_name() else {
        let dir = dir.to_owned();
        return Err(RecordError::NoName { dir });
    };
    if occupancy(dir) == Occupancy::Other {
        let dir = dir.to_owned();
        return Err(RecordError::Occupied { dir });
    }
    let mut partial_name = name.to_owned();
    partial_name.push(".partial");
    let partial = dir.with_file_name(partial_name);
    remove_stale(&partial)?;
    let parents = partial.ancestors().skip(1).filter(|parent| !parent.as_os_str().is_empty());
    let made: Vec<PathBuf> = parents.take_while(|parent| !parent.exists()).map(Path::to_owned).collect();
    if let Some(parent) = partial.parent() {
        fs::create_dir_all(parent).map_err(|reason| RecordError::write(parent, reason))?;
    }
    match fs::create_dir(&partial) {
        Ok(()) => Ok((partial, made)),
        Err(reason) if reason.kind() == io::ErrorKind::AlreadyExists => Err(RecordError::InUse { dir: partial }),
        Err(reason) => Err(RecordError::write(&partial, reason)),
    }
}

/// Moves a finished record to its place; an older run there is removed just before.
pub(super) fn move_into_place(partial: &Path, dir: &Path) -> Result<(), RecordError> {
    match occupancy(dir) {
        Occupancy::Other => {
            let dir = dir.to_owned();
            return Err(RecordError::Occupied { dir });
        }
        Occupancy::OlderRun => remove_ours(dir)?,
        Occupancy::Free if dir.is_dir() => remove_ours(dir)?,
        Occupancy::Free => {}
    }
    fs::rename(partial, dir).map_err(|reason| RecordError::write(dir, reason))
}

/// Removes a folder and the files in it that are ours; fails, and keeps the folder, if others remain.
pub(super) fn remove_ours(dir: &Path) -> Result<(), RecordError> {
    let refused = |reason| RecordError::write(dir, reason);
    // The manifest goes last: what is left by an interruption can still be told for ours.
    let mut manifest = None;
    for entry in fs::read_dir(dir).map_err(refused)? {
        let entry = entry.map_err(refused)?;
        if entry.file_name() == MANIFEST {
            manifest = Some(entry.path());
        } else if is_ours(&entry).map_err(refused)? {
            let path = entry.path();
            fs::remove_file(&path).map_err(|reason| RecordError::write(&path, reason))?;
        }
    }
    if let Some(path) = manifest {
        fs::remove_file(&path).map_err(|reason| RecordError::write(&path, reason))?;
    }
    fs::remove_dir(dir).map_err(refused)
}

/// Takes the lock that tells other runs that the record is being written.
///
/// It ends with the process at the latest. Where files cannot be locked, runs are trusted to have
/// folders of their own.
pub(super) fn lock(manifest: &File, partial: &Path) -> Result<(), RecordError> {
    match manifest.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let dir = partial.to_owned();
            Err(RecordError::InUse { dir })
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// Removes what an interrupted run left, if nothing else is in it and nobody is writing it.
fn remove_stale(partial: &Path) -> Result<(), RecordError> {
    match contents(partial) {
        Ok(Contents::Nothing) if !partial.is_dir() => Ok(()),
        Ok(Contents::Nothing | Contents::OnlyOurs) => {
            if let Ok(manifest) = File::open(partial.join(MANIFEST)) {
                lock(&manifest, partial)?;
            }
            remove_ours(partial)
        }
        _ => {
            let dir = partial.to_owned();
            Err(RecordError::Occupied { dir })
        }
    }
}

enum Contents {
    Nothing,
    OnlyOurs,
    NotOurs,
}

fn contents(dir: &Path) -> io::Result<Contents> {
    match fs::symlink_metadata(dir) {
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => return Ok(Contents::Nothing),
        Err(reason) => return Err(reason),
        Ok(found) if !found.is_dir() => return Ok(Contents::NotOurs),
        Ok(_) => {}
    }
    let mut found = Contents::Nothing;
    for entry in fs::read_dir(dir)? {
        if !is_ours(&entry?)? {
            return Ok(Contents::NotOurs);
        }
        found = Contents::OnlyOurs;
    }
    Ok(found)
}

/// A regular file under a name that standoff gives: links and folders are never ours.
fn is_ours(entry: &fs::DirEntry) -> io::Result<bool> {
    let name = entry.file_name();
    let Some(name) = name.to_str() else {
        return Ok(false);
    };
    let known = [MANIFEST, SCENARIO, "summary.json", "report.html"].contains(&name)
        || name.ends_with(".svg")
        || name.strip_suffix(".parquet").is_some_and(|table| TABLES.contains(&table));
    Ok(known && entry.file_type()?.is_file())
}
