//! `standoff run --mcap` as people meet it: what it leaves, how it fails. What is in the file: `standoff_view::mcap`.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::Path;
use std::process::{Command, Output};

const STANDOFF: &str = env!("CARGO_BIN_EXE_standoff");

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(STANDOFF).current_dir(folder).args(["run", "paper/figure-9"]).args(args).output().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs in a folder that `make` has filled, and expects exit status 2, a message, and nothing changed.
fn check_refused(make: impl FnOnce(&Path), file: &str, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path());
    let before = names(folder.path());
    let output = run(folder.path(), &["--mcap", file, "--out", "o"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(expected), "{message}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder.path()), before);
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_build_without_the_feature_says_how_to_get_it() {
    check_refused(|_| (), "a.mcap", "build one that can: cargo build --release --features mcap");
}

#[cfg(feature = "mcap")]
mod with_the_feature {
    use super::*;
    use std::fs;

    #[test]
    fn a_run_is_repeated_to_the_byte_and_its_record_is_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let first = run(folder.path(), &["--mcap", "a.mcap", "--out", "a"]);
        assert!(first.status.success() && first.stderr.is_empty(), "{first:?}");
        let bytes = fs::read(path("a.mcap")).unwrap();
        assert!(bytes.starts_with(b"\x89MCAP0\r\n") && bytes.ends_with(b"\x89MCAP0\r\n"));
        let second = run(folder.path(), &["--mcap", "a.mcap", "--out", "b"]);
        assert_eq!(String::from_utf8(second.stderr).unwrap(), "note: replacing the older file a.mcap\n");
        assert!(fs::read(path("a.mcap")).unwrap() == bytes);
        assert!(run(folder.path(), &["--out", "c"]).status.success());
        assert_eq!(names(folder.path()), ["a", "a.mcap", "b", "c"]);
        assert_eq!(names(&path("a")), names(&path("c")));
        for name in names(&path("a")) {
            assert!(fs::read(path("a").join(&name)).unwrap() == fs::read(path("c").join(&name)).unwrap(), "{name}");
        }
    }

    #[test]
    fn a_file_that_may_not_be_replaced_is_refused_before_anything_is_flown() {
        let thesis = |folder: &Path| fs::write(folder.join("a.mcap"), "my thesis").unwrap();
        check_refused(thesis, "a.mcap", "a.mcap is no MCAP file and is left as it is; name another file");
        check_refused(|folder| fs::create_dir(folder.join("a")).unwrap(), "a", "a is a folder and is left as it is");
        check_refused(|_| (), "none/a.mcap", "cannot write none/a.mcap.partial: No such file or directory");
        check_refused(|_| (), "o/a.mcap", "o/a.mcap: lies in the folder of the run");
    }

    /// The size of files is limited here, to more than any file of the record has and less than the MCAP file needs.
    #[cfg(unix)]
    #[test]
    fn a_disk_that_fills_up_costs_the_mcap_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let limited = "trap '' XFSZ; ulimit -f 5000; exec \"$0\" run paper/figure-9 --mcap a.mcap --out o";
        let mut shell = Command::new("sh");
        let output = shell.current_dir(folder.path()).args(["-c", limited, STANDOFF]).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.starts_with("error: cannot write a.mcap.partial: File too large"), "{message}");
        assert!(String::from_utf8(output.stdout).unwrap().ends_with("results in o\n"));
        assert_eq!(names(folder.path()), ["o"]);
        let shown = Command::new(STANDOFF).current_dir(folder.path()).args(["show", "o"]).output().unwrap();
        assert!(shown.status.success(), "the record is whole");
    }
}
