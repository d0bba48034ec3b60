//! Folder of a record: rules for what may be replaced or removed, and what is never touched.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use standoff_io::atomic_file::{self, PARTIAL, sibling};

use crate::checkpoint::{self, CHECKPOINT, Checkpoint};
use crate::error::RecordError;
use crate::manifest::{MANIFEST, Manifest};
use crate::schema::is_table;

/// File name of the resolved scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";

/// File name of the optional background map of a record.
pub const MAP_FILE: &str = "map.json.gz";

/// Contents of the destination of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occupancy {
    /// Nothing, or an empty folder.
    Free,
    /// An older standoff run and nothing else: [`crate::Writer`] replaces it.
    OlderRun,
    /// Anything else, or something unreadable: it is not replaced.
    Other,
}

/// Classifies the contents of `dir`. A symbolic link counts as [`Occupancy::Other`].
#[must_use]
pub fn occupancy(dir: &Path) -> Occupancy {
    match contents(dir) {
        Ok(Contents::Nothing) => Occupancy::Free,
        Ok(Contents::OnlyOurs) if Manifest::is_in(dir) => Occupancy::OlderRun,
        _ => Occupancy::Other,
    }
}

/// Returns the reason why the contents of `dir` are not replaced. Of several foreign entries, it names the first one
/// alphabetically.
#[must_use]
pub fn conflicting_files(dir: &Path) -> RecordError {
    let what = match contents(dir) {
        Err(reason) => return RecordError::read(dir, reason),
        Ok(_) if !dir.is_dir() || dir.is_symlink() => NO_FOLDER.to_owned(),
        Ok(_) => {
            let other = first_in(dir, |entry| !is_ours(entry).unwrap_or(false));
            match (other, Manifest::read(dir)) {
                (Some(other), _) => other,
                (None, Err(error @ RecordError::Read { .. })) => return error,
                (None, _) => format!("{MANIFEST} is missing or not that of a record"),
            }
        }
    };
    RecordError::Occupied { dir: dir.to_owned(), what }
}

/// Error text for something at the destination that is not a folder.
pub const NO_FOLDER: &str = "it is not a folder";

/// Returns the alphabetically first name in a folder that satisfies `counts`. `None` without such a name or if the
/// folder is unreadable.
pub fn first_in(dir: &Path, counts: impl Fn(&fs::DirEntry) -> bool) -> Option<String> {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    let first = entries.filter(counts).map(|entry| entry.file_name()).min();
    first.map(|name| name.to_string_lossy().into_owned())
}

/// Suffix of a record that is being replaced, until the new one is complete. It must not be a name that users give to
/// copies, because such a folder is removed.
const OLDER: &str = ".standoff-older";

/// Maximum length of a record's folder name, bytes, such that it fits the limit of file systems with the longest
/// suffix.
const MAX_NAME: usize = 255 - OLDER.len();

/// Temporary folder of a growing record, removed when dropped unless `keep` is set.
pub(crate) struct Partial {
    pub(crate) path: PathBuf,
    /// Parent folders that were created for it, innermost first.
    made: Vec<PathBuf>,
    /// Held until the folder has a locked manifest: without one, it looks like a leftover of an ended run.
    pub(crate) turn: Option<FolderLock>,
    pub(crate) keep: bool,
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        let turn = self.turn.take().map_or_else(|| FolderLock::for_sibling(&self.path), Ok);
        if turn.is_ok() {
            // Errors are ignored: they cannot be reported here, and the next run tries again.
            let _ = remove_ours(&self.path);
            for parent in &self.made {
                let _ = fs::remove_dir(parent);
            }
        }
    }
}

/// Lock that lets one run at a time inspect and move the folders next to a destination. The system releases it at the
/// latest when the process ends.
pub(crate) struct FolderLock {
    /// Locked parent folder. If locking is not supported, runs are assumed not to interfere.
    _parent: Option<File>,
}

/// Maximum wait for the lock: other runs hold it while they move or remove the files of a run.
const TURN_MAX: Duration = Duration::from_secs(20);

