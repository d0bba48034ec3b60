//! Finds the position of a key in the text of a scenario, so that an error can point at it.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A position in a text; lines and columns count from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourcePosition {
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

/// The text of a scenario, parsed with positions.
pub(super) struct Map<'a> {
    /// The part that could be parsed.
    pub(super) root: Spanned<DeTable<'a>>,
    /// Errors of the rest.
    pub(super) errors: Vec<toml::de::Error>,
}

impl<'a> Map<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let (root, errors) = DeTable::parse_recoverable(text);
        Self { root, errors }
    }

    /// Returns the byte range of a dotted key and its value (`uavs.start.1.x_m`), or that of the innermost table around
    /// it.
    pub(super) fn find(&self, key: &str) -> Option<Range<usize>> {
        self.spans(key).last()
    }

    /// Returns whether the text contains the key itself.
    pub(super) fn has(&self, key: &str) -> bool {
        self.spans(key).count() == key.split('.').count()
    }

    /// Byte ranges of the parts of a dotted key, as far as the text contains them.
    fn spans(&self, key: &str) -> impl Iterator<Item = Range<usize>> {
        let mut here = Some(Step::Table(self.root.get_ref()));
        key.split('.').map_while(move |part| {
            let (span, next) = here.take()?.into_part(part)?;
            here = next;
            Some(span)
        })
    }
}

enum Step<'a> {
    Table(&'a DeTable<'a>),
    Array(&'a [Spanned<DeValue<'a>>]),
}

impl<'a> Step<'a> {
    fn into_part(self, part: &str) -> Option<(Range<usize>, Option<Step<'a>>)> {
        let (span, value) = match self {
            Step::Table(table) => {
                let (key, value) = table.get_key_value(part)?;
                (key.span(), value)
            }
            Step::Array(values) => {
                let value = values.get(part.parse::<usize>().ok()?)?;
                (value.span(), value)
            }
        };
        Some(match value.get_ref() {
            DeValue::Table(table) => (span, Some(Step::Table(table))),
            DeValue::Array(values) => (span, Some(Step::Array(values))),
            _ => (span.start..value.span().end.max(span.end), None),
        })
    }
}

/// Converts a byte offset to line and column.
pub(super) fn position_of(text: &str, offset: usize) -> SourcePosition {
    let before = text.get(..offset).unwrap_or(text);
    let start = *line_around(before, before.len()).start();
    SourcePosition { line: before.matches('\n').count() + 1, column: before[start..].chars().count() + 1 }
}

/// Returns the byte range of the line that contains an offset, up to its newline or the end of the text.
pub(super) fn line_around(text: &str, offset: usize) -> RangeInclusive<usize> {
    let (before, after) = text.split_at_checked(offset).unwrap_or((text, ""));
    let end = after.find('\n').map_or(text.len(), |newline| before.len() + newline);
    before.rfind('\n').map_or(0, |newline| newline + 1)..=end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_found_in_tables_and_arrays() {
        let text = "a = 1\n[b]\n  \"\u{e9}\" = 2\nc = 3\n[[d.at]]\nx = 4\n[[d.at]]\nx = 55\n";
        let found = |key: &str| Map::new(text).find(key).map(|span| position_of(text, span.start));
        assert_eq!(found("a"), Some(SourcePosition { line: 1, column: 1 }));
        assert_eq!(found("b.c"), Some(SourcePosition { line: 4, column: 1 }));
        assert_eq!(found("d.at.1.x"), Some(SourcePosition { line: 8, column: 1 }));
        assert_eq!(found("nowhere"), None);
        assert_eq!(Map::new(text).find("d.at.1.x").map(|span| &text[span]), Some("x = 55"));
    }

    #[test]
    fn a_missing_key_is_located_at_its_table() {
        assert_eq!(Map::new("x = 0\n[b]\nc = 3\n").find("b.missing"), Some(7..8));
    }
}
