//! End-to-end tests of `standoff run --mcap`: its files and its errors. `standoff_view::mcap` tests the file's content.

use std::path::Path;
use std::process::Output;

use crate::common::{names, standoff, text};

fn run(folder: &Path, args: &[&str]) -> Output {
    standoff(folder, &[&["run", "paper/figure-9"], args].concat())
}

/// Runs the command in a folder prepared by `make`, and checks for exit status 2, a message and no new files.
fn check_refused(make: impl FnOnce(&Path), file: &str, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path());
    let before = names(folder.path());
    let output = run(folder.path(), &["--mcap", file, "--out", "o"]);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(expected), "{message}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder.path()), before);
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_build_without_the_feature_explains_how_to_rebuild() {
    check_refused(|_| (), "a.mcap", "rebuild with: cargo build --release --features mcap");
}

#[cfg(feature = "mcap")]
mod with_the_feature {
    use super::*;
    use crate::common::is_same;
    use std::fs;
    use std::process::Command;

    #[test]
    fn a_repeated_run_writes_the_same_bytes_and_the_record_does_not_depend_on_the_option() {
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
        assert!(is_same(&path("a"), &path("c")));
    }

    #[test]
    fn a_file_that_must_not_be_replaced_is_refused_before_the_flight() {
        let thesis = |folder: &Path| fs::write(folder.join("a.mcap"), "my thesis").unwrap();
        check_refused(
            thesis,
            "a.mcap",
            "a.mcap is not an MCAP file and will not be overwritten; choose another file name",
        );
        check_refused(
            |folder| fs::create_dir(folder.join("a")).unwrap(),
            "a",
            "a is a folder and will not be overwritten",
        );
        check_refused(|_| (), "none/a.mcap", "cannot write none/a.mcap.partial: No such file or directory");
        check_refused(|_| (), "o/a.mcap", "o/a.mcap: lies in the folder of the run");
    }

    /// A file-size limit simulates a full disk: all files of the record fit, the MCAP file does not.
    #[cfg(unix)]
    #[test]
    fn a_disk_that_fills_up_affects_the_mcap_file_only() {
        let folder = tempfile::tempdir().unwrap();
        let limited = "trap '' XFSZ; ulimit -f 5000; exec \"$0\" run paper/figure-9 --mcap a.mcap --out o";
        let mut shell = Command::new("sh");
        let program = env!("CARGO_BIN_EXE_standoff");
        let output = shell.current_dir(folder.path()).args(["-c", limited, program]).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.starts_with("error: cannot write a.mcap.partial: File too large"), "{message}");
        assert!(String::from_utf8(output.stdout).unwrap().contains("\nresults in o\n"));
        assert_eq!(names(folder.path()), ["o"]);
        let shown = standoff(folder.path(), &["report", "o"]);
        assert!(shown.status.success(), "the record is incomplete");
    }
}
