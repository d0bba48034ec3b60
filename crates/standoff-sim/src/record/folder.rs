//! The folder of a record: what may be replaced or removed, and what is never touched.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use super::checkpoint::{self, CHECKPOINT, Checkpoint};
use super::error::RecordError;
use super::manifest::{MANIFEST, Manifest};
use super::rows::is_table;
use crate::disk::{self, PARTIAL, beside};

/// The resolved scenario's file name.
pub(super) const SCENARIO: &str = "scenario.toml";

/// What a map of what lies under the vehicles is called in the folder of a record, if somebody put one there.
pub const MAP_FILE: &str = "map.json.gz";

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

/// Why what lies at `dir` is not replaced: of several things in the way the first by name.
#[must_use]
pub fn in_the_way(dir: &Path) -> RecordError {
    let what = match contents(dir) {
        Err(reason) => return RecordError::read(dir, reason),
        Ok(_) if !dir.is_dir() || dir.is_symlink() => NO_FOLDER.to_owned(),
        Ok(_) => {
            let other = first_in(dir, |entry| !is_ours(entry).unwrap_or(false));
            match (other, Manifest::read(dir)) {
                (Some(other), _) => other,
                (None, Err(error @ RecordError::Read { .. })) => return error,
                (None, _) => format!("{MANIFEST} is none or no record's"),
            }
        }
    };
    RecordError::Occupied { dir: dir.to_owned(), what }
}

/// What is said of something in the way that is no folder.
pub(crate) const NO_FOLDER: &str = "it is no folder";

/// The first name in a folder of what `counts`; `None` if nothing does, or it cannot be looked into.
pub(crate) fn first_in(dir: &Path, counts: impl Fn(&fs::DirEntry) -> bool) -> Option<String> {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    let first = entries.filter(counts).map(|entry| entry.file_name()).min();
    first.map(|name| name.to_string_lossy().into_owned())
}

/// What a record is called that another one will replace, until that one is whole: as nobody calls a copy of their own,
/// because it is removed then.
const OLDER: &str = ".standoff-older";

/// Longest name of a record's folder, bytes: with the longest that is added to it, as long as file systems allow.
const MAX_NAME: usize = 255 - OLDER.len();

/// The folder of a record that grows, removed when dropped unless there is something to keep in it.
pub(super) struct Partial {
    pub(super) path: PathBuf,
    /// The parents that had to be made for it, innermost first.
    made: Vec<PathBuf>,
    /// Held until it has a manifest with a lock on it: without one, it looks as if an ended run had left it.
    pub(super) turn: Option<Turn>,
    pub(super) keep: bool,
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        let turn = self.turn.take().map_or_else(|| Turn::beside(&self.path), Ok);
        if turn.is_ok() {
            // Nobody is left to tell, and the next run tries again.
            let _ = remove_ours(&self.path);
            for parent in &self.made {
                let _ = fs::remove_dir(parent);
            }
        }
    }
}

/// What lets one run at a time, of all that lie beside one another, look at what is there and move it. It ends with the
/// process at the latest.
pub(super) struct Turn {
    /// The folder in which they lie, locked. Where it cannot be, runs are trusted to keep out of each other's way.
    _parent: Option<File>,
}

/// Longest wait for the turn: others hold it for as long as it takes to move or remove the files of a run.
const TURN_MAX: Duration = Duration::from_secs(20);

impl Turn {
    /// Waits for the turn beside `dir`.
    pub(super) fn beside(dir: &Path) -> Result<Self, RecordError> {
        let parent = dir.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Ok(parent) = File::open(parent) else { return Ok(Self { _parent: None }) };
        let until = Instant::now() + TURN_MAX;
        loop {
            match parent.try_lock() {
                Ok(()) => return Ok(Self { _parent: Some(parent) }),
                Err(TryLockError::Error(_)) => return Ok(Self { _parent: None }),
                Err(TryLockError::WouldBlock) if Instant::now() > until => {
                    return Err(RecordError::InUse { dir: dir.to_owned() });
                }
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(5)),
            }
        }
    }
}

/// Makes the folder in which the record of `dir` grows, with the parents it needs.
///
/// What an ended run has left there is not lost: a complete record is moved to its place, an unfinished one is set aside
/// until the new one is whole; of two unfinished ones that which tells further. Gives, too, where an unfinished run now lies.
pub(super) fn make_partial(dir: &Path) -> Result<(Partial, Option<PathBuf>), RecordError> {
    let Some(name) = dir.file_name().map(|name| name.to_string_lossy()) else {
        return Err(RecordError::NoName { dir: dir.to_owned() });
    };
    if [PARTIAL, OLDER].iter().any(|ending| name.ends_with(ending)) {
        return Err(RecordError::Reserved { dir: dir.to_owned() });
    }
    let bytes = dir.file_name().map_or(0, OsStr::len);
    if bytes > MAX_NAME {
        return Err(RecordError::LongName { dir: dir.to_owned(), bytes, most: MAX_NAME });
    }
    let (partial, older) = (beside(dir, PARTIAL), beside(dir, OLDER));
    let parents = partial.ancestors().skip(1).filter(|parent| !parent.as_os_str().is_empty());
    let made: Vec<PathBuf> = parents.take_while(|parent| !parent.exists()).map(Path::to_owned).collect();
    if let Some(parent) = partial.parent() {
        fs::create_dir_all(parent).map_err(|reason| RecordError::write(parent, reason))?;
    }
    let turn = Turn::beside(dir)?;
    check_place(dir, &older)?;
    let set_aside = settle(dir, &partial, &older)?;
    match fs::create_dir(&partial) {
        Ok(()) => Ok((Partial { path: partial, made, turn: Some(turn), keep: false }, set_aside)),
        Err(reason) if reason.kind() == io::ErrorKind::AlreadyExists => Err(RecordError::InUse { dir: partial }),
        Err(reason) => Err(RecordError::write(&partial, reason)),
    }
}

