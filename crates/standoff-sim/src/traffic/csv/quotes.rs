//! What separates the fields of a CSV row, where they begin, and whether its quotes come in pairs.
//!
//! The CSV reader takes whatever stands between a quote and the next one for a field, lines of other vehicles included,
//! and what stands behind a closing quote for a part of it: so one quote too many is not seen until far behind it.

/// What is wrong with the quotes of a row; places are bytes from its begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wrong {
    /// One opens and is not closed.
    Open {
        /// Where.
        open: usize,
    },
    /// One is closed, and the field goes on.
    Amid {
        /// Where it opens.
        open: usize,
        /// Where it is closed.
        close: usize,
    },
}

enum Within {
    /// At the begin of a field.
    Begin,
    /// A field without quotes: a quote in it is a sign like any other.
    Bare,
    Quotes {
        open: usize,
    },
    /// Behind a quote that closes, or is the first half of one that is meant.
    Closed {
        open: usize,
        close: usize,
    },
    /// Blanks behind a field in quotes.
    Behind {
        open: usize,
        close: usize,
    },
}

/// What separates the fields of a table: semicolons if its header has more of them than commas, outside of quotes.
pub(super) fn separator(header: &[u8]) -> u8 {
    let (mut is_quoted, mut commas, mut semicolons) = (false, 0, 0);
    for byte in header {
        match byte {
            b'"' => is_quoted = !is_quoted,
            b',' if !is_quoted => commas += 1,
            b';' if !is_quoted => semicolons += 1,
            _ => {}
        }
    }
    if semicolons > commas { b';' } else { b',' }
}

/// Where each field of a row begins, as far as its quotes are right, and what is wrong with them.
pub(super) fn fields(row: &[u8], separator: u8) -> (Vec<usize>, Option<Wrong>) {
    let mut begins = vec![0];
    let mut within = Within::Begin;
    for (at, &byte) in row.iter().enumerate() {
        within = match (within, byte) {
            (Within::Quotes { open }, b'"') => Within::Closed { open, close: at },
            (Within::Quotes { open }, _) => Within::Quotes { open },
            (Within::Closed { open, .. }, b'"') => Within::Quotes { open },
            (Within::Begin, b'"') => Within::Quotes { open: at },
            (_, byte) if byte == separator => {
                begins.push(at + 1);
                Within::Begin
            }
            (_, b'\n') => Within::Begin,
            (Within::Closed { open, close } | Within::Behind { open, close }, b' ' | b'\t') => {
                Within::Behind { open, close }
            }
            (Within::Closed { open, close } | Within::Behind { open, close }, _) => {
                return (begins, Some(Wrong::Amid { open, close }));
            }
            (Within::Begin | Within::Bare, _) => Within::Bare,
        };
    }
    let wrong = if let Within::Quotes { open } = within { Some(Wrong::Open { open }) } else { None };
    (begins, wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_begin_behind_commas_outside_of_quotes() {
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
    fn fields_may_begin_behind_semicolons() {
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
            ("1,\"v,3", Wrong::Open { open: 2 }),
            ("\"a\",\"b\"\"\n\n", Wrong::Open { open: 4 }),
            ("\"", Wrong::Open { open: 0 }),
            ("1,\"v,3\n2,\"v\",3\n", Wrong::Amid { open: 2, close: 9 }),
            ("\"a\" \"b\"", Wrong::Amid { open: 0, close: 2 }),
        ] {
            assert_eq!(fields(row.as_bytes(), b',').1, Some(wrong), "{row:?}");
        }
    }
}
