//! How the command speaks: results on standard output, all else on standard error.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use standoff_results::{Failure, Outcome, Telling};
use standoff_sim::text;

/// Says why it failed, and gives the exit status.
pub(crate) fn told(failure: &Failure) -> u8 {
    let colours = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    failure.told(colours).iter().for_each(|told| say(told));
    failure.status()
}

/// A thread could not be started.
pub(crate) fn no_thread(reason: io::Error) -> Failure {
    Failure::running(format!("cannot start a thread: {reason}; end other programs, or allow more (ulimit -u)"))
}

/// Prints to standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Failure::NobodyListens),
        Err(error) => Err(Failure::running(format!("standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Prints the outcome of a run whose results are in `out`: for programs, or for people.
pub(crate) fn print_outcome(outcome: &Outcome, json: bool, out: &Path, telling: Telling) -> Result<(), Failure> {
    print(&if json { outcome.json().map_err(Failure::running)? } else { text::lines(&outcome.told(out, telling)) })
}

/// Says something beside the results, on standard error, whatever names it repeats.
pub(crate) fn note(text: &str) {
    say(&text::lines(text));
}

/// Prints to standard error. Where that is closed, nobody wants to know.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