impl FolderLock {
    /// Waits for the lock of the folder that contains `dir`.
    pub(crate) fn for_sibling(dir: &Path) -> Result<Self, RecordError> {
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

/// Creates the temporary folder for the record of `dir`, and its parents.
///
/// Leftovers of an ended run are not lost: a complete record is moved to its destination, and an unfinished one is
/// moved aside until the new one is complete. Of two unfinished records, the longer one is kept. Also returns the new
/// path of the unfinished run.
pub(crate) fn make_partial(dir: &Path) -> Result<(Partial, Option<PathBuf>), RecordError> {
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
    let (partial, older) = (sibling(dir, PARTIAL), sibling(dir, OLDER));
    let parents = partial.ancestors().skip(1).filter(|parent| !parent.as_os_str().is_empty());
    let made: Vec<PathBuf> = parents.take_while(|parent| !parent.exists()).map(Path::to_owned).collect();
    if let Some(parent) = partial.parent() {
        fs::create_dir_all(parent).map_err(|reason| RecordError::write(parent, reason))?;
    }
    let turn = FolderLock::for_sibling(dir)?;
    check_place(dir, &older)?;
    let set_aside = clear_leftovers(dir, &partial, &older)?;
    match fs::create_dir(&partial) {
        Ok(()) => Ok((Partial { path: partial, made, turn: Some(turn), keep: false }, set_aside)),
        Err(reason) if reason.kind() == io::ErrorKind::AlreadyExists => Err(RecordError::InUse { dir: partial }),
        Err(reason) => Err(RecordError::write(&partial, reason)),
    }
}

/// Refuses a destination with foreign contents, at the path itself or at that of the older run.
fn check_place(dir: &Path, older: &Path) -> Result<(), RecordError> {
    match [dir, older].into_iter().find(|path| occupancy(path) == Occupancy::Other) {
        Some(path) => Err(conflicting_files(path)),
        None => Ok(()),
    }
}

/// Moves a finished record to its destination; the caller holds the [`FolderLock`]. An older run there is first moved
/// aside and removed last: at any time, one of the two is complete.
pub(crate) fn move_into_place(partial: &Path, dir: &Path) -> Result<(), RecordError> {
    let older = sibling(dir, OLDER);
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
            // If moving it back fails, the next run tries again.
            let _ = fs::rename(&older, dir);
        }
        return Err(error);
    }
    if let Some(parent) = dir.parent() {
        atomic_file::sync_folder(parent).map_err(|reason| RecordError::write(parent, reason))?;
    }
    // If this fails, the next run removes it.
    let _ = remove_ours(&older);
    Ok(())
}

/// Moves or removes the leftovers of ended runs unless another run is writing; the caller holds the [`FolderLock`].
/// Returns the path of an unfinished run that was moved aside.
fn clear_leftovers(dir: &Path, partial: &Path, older: &Path) -> Result<Option<PathBuf>, RecordError> {
    let left = contents(partial).map_err(|reason| RecordError::read(partial, reason))?;
    if matches!(left, Contents::NotOurs) {
        return Err(conflicting_files(partial));
    }
    // Kept open, with its lock, until the folder is moved.
    let manifest = File::open(partial.join(MANIFEST));
    if let Ok(manifest) = &manifest {
        lock(manifest, partial)?;
    }
    // All of them have to be removable, now or at the end: this is checked before the run starts.
    [dir, partial, older].into_iter().try_for_each(check_removable)?;
    // An earlier run did not complete its last steps of replacing another one.
    if is_finished(older) && occupancy(dir) == Occupancy::Free {
        rename(older, dir)?;
    } else if is_finished(older) || !checkpoint::is_in(older) {
        remove_ours(older)?;
    }
    if is_finished(partial) {
        move_into_place(partial, dir)?;
    } else if last_checkpoint_us(partial) > last_checkpoint_us(older) {
        remove_ours(older)?;
        rename(partial, older)?;
    } else {
        remove_ours(partial)?;
    }
    Ok(older.exists().then(|| older.to_owned()))
}

/// Time of the last checkpoint of an unfinished record, microseconds; `None` without a checkpoint.
fn last_checkpoint_us(dir: &Path) -> Option<i64> {
    Checkpoint::read(dir).ok().map(|checkpoint| checkpoint.last_us)
}

/// True if `dir` contains a complete record.
fn is_finished(dir: &Path) -> bool {
    Manifest::read(dir).is_ok_and(|manifest| !manifest.unfinished)
}

fn rename(from: &Path, to: &Path) -> Result<(), RecordError> {
    fs::rename(from, to).map_err(|reason| RecordError::write(to, reason))
}

/// Removes a folder, if it exists, with the standoff files in it. Fails and keeps the folder if it contains other
/// files.
fn remove_ours(dir: &Path) -> Result<(), RecordError> {
    if !dir.exists() {
        return Ok(());
    }
    let refused = |reason| RecordError::write(dir, reason);
    // The manifest is removed last, so that a partly removed folder is still recognised as a record.
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

/// Refuses a run whose files the system does not let us remove, for example those of another user. Nothing is changed:
/// the call tries to remove a file as a folder, which always fails, but with a different error if permission is
/// missing.
fn check_removable(dir: &Path) -> Result<(), RecordError> {
    use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
    match fs::remove_dir(dir.join(MANIFEST)) {
        Err(reason) if [PermissionDenied, ReadOnlyFilesystem].contains(&reason.kind()) => {
            Err(RecordError::NotRemovable { dir: dir.to_owned(), reason })
        }
        _ => Ok(()),
    }
}

/// Takes the lock that marks the record as being written.
///
/// The system releases it at the latest when the process ends. If locking is not supported, runs are assumed to use
/// different folders.
pub(crate) fn lock(manifest: &File, partial: &Path) -> Result<(), RecordError> {
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

/// True for a regular file with a name that standoff uses; links and folders never count.
fn is_ours(entry: &fs::DirEntry) -> io::Result<bool> {
    let name = entry.file_name();
    let Some(name) = name.to_str() else {
        return Ok(false);
    };
    // A file keeps this suffix if the process was killed while writing it.
    let name = name.strip_suffix(PARTIAL).unwrap_or(name);
    let known = [MANIFEST, SCENARIO, CHECKPOINT, MAP_FILE, "summary.json", "alarms.csv", "gaps.csv", "report.html"]
        .contains(&name)
        || name.ends_with(".svg")
        || name.strip_suffix(".parquet").is_some_and(is_table);
    Ok(known && entry.file_type()?.is_file())
}