/// Refuses a place where something lies that must not be replaced, or beside it.
fn check_place(dir: &Path, older: &Path) -> Result<(), RecordError> {
    match [dir, older].into_iter().find(|path| occupancy(path) == Occupancy::Other) {
        Some(path) => Err(in_the_way(path)),
        None => Ok(()),
    }
}

/// Moves a finished record to its place, in its [`Turn`]. An older run there is moved aside first and removed last: at
/// every instant the one or the other is whole.
pub(super) fn move_into_place(partial: &Path, dir: &Path) -> Result<(), RecordError> {
    let older = beside(dir, OLDER);
    check_place(dir, &older)?;
    let replaces = occupancy(dir) == Occupancy::OlderRun;
    if replaces {
        remove_ours(&older)?;
        rename(dir, &older)?;
    } else {
        remove_ours(dir)?;
    }
    if let Err(error) = rename(partial, dir) {
        if replaces {
            // If it cannot go back either, the next run will try.
            let _ = fs::rename(&older, dir);
        }
        return Err(error);
    }
    if let Some(parent) = dir.parent() {
        disk::sync_folder(parent).map_err(|reason| RecordError::write(parent, reason))?;
    }
    // In nobody's way: if it stays, the next run removes it.
    let _ = remove_ours(&older);
    Ok(())
}

/// Moves or removes what ended runs have left, if nobody is writing it, in its [`Turn`]. Gives where an unfinished run
/// was set aside.
fn settle(dir: &Path, partial: &Path, older: &Path) -> Result<Option<PathBuf>, RecordError> {
    let left = contents(partial).map_err(|reason| RecordError::read(partial, reason))?;
    if matches!(left, Contents::NotOurs) {
        return Err(in_the_way(partial));
    }
    // Held until what is there is moved.
    let manifest = File::open(partial.join(MANIFEST));
    if let Ok(manifest) = &manifest {
        lock(manifest, partial)?;
    }
    // All of them go, now or when the record is complete: it is not flown in vain.
    [dir, partial, older].into_iter().try_for_each(check_removable)?;
    // The last steps of a run that replaced another were not reached.
    if is_finished(older) && occupancy(dir) == Occupancy::Free {
        rename(older, dir)?;
    } else if is_finished(older) || !checkpoint::is_in(older) {
        remove_ours(older)?;
    }
    if is_finished(partial) {
        move_into_place(partial, dir)?;
    } else if tells_until(partial) > tells_until(older) {
        remove_ours(older)?;
        rename(partial, older)?;
    } else {
        remove_ours(partial)?;
    }
    Ok(older.exists().then(|| older.to_owned()))
}

/// Up to when an unfinished record tells, microseconds; `None` of nothing.
fn tells_until(dir: &Path) -> Option<i64> {
    Checkpoint::read(dir).ok().map(|checkpoint| checkpoint.last_us)
}

/// A whole record lies there.
fn is_finished(dir: &Path) -> bool {
    Manifest::read(dir).is_ok_and(|manifest| !manifest.unfinished)
}

fn rename(from: &Path, to: &Path) -> Result<(), RecordError> {
    fs::rename(from, to).map_err(|reason| RecordError::write(to, reason))
}

/// Removes a folder, if it is there, and the files in it that are ours; fails, and keeps the folder, if others remain.
fn remove_ours(dir: &Path) -> Result<(), RecordError> {
    if !dir.exists() {
        return Ok(());
    }
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

/// Refuses a run whose files the system does not let us remove, such as another user's. Nothing is changed: a file is asked
/// to be removed as if it were a folder, which the system refuses for that, or before, for what we are not allowed.
fn check_removable(dir: &Path) -> Result<(), RecordError> {
    use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
    match fs::remove_dir(dir.join(MANIFEST)) {
        Err(reason) if [PermissionDenied, ReadOnlyFilesystem].contains(&reason.kind()) => {
            Err(RecordError::NotRemovable { dir: dir.to_owned(), reason })
        }
        _ => Ok(()),
    }
}

/// Takes the lock that tells other runs that the record is being written.
///
/// It ends with the process at the latest. Where files cannot be locked, runs are trusted to have
/// folders of their own.
pub(super) fn lock(manifest: &File, partial: &Path) -> Result<(), RecordError> {
    match manifest.try_lock() {
        Err(TryLockError::WouldBlock) => Err(RecordError::InUse { dir: partial.to_owned() }),
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
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
    // Killed while it was written, a file keeps this.
    let name = name.strip_suffix(PARTIAL).unwrap_or(name);
    let known = [MANIFEST, SCENARIO, CHECKPOINT, MAP_FILE, "summary.json", "report.html"].contains(&name)
        || name.ends_with(".svg")
        || name.strip_suffix(".parquet").is_some_and(is_table);
    Ok(known && entry.file_type()?.is_file())
}
