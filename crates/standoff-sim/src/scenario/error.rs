//! Errors of a scenario: position, key, value and what is allowed.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use standoff_io::display_text::{as_typed, escaped};

use super::locate::{SourcePosition, line_around};
use crate::traffic::TrafficError;

/// Error of a scenario that cannot be used; displays one line per problem.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct ScenarioError {
    /// All problems.
    pub problems: Vec<Problem>,
    /// True if the machine failed to read the file, rather than the scenario being wrong.
    pub is_io_error: bool,
}

/// One problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The file, or `command line` for a value given there.
    pub file: String,
    /// Position in the file.
    pub place: Option<SourcePosition>,
    /// Text at that position, to show the problem below it.
    pub excerpt: Option<Excerpt>,
    /// Message: key, value and allowed range.
    pub message: String,
    /// Advice, such as a similar key.
    pub help: Option<String>,
}

/// A marked part of a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Excerpt {
    /// The whole text.
    pub text: Arc<str>,
    /// The marked part, in bytes, at character boundaries.
    pub span: Range<usize>,
}

impl Excerpt {
    /// Returns the lines that contain the part, made safe to print, and the byte range of the part in them.
    pub fn lines(&self) -> (String, Range<usize>) {
        let Range { start, end } = self.span;
        let from = *line_around(&self.text, start).start();
        let to = *line_around(&self.text, end).end();
        // A CR before the newline belongs to the line end.
        let to = if to > end && self.text[..to].ends_with('\r') { to - 1 } else { to };
        let [before, part, after] = [from..start, start..end, end..to].map(|range| as_typed(&self.text[range]));
        let span = before.len()..before.len() + part.len();
        (before + &part + &after, span)
    }
}

impl ScenarioError {
    pub(crate) fn one(file: impl Into<String>, place: Option<SourcePosition>, message: impl Into<String>) -> Self {
        Problem { file: file.into(), place, excerpt: None, message: message.into(), help: None }.into()
    }
}

impl From<Problem> for ScenarioError {
    fn from(problem: Problem) -> Self {
        vec![problem].into()
    }
}

impl From<Vec<Problem>> for ScenarioError {
    fn from(problems: Vec<Problem>) -> Self {
        Self { problems, is_io_error: false }
    }
}

impl From<TrafficError> for ScenarioError {
    fn from(error: TrafficError) -> Self {
        let place = error.position.map(|at| SourcePosition { line: at.line as usize, column: at.column as usize });
        Self { is_io_error: error.is_io_error, ..Self::one(error.file, place, error.message) }
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
        f.write_str(&escaped(&self.file))?;
        if let Some(SourcePosition { line, column }) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.message)?;
        self.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excerpt_contains_no_control_characters() {
        let text = "a = 1\r\n\"\u{9b}2J\" =\t\u{2028}\u{2029}\u{202e}x # \u{2066}\u{feff}\u{85}\u{1b}\\é\r\nb = 2\r\n";
        let start = text.find("\u{2029}").unwrap();
        let excerpt = Excerpt { text: text.into(), span: start..text.find('x').unwrap() };
        let (lines, span) = excerpt.lines();
        assert_eq!((lines.as_str(), &lines[span]), ("\"�2J\" =\t���x # ���␛\\é", "��"));
    }

    #[test]
    fn an_excerpt_may_have_several_lines() {
        let text = "x = [\n\t1,\r\n]\n";
        let (lines, span) = Excerpt { text: text.into(), span: 4..text.len() - 1 }.lines();
        assert_eq!((lines.as_str(), &lines[span]), ("x = [\n\t1,\n]", "[\n\t1,\n]"));
    }
}
