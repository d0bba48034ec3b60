//! How the command fails: what it says and the exit status.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use standoff::ParamError;
use standoff_sim::record::RecordError;
use standoff_sim::scenario::{MISTAKES_MAX, Problem, Scenario, ScenarioError};
use standoff_sim::text;

/// Why the command did not do what was asked.
pub(crate) enum Failure {
    /// Wrong input or usage: exit status 2.
    Input(String),
    /// A scenario that cannot be used: exit status 2; 1 if the machine failed to read it.
    Scenario(ScenarioError),
    /// It failed while running: exit status 1.
    Running(String),
    /// Nobody reads on (a closed pipe): not worth a word.
    NobodyListens,
}

impl Failure {
    pub(crate) fn input(error: impl Display) -> Self {
        Self::Input(error.to_string())
    }

    pub(crate) fn running(error: impl Display) -> Self {
        Self::Running(error.to_string())
    }

    /// Says it as a warning: what was asked for is done all the same.
    pub(crate) fn warn(&self) {
        if let Self::Input(message) | Self::Running(message) = self {
            note(&format!("warning: {message}"));
        }
    }

    /// Says it, and gives the exit status.
    pub(crate) fn told(&self) -> u8 {
        match self {
            Self::Input(message) | Self::Running(message) => note(&format!("error: {message}")),
            Self::Scenario(ScenarioError { problems, .. }) => {
                problems.iter().for_each(|problem| say(&drawn(problem)));
                if problems.len() >= MISTAKES_MAX {
                    note("there may be more: reading ends after so many mistakes");
                }
            }
            Self::NobodyListens => {}
        }
        match self {
            Self::Scenario(error) if error.is_machine_s => 1,
            Self::Input(_) | Self::Scenario(_) => 2,
            Self::Running(_) => 1,
            Self::NobodyListens => 0,
        }
    }
}

/// A problem, drawn under what was typed; where that is not known, in a line.
fn drawn(problem: &Problem) -> String {
    let Some(excerpt) = &problem.excerpt else { return text::lines(&format!("error: {problem}")) };
    let colours = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let renderer = if colours { Renderer::styled() } else { Renderer::plain() };
    // Only its own lines: the text may be large, and every mistake draws from it.
    let (lines, span) = excerpt.lines();
    let typed = Snippet::source(lines)
        .line_start(problem.place.map_or(1, |place| place.line))
        .path(text::escaped(&problem.file))
        .annotation(AnnotationKind::Primary.span(span));
    let told = Level::ERROR.primary_title(text::lines(&problem.message)).element(typed);
    let help = problem.help.as_deref().map(|help| Level::HELP.message(text::lines(help)));
    renderer.render(&[told.elements(help)])
}

/// A thread could not be started.
pub(crate) fn no_thread(reason: io::Error) -> Failure {
    Failure::running(format!("cannot start a thread: {reason}; end other programs, or allow more (ulimit -u)"))
}

/// A record that is not what it should be is wrong input.
pub(crate) fn of_record(error: RecordError) -> Failure {
    if error.is_wrong_input() { Failure::input(error) } else { Failure::running(error) }
}

/// What is wrong with parameters, a line each.
pub(crate) fn refused(errors: &[ParamError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
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

/// Tells what is odd about a scenario that can be flown all the same, after `of`.
pub(crate) fn warn(scenario: &Scenario, of: &str) {
    scenario.warnings.iter().for_each(|warning| note(&format!("warning: {of}{warning}")));
}

/// Says something beside the results, on standard error, whatever names it repeats.
pub(crate) fn note(text: &str) {
    say(&text::lines(text));
}

/// Prints to standard error. Where that is closed, nobody wants to know.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
