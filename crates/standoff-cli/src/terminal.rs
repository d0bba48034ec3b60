//! Terminal output: results go to standard output, everything else to standard error.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use standoff_app::{Failure, Outcome, OutcomeOptions};
use standoff_io::display_text::{self, WIDTH};

/// Prints the messages of a failure, and returns the exit status.
pub(crate) fn report_failure(failure: &Failure) -> u8 {
    let colours = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    failure.message(colours).iter().for_each(|message| write_line(message));
    failure.status()
}

/// Returns the failure for a thread that could not be started.
pub(crate) fn no_thread(reason: io::Error) -> Failure {
    Failure::running(format!("cannot start a thread: {reason}; close other programs, or raise the limit (ulimit -u)"))
}

/// Prints to standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    written(io::stdout().lock().write_all(text.as_bytes()))
}

/// Completes output to which all text was `printed`, and returns its failure.
pub(crate) fn written(printed: io::Result<()>) -> Result<(), Failure> {
    match printed.and_then(|()| io::stdout().lock().flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Failure::OutputClosed),
        Err(error) => Err(Failure::running(format!("standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Prints the outcome of a run whose results are in `out`, as JSON or as a table.
pub(crate) fn print_outcome(outcome: &Outcome, json: bool, out: &Path, options: OutcomeOptions) -> Result<(), Failure> {
    print(&if json {
        outcome.json().map_err(Failure::running)?
    } else {
        display_text::lines(&outcome.text(out, OutcomeOptions { width: width(), ..options }))
    })
}

/// Returns the width of the text on standard output: that of a narrow terminal, otherwise the same as in a pipe.
fn width() -> usize {
    const NARROWEST: usize = 60;
    let columns = terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    columns.map_or(WIDTH, |columns| columns.saturating_sub(1).clamp(NARROWEST, WIDTH))
}

/// Prints a message to standard error, with control characters escaped.
pub(crate) fn note(text: &str) {
    write_line(&display_text::lines(text));
}

/// Writes a line to standard error; write errors are ignored.
fn write_line(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
