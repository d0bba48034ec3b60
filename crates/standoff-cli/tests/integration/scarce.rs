//! Behaviour with scarce resources: threads, open files, disk space, and files of other users.

use std::ffi::OsStr;
use std::fs::{self, Permissions};
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::LazyLock;

use crate::common::{command, standoff};
use tempfile::TempDir;

const RUN: [&str; 5] = ["run", "tour/01-one-uav", "--set", "duration_s=5", "--out"];
/// User id without the privileges of root.
const UNPRIVILEGED: u32 = 65_534;

/// Runs the program in `folder` after the shell commands `before`. Limits do not apply to root: a test that runs as
/// root switches to another user.
fn limited(folder: &Path, before: &str, args: &[&str]) -> Output {
    let script = format!("{before}\nexec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.current_dir(folder).args(["-c", &script]);
    if is_root() {
        chown(folder, Some(UNPRIVILEGED), Some(UNPRIVILEGED)).unwrap();
        command.uid(UNPRIVILEGED).gid(UNPRIVILEGED).arg(OPEN.path().join("standoff"));
    } else {
        command.arg(env!("CARGO_BIN_EXE_standoff"));
    }
    command.args(args).output().unwrap()
}

/// A copy of the program that every user can execute; the build folder may be readable by root only.
static OPEN: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    fs::copy(env!("CARGO_BIN_EXE_standoff"), folder.path().join("standoff")).unwrap();
    fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
    folder
});

fn is_root() -> bool {
    fs::metadata("/proc/self").unwrap().uid() == 0
}

/// Checks the exit status, the expected messages on standard error, and that nothing panicked.
#[track_caller]
fn check(output: &Output, status: i32, expected: &[&str]) {
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{message}");
    assert!(expected.iter().all(|part| message.contains(part)) && !message.contains("panicked"), "{message}");
}

fn run_in(folder: &Path, out: &str) {
    check(&standoff(folder, &[&RUN[..], &[out]].concat()), 0, &[]);
}

#[test]
fn without_threads_a_run_succeeds_and_serving_a_page_fails() {
    let folder = TempDir::new().unwrap();
    // The first form is for dash, the second for other shells.
    let no_threads = "ulimit -p 0 2>/dev/null || ulimit -u 0";
    let flown = limited(folder.path(), no_threads, &[&RUN[..], &["o"]].concat());
    check(&flown, 0, &[]);
    assert!(folder.path().join("o/report.html").is_file());
    for args in [&["view", "o", "--no-open"][..], &["view", "tour/01-one-uav", "--no-open"]] {
        check(&limited(folder.path(), no_threads, args), 1, &["cannot start a thread", "ulimit -u"]);
    }
    let batch = ["monte-carlo", "tour/01-one-uav", "--runs", "2", "--threads", "1", "--out", "m"];
    check(&limited(folder.path(), no_threads, &batch), 1, &["cannot start 1 threads", "ulimit -u"]);
}

#[test]
fn too_many_open_files_are_not_reported_as_wrong_input() {
    let folder = TempDir::new().unwrap();
    run_in(folder.path(), "o");
    for args in [&["report", "o"][..], &["view", "o", "--no-open"], &[&RUN[..], &["p"]].concat()] {
        check(&limited(folder.path(), "ulimit -n 6", args), 1, &["os error 24", "raise the limit (ulimit -n)"]);
    }
}

/// The tables fit, the page does not. The message names the final path, not that of the partial folder.
#[test]
fn a_page_without_room_is_reported_with_its_final_path() {
    let folder = TempDir::new().unwrap();
    let flown = limited(folder.path(), "trap '' XFSZ; ulimit -f 1000", &[&RUN[..], &["o"]].concat());
    let advice = "the record is complete: standoff report o creates the missing files";
    check(&flown, 1, &["error: cannot write o/report.html: File too large", advice]);
    assert!(!String::from_utf8_lossy(&flown.stderr).contains(".partial"));
    check(&standoff(folder.path(), &["report", "o"]), 0, &[]);
}

