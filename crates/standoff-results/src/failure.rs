//! How it fails: what to tell people, and the exit status.

use std::fmt::Display;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use standoff::ParamError;
use standoff_sim::monte_carlo::MonteCarloError;
use standoff_sim::record::RecordError;
use standoff_sim::scenario::{MISTAKES_MAX, Problem, ScenarioError};
use standoff_sim::text;

/// Why what was asked for was not done.
pub enum Failure {
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
    /// Wrong input or usage.
    pub fn input(error: impl Display) -> Self {
        Self::Input(error.to_string())
    }

    /// It failed while running.
    pub fn running(error: impl Display) -> Self {
        Self::Running(error.to_string())
    }

    /// The same as a warning: what was asked for is done all the same. Of scenarios and pipes there is none.
    pub fn warning(&self) -> Option<String> {
        match self {
            Self::Input(message) | Self::Running(message) => Some(format!("warning: {message}")),
            Self::Scenario(_) | Self::NobodyListens => None,
        }
    }

    /// What to tell people, piece by piece; `colours` for a terminal.
    pub fn told(&self, colours: bool) -> Vec<String> {
        match self {
            Self::Input(message) | Self::Running(message) => vec![text::lines(&format!("error: {message}"))],
            Self::Scenario(ScenarioError { problems, .. }) => {
                let more = "there may be more: reading ends after so many mistakes".to_owned();
                let problems = problems.iter().map(|problem| drawn(problem, colours));
                problems.chain((self.may_be_more()).then_some(more)).collect()
            }
            Self::NobodyListens => Vec::new(),
        }
    }

    fn may_be_more(&self) -> bool {
        matches!(self, Self::Scenario(error) if error.problems.len() >= MISTAKES_MAX)
    }

    /// The exit status: 0 done, 1 failed while running, 2 wrong input or usage.
    pub fn status(&self) -> u8 {
        match self {
            Self::Scenario(error) if error.is_machine_s => 1,
            Self::Input(_) | Self::Scenario(_) => 2,
            Self::Running(_) => 1,
            Self::NobodyListens => 0,
        }
    }
}

/// A problem, drawn under what was typed; where that is not known, in a line.
fn drawn(problem: &Problem, colours: bool) -> String {
    let Some(excerpt) = &problem.excerpt else { return text::lines(&format!("error: {problem}")) };
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

/// Of a batch.
pub fn of_batch(error: MonteCarloError) -> Failure {
    match error {
        MonteCarloError::Scenario(error) => Failure::Scenario(error),
        error if error.is_wrong_input() => Failure::input(error),
        error => Failure::running(error),
    }
}

/// A record that is not what it should be is wrong input.
pub fn of_record(error: RecordError) -> Failure {
    if error.is_wrong_input() { Failure::input(error) } else { Failure::running(error) }
}

/// What is wrong with parameters, a line each.
pub fn refused(errors: &[ParamError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
