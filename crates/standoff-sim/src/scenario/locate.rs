//! Where a key of a scenario stands, so that an error can point at it.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A place in a text, both counted from 1; columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

/// The text of a scenario, parsed with places.
pub(super) struct Map<'a> {
    /// What can be parsed of it.
    pub(super) root: Spanned<DeTable<'a>>,
    /// What cannot.
    pub(super) errors: Vec<toml::de::Error>,
}

impl<'a> Map<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let (root, errors) = DeTable::parse_recoverable(text);
        Self { root, errors }
    }

    /// Where a dotted key stands with its value (`uavs.at.1.x_m`), or the nearest table around it; bytes.
    pub(super) fn find(&self, key: &str) -> Option<Range<usize>> {
        self.spans(key).last()
    }

    /// The key itself stands in the text.
    pub(super) fn has(&self, key: &str) -> bool {
        self.spans(key).count() == key.split('.').count()
    }

    /// The spans of a dotted key's parts, as far as they are there.
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

/// The place of a byte of a text.
pub(super) fn place_of(text: &str, offset: usize) -> Place {
    let before = text.get(..offset).unwrap_or(text);
    let start = *line_around(before, before.len()).start();
    Place { line: before.matches('\n').count() + 1, column: before[start..].chars().count() + 1 }
}

/// The line of a byte of a text, up to the byte that ends it, or the text's end.
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
        let found = |key: &str| Map::new(text).find(key).map(|span| place_of(text, span.start));
        assert_eq!(found("a"), Some(Place { line: 1, column: 1 }));
        assert_eq!(found("b.c"), Some(Place { line: 4, column: 1 }));
        assert_eq!(found("d.at.1.x"), Some(Place { line: 8, column: 1 }));
        assert_eq!(found("nowhere"), None);
        assert_eq!(Map::new(text).find("d.at.1.x").map(|span| &text[span]), Some("x = 55"));
    }

    #[test]
    fn a_key_that_is_not_there_is_looked_for_in_its_table() {
        assert_eq!(Map::new("x = 0\n[b]\nc = 3\n").find("b.missing"), Some(7..8));
    }
}
