//! File that exists while the aircraft is commanded. It remains if the program is killed, so that a supervisor does not
//! restart the program then.

use std::fs::{File, remove_file};
use std::io;
use std::path::{Path, PathBuf};

use standoff_io::display_text;

/// The file.
#[derive(Debug)]
pub(crate) struct CommandedFile {
    path: PathBuf,
    exists: bool,
}

impl CommandedFile {
    /// Removes the file of an earlier start. Fails if the file cannot be created.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        File::create(path)?;
        remove_file(path)?;
        Ok(Self { path: path.to_owned(), exists: false })
    }

    /// Creates or removes the file. Reports a failure once: a command is not delayed for it.
    pub(crate) fn update(&mut self, is_commanding: bool, report: &mut dyn FnMut(&str)) {
        if std::mem::replace(&mut self.exists, is_commanding) == is_commanding {
            return;
        }
        let changed: io::Result<()> =
            if is_commanding { File::create(&self.path).map(|_| ()) } else { remove_file(&self.path) };
        if let Err(error) = changed {
            let shown = display_text::path(&self.path);
            report(&format!("warning: {shown}: {error}: a supervisor cannot see whether the aircraft is commanded"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_exists_while_the_aircraft_is_commanded_and_remains_after_a_kill() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("commanded");
        let mut warnings = Vec::new();
        let mut file = CommandedFile::new(&path).unwrap();
        for is_commanding in [false, true, true, false, true] {
            file.update(is_commanding, &mut |line| warnings.push(line.to_owned()));
            assert_eq!(path.exists(), is_commanding);
        }
        drop(file);
        assert!(path.exists() && warnings.is_empty(), "{warnings:?}");
        CommandedFile::new(&path).unwrap();
        assert!(!path.exists(), "a new start commands nothing");
        assert!(CommandedFile::new(&folder.path().join("missing/commanded")).is_err());
    }
}
