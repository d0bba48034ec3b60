//! What is wrong with a scenario, for people: where, which key, which value, what is allowed.

use std::fmt;

use super::locate::Place;
use crate::traffic::TrafficError;

/// A scenario that cannot be used; displays one line per problem.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct ScenarioError {
    /// Everything that is wrong.
    pub problems: Vec<Problem>,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The file, or `--set` for a value given on the command line.
    pub file: String,
    /// Where in the file.
    pub place: Option<Place>,
    /// What is wrong: key, value and allowed range.
    pub message: String,
}

impl ScenarioError {
    pub(crate) fn one(file: impl Into<String>, place: Option<Place>, message: impl Into<String>) -> Self {
        Self { problems: vec![Problem { file: file.into(), place, message: message.into() }] }
    }
}

impl From<TrafficError> for ScenarioError {
    fn from(error: TrafficError) -> Self {
        let place = error.position.map(|at| Place { line: at.line as usize, column: at.column as usize });
        Self::one(error.file, place, error.message)
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(Place { line, column }) => write!(f, "{}:{line}:{column}: {}", self.file, self.message),
            None => write!(f, "{}: {}", self.file, self.message),
        }
    }
}
