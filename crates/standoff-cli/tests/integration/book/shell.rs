//! Runs commands as a reader would type them, and checks their output.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::{env, fs};

use snapbox::{Assert, IntoData};

/// A command and the output that the page quotes.
pub(crate) struct Typed {
    pub(crate) command: String,
    pub(crate) output: Vec<String>,
}

/// Returns the commands of a block: lines after `$ ` in `console`, otherwise all lines. A backslash at the end of a
/// line continues the command.
pub(crate) fn typed(language: &str, text: &str) -> Vec<Typed> {
    let mut commands: Vec<Typed> = Vec::new();
    let mut continues = false;
    for line in text.lines() {
        let is_command = language != "console" && !line.is_empty() && !line.starts_with('#');
        match (line.strip_prefix("$ ").or_else(|| is_command.then_some(line)), commands.last_mut()) {
            (_, Some(last)) if continues => last.command += &format!("\n{line}"),
            (Some(command), _) => commands.push(Typed { command: command.to_owned(), output: Vec::new() }),
            (None, Some(last)) if language == "console" => last.output.push(line.trim_end().to_owned()),
            _ => {}
        }
        continues = line.ends_with('\\');
    }
    commands
}

/// Returns the reason why a command is not run; `None` if it is run.
pub(crate) fn left_out(command: &str) -> Option<&'static str> {
    let program = command.split(' ').next().unwrap_or_default();
    match program {
        "cargo" => Some("a build command; CI builds and tests separately"),
        program if program.starts_with("scripts/") => Some("a script of the repository"),
        _ => None,
    }
}

/// Runs a command in `folder`; returns its exit status and its output (standard output and standard error). A command
/// that serves a page is interrupted by SIGINT.
pub(crate) fn run(folder: &Path, command: &str) -> (Option<i32>, String) {
    let mut words = command.split_whitespace();
    let serves =
        words.next() == Some("standoff") && (words.next() == Some("view") || words.any(|word| word == "--view"));
    if serves { serve(folder, command) } else { finish(start(folder, &format!("{{ {command}\n}} 2>&1"))) }
}

fn start(folder: &Path, command: &str) -> Child {
    let binary = Path::new(env!("CARGO_BIN_EXE_standoff")).parent().unwrap().to_owned();
    let inherited = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths([binary].into_iter().chain(env::split_paths(&inherited))).unwrap();
    let mut shell = Command::new("sh");
    shell.current_dir(folder).env("PATH", path).stdin(Stdio::null()).stdout(Stdio::piped());
    shell.args(["-c", command]).spawn().unwrap()
}

fn finish(mut child: Child) -> (Option<i32>, String) {
    let mut printed = String::new();
    child.stdout.take().unwrap().read_to_string(&mut printed).unwrap();
    (child.wait().unwrap().code(), printed)
}

fn serve(folder: &Path, command: &str) -> (Option<i32>, String) {
    let command = command.split(" #").next().unwrap_or_default();
    let mut child = start(folder, &format!("exec {command} --no-open 2>&1"));
    let mut output = BufReader::new(child.stdout.take().unwrap());
    let mut printed = String::new();
    while !printed.contains("http://") && output.read_line(&mut printed).unwrap() > 0 {}
    let interrupt = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    output.read_to_string(&mut printed).unwrap();
    // A run that is interrupted during the flight fails, as it should.
    let is_cut_short = printed.contains("error: interrupted; ");
    let status = child.wait().unwrap().code();
    (if status == Some(1) && is_cut_short { Some(0) } else { status }, printed)
}

/// Checks that exactly the quoted lines were printed, if any are quoted; `...` matches any text within a line, or any
/// number of lines.
pub(crate) fn check_quoted(quoted: &[String], printed: &str) -> Result<(), String> {
    let pattern = |line: &String| if line == "..." { line.clone() } else { line.replace("...", "[..]") };
    let quoted = quoted.iter().map(pattern).collect::<Vec<_>>().join("\n");
    if quoted.trim_end().is_empty() {
        return Ok(());
    }
    let printed = printed.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    let compared = Assert::new().try_eq(None, printed.trim_end().into_data(), quoted.trim_end().into_data());
    compared.map_err(|error| error.to_string())
}

/// Copies a file of the repository to the folder in which a page's commands run.
pub(crate) fn copy(from: &Path, folder: &Path) {
    fs::copy(from, folder.join(from.file_name().unwrap())).unwrap();
}

#[test]
fn quoted_lines_must_be_printed_in_order_and_completely() {
    let check = |quoted: &str, printed: &str| {
        check_quoted(&quoted.lines().map(str::to_owned).collect::<Vec<_>>(), printed).is_ok()
    };
    let printed = "one 1.25 m\n\ntwo 2\nthree\n";
    for good in ["", "one 1.25 m\n\ntwo 2\nthree", "...\ntwo 2\n...", "one ... m\n...\nthree", "one...\n..."] {
        assert!(check(good, printed), "{good}");
    }
    for bad in ["one 1.26 m\n...", "two 2\n...", "one 1.25 m", "...\nthree\ntwo 2", "one ... s\n...", "...\nfour"] {
        assert!(!check(bad, printed), "{bad}");
    }
}