#[test]
fn an_older_run_that_cannot_be_removed_is_reported_before_the_flight() {
    let folder = TempDir::new().unwrap();
    run_in(folder.path(), "o");
    // Its files cannot be removed: if the test runs as root, they belong to root; otherwise, the folder is read-only.
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o555)).unwrap();
    let flown = limited(folder.path(), ":", &[&RUN[..], &["o"]].concat());
    let expected = ["the run in o could not be removed: ", "os error 13", "choose another folder"];
    check(&flown, 2, &expected);
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["o"]);
    // A folder of another user may not even be readable.
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o000)).unwrap();
    let flown = limited(folder.path(), ":", &[&RUN[..], &["o"]].concat());
    check(&flown, 2, &["cannot read o: Permission denied", "check its permissions"]);
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o755)).unwrap();
}

/// Records are archived read-only.
#[test]
fn a_read_only_record_is_reported() {
    let folder = TempDir::new().unwrap();
    run_in(folder.path(), "o");
    let page = fs::read(folder.path().join("o/report.html")).unwrap();
    // If the test runs as root, the record belongs to root.
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o555)).unwrap();
    for args in [&["report", "o"][..], &["report", "o", "--json"]] {
        let reported = limited(folder.path(), ":", args);
        check(&reported, 0, &["note: the summary, the figures and the page in o are not written: Permission denied"]);
        assert!(!reported.stdout.is_empty());
    }
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o755)).unwrap();
    assert_eq!(fs::read(folder.path().join("o/report.html")).unwrap(), page);
    fs::remove_file(folder.path().join("o/report.html")).unwrap();
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o555)).unwrap();
    let reported = limited(folder.path(), ":", &["report", "o"]);
    check(&reported, 0, &["the page in o are not written: Permission denied"]);
    let printed = String::from_utf8_lossy(&reported.stdout);
    assert!(printed.contains("  standoff view o") && !printed.contains("open o/report.html"), "{printed}");
    fs::set_permissions(folder.path().join("o"), Permissions::from_mode(0o755)).unwrap();
}

/// A shell reads the printed commands with the name that the folder has.
#[test]
fn printed_commands_can_be_pasted_into_a_shell() {
    let folder = TempDir::new().unwrap();
    for out in ["night shift", "~/runs/a", "it's $HOME", "a;b&c\nd"] {
        let flown = standoff(folder.path(), &[&RUN[..], &[out]].concat());
        check(&flown, 0, &[]);
        let printed = String::from_utf8(flown.stdout).unwrap();
        let command = printed.lines().find_map(|line| line.strip_prefix("  open ")).unwrap();
        let page = command.rsplit_once("  (").unwrap().0.trim_end();
        let shell =
            Command::new("bash").current_dir(folder.path()).args(["-c", &format!("cat {page}")]).output().unwrap();
        assert_eq!(shell.stdout, fs::read(folder.path().join(out).join("report.html")).unwrap(), "{page}");
    }
}

#[test]
fn names_with_special_bytes_are_printed_on_one_line() {
    let folder = TempDir::new().unwrap();
    for _ in 0..2 {
        run_in(folder.path(), "a\nb");
    }
    let again = standoff(folder.path(), &[&RUN[..], &["a\nb"]].concat());
    check(&again, 0, &["note: replacing the older run in a\\nb\n"]);
    fs::create_dir(folder.path().join("a\nb/mine")).unwrap();
    let refused = standoff(folder.path(), &[&RUN[..], &["a\nb"]].concat());
    check(&refused, 2, &["error: a\\nb contains something other than a run of standoff (mine)"]);
    let batch = ["monte-carlo", "tour/01-one-uav", "--set", "duration_s=5", "--runs", "2", "--out", "c\nd"];
    let flown = standoff(folder.path(), &batch);
    check(&flown, 0, &[]);
    assert!(String::from_utf8(flown.stdout).unwrap().contains("\nresults in $'c\\nd'\n"));

    let bytes = OsStr::from_bytes(b"bad\xff");
    let refused = command(folder.path(), &["view"]).arg(bytes).output().unwrap();
    check(&refused, 2, &["error: \"bad\u{fffd}\": not UTF-8 text", "change to the folder and pass ."]);
}
