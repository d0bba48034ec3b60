//! Separator of a CSV row, start of each field, and whether the quotes are paired.
//!
//! The CSV reader takes everything between a quote and the next one as one field, rows of other vehicles included, and
//! text after a closing quote as part of the field. One quote too many would therefore be detected only much later.

/// Error in the quotes of a row; positions are bytes from its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wrong {
    /// Position of the opening quote.
    pub(super) open: usize,
    /// Position of the closing quote after which the field continues; `None` if the quote is not closed.
    pub(super) close: Option<usize>,
}

#[derive(Clone, Copy)]
enum Within {
    /// At the start of a field.
    Begin,
    /// In a field without quotes, where a quote is an ordinary character.
    Bare,
    /// In a quoted field; the position of its opening quote.
    Quotes(usize),
    /// After a closing quote and blanks, or after the first half of a doubled quote.
    Closed { open: usize, close: usize },
}

/// Separators, by preference.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// Returns the separator that a line such as `sep=;` names; `None` for any other line.
pub(super) fn named_separator(line: &[u8]) -> Option<u8> {
    let line = line.strip_prefix(b"\"").unwrap_or(line);
    let (head, rest) = line.split_at_checked(4)?;
    let (separator, rest) = rest.split_first()?;
    let ends = rest.trim_ascii().is_empty() || rest.trim_ascii() == b"\"";
    (head.eq_ignore_ascii_case(b"sep=") && ends && SEPARATORS.contains(separator)).then_some(*separator)
}

/// Returns the separator of a table: the most frequent one of its header outside of quotes.
pub(super) fn separator(header: &[u8]) -> u8 {
    let (mut is_quoted, mut counts) = (false, [0; SEPARATORS.len()]);
    for byte in header {
        is_quoted ^= *byte == b'"';
        if let (false, Some(index)) = (is_quoted, SEPARATORS.iter().position(|separator| separator == byte)) {
            counts[index] += 1;
        }
    }
    let most = counts.into_iter().max().unwrap_or_default();
    counts.into_iter().zip(SEPARATORS).find(|(count, _)| *count == most).map_or(b',', |(_, separator)| separator)
}

/// Returns the start of each field of a row, up to the first error in its quotes, and that error.
pub(super) fn fields(row: &[u8], separator: u8) -> (Vec<usize>, Option<Wrong>) {
    let mut begins = vec![0];
    let mut within = Within::Begin;
    for (at, &byte) in row.iter().enumerate() {
        within = match (within, byte) {
            (Within::Quotes(open), b'"') => Within::Closed { open, close: at },
            (Within::Quotes(_), _) => within,
            (Within::Closed { open, close }, b'"') if at == close + 1 => Within::Quotes(open),
            (Within::Begin, b'"') => Within::Quotes(at),
            (_, byte) if byte == separator => {
                begins.push(at + 1);
                Within::Begin
            }
            (_, b'\n') => Within::Begin,
            (Within::Closed { .. }, b' ' | b'\t') => within,
            (Within::Closed { open, close }, _) => return (begins, Some(Wrong { open, close: Some(close) })),
            (Within::Begin | Within::Bare, _) => Within::Bare,
        };
    }
    let wrong = if let Within::Quotes(open) = within { Some(Wrong { open, close: None }) } else { None };
    (begins, wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_begin_after_commas_outside_of_quotes() {
        for (row, begins) in [
            ("", vec![0]),
            ("a,b,,c\n", vec![0, 2, 4, 5]),
            ("\"a,\"\"\n,\",b", vec![0, 9]),
            ("5\",6\",b\"\n", vec![0, 3, 6]),
            ("\"a\" ,\"\"\t,\"\"\"\"\n", vec![0, 5, 9]),
        ] {
            assert_eq!(fields(row.as_bytes(), b','), (begins, None), "{row:?}");
        }
    }

    #[test]
    fn fields_may_begin_after_semicolons() {
        assert_eq!(fields(b"1,5;\"a;\";;2,5\n", b';'), (vec![0, 4, 9, 10], None));
        for (header, expected) in [
            ("t;id;x;y", b';'),
            ("t;id;x;y;\"size, m, about, or, so\"", b';'),
            ("t,id,x,y", b','),
            ("t,id,x,y,\"a;b;c;d;e;f\"", b','),
            ("t;id,x", b','),
            ("", b','),
        ] {
            assert_eq!(separator(header.as_bytes()), expected, "{header}");
        }
    }

    #[test]
    fn quotes_come_in_pairs_around_a_field() {
        for (row, wrong) in [
            ("1,\"v,3", Wrong { open: 2, close: None }),
            ("\"a\",\"b\"\"\n\n", Wrong { open: 4, close: None }),
            ("\"", Wrong { open: 0, close: None }),
            ("1,\"v,3\n2,\"v\",3\n", Wrong { open: 2, close: Some(9) }),
            ("\"a\" \"b\"", Wrong { open: 0, close: Some(2) }),
            ("\"a\" \"\"", Wrong { open: 0, close: Some(2) }),
        ] {
            assert_eq!(fields(row.as_bytes(), b',').1, Some(wrong), "{row:?}");
        }
    }
}
