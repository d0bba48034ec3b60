//! Failures: messages for the user, and exit statuses.

use std::fmt::Display;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use standoff::ParamError;
use standoff_io::display_text;
use standoff_record::RecordError;
use standoff_sim::monte_carlo::MonteCarloError;
use standoff_sim::scenario::{MISTAKES_MAX, Problem, ScenarioError};

/// Failure of a command or of a call from Python.
#[derive(Debug)]
pub enum Failure {
    /// Wrong input or usage: exit status 2.
    Input(String),
    /// A scenario that cannot be used: exit status 2; 1 if the machine failed to read it.
    Scenario(ScenarioError),
    /// Failure while running: exit status 1.
    Running(String),
    /// The output is a closed pipe: no message, exit status 0.
    OutputClosed,
}

impl Failure {
    /// Creates a failure for wrong input or usage.
    pub fn input(error: impl Display) -> Self {
        Self::Input(error.to_string())
    }

    /// Creates a failure while running.
    pub fn running(error: impl Display) -> Self {
        Self::Running(error.to_string())
    }

    /// Returns the failure as a warning, if the work can continue without the failed part; `None` for failures of
    /// scenarios and pipes.
    pub fn warning(&self) -> Option<String> {
        match self {
            Self::Input(message) | Self::Running(message) => Some(format!("warning: {message}")),
            Self::Scenario(_) | Self::OutputClosed => None,
        }
    }

    /// Returns the messages for the user, one per problem; with ANSI `colours` for a terminal.
    pub fn message(&self, colours: bool) -> Vec<String> {
        match self {
            Self::Input(message) | Self::Running(message) => vec![display_text::lines(&format!("error: {message}"))],
            Self::Scenario(ScenarioError { problems, .. }) => {
                let more = format!("there may be more: reading stops after {MISTAKES_MAX} errors");
                let problems = problems.iter().map(|problem| format_problem(problem, colours));
                problems.chain((self.may_be_more()).then_some(more)).collect()
            }
            Self::OutputClosed => Vec::new(),
        }
    }

    fn may_be_more(&self) -> bool {
        matches!(self, Self::Scenario(error) if error.problems.len() >= MISTAKES_MAX)
    }

    /// Returns the exit status: 0 success, 1 failure while running, 2 wrong input or usage.
    pub fn status(&self) -> u8 {
        match self {
            Self::Scenario(error) if error.is_io_error => 1,
            Self::Input(_) | Self::Scenario(_) => 2,
            Self::Running(_) => 1,
            Self::OutputClosed => 0,
        }
    }
}

/// Renders a problem with the affected part of the input; on a single line if that part is not known.
fn format_problem(problem: &Problem, colours: bool) -> String {
    let Some(excerpt) = &problem.excerpt else { return display_text::lines(&format!("error: {problem}")) };
    let renderer = if colours { Renderer::styled() } else { Renderer::plain() };
    // Only the affected lines are passed on: the text may be large, and each problem would process all of it.
    let (lines, span) = excerpt.lines();
    let source = Snippet::source(lines)
        .line_start(problem.place.map_or(1, |place| place.line))
        .path(display_text::escaped(&problem.file))
        .annotation(AnnotationKind::Primary.span(span));
    let error = Level::ERROR.primary_title(display_text::lines(&problem.message)).element(source);
    let help = problem.help.as_deref().map(|help| Level::HELP.message(display_text::lines(help)));
    renderer.render(&[error.elements(help)])
}

/// Converts an error of a Monte Carlo batch.
pub fn of_batch(error: MonteCarloError) -> Failure {
    match error {
        MonteCarloError::Scenario(error) => Failure::Scenario(error),
        error if error.is_wrong_input() => Failure::input(error),
        error => Failure::running(error),
    }
}

/// Converts an error of a record; an invalid record counts as wrong input.
pub fn of_record(error: RecordError) -> Failure {
    if error.is_wrong_input() { Failure::input(error) } else { Failure::running(error) }
}

/// Formats parameter errors, one per line.
pub fn format_errors(errors: &[ParamError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
