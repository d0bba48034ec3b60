//! Reads text in pieces of limited length, and tracks line and column.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};

use super::expectation::Expectation;
use super::limits::MAX_PIECE;
use crate::bounded_input;

/// Position in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Line, from 1.
    pub line: u64,
    /// Character in the line, from 1.
    pub column: u64,
}

impl Position {
    /// Start of the text.
    pub const START: Self = Self { line: 1, column: 1 };

    /// Returns the position after `text`, which starts at this position.
    pub fn after(mut self, text: &[u8]) -> Self {
        for &byte in text {
            if byte == b'\n' {
                self = Self { line: self.line + 1, column: 1 };
            } else if byte & 0xC0 != 0x80 {
                // Continuation bytes of UTF-8 belong to a character that has been counted.
                self.column += 1;
            }
        }
        self
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// Error in a file; the caller adds the file name.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{message}")]
pub struct Fault {
    /// Position, if the error is in one place.
    pub position: Option<Position>,
    /// Message: what is wrong, what is allowed, what to do.
    pub message: String,
    /// True if the machine failed, rather than the file being wrong.
    pub is_io_error: bool,
}

impl Fault {
    /// Creates an error of the file as a whole.
    pub fn whole(message: String) -> Self {
        Self { position: None, message, is_io_error: false }
    }

    /// Creates an error at a position.
    pub fn at(position: Position, message: String) -> Self {
        Self { position: Some(position), message, is_io_error: false }
    }
}

impl From<Fault> for io::Error {
    fn from(fault: Fault) -> Self {
        Self::other(fault)
    }
}

/// Describes why the bytes could not be read. `position` is used if the error has no position of its own.
pub fn input_fault(position: Option<Position>, error: &io::Error) -> Fault {
    if let Some(fault) = error.get_ref().and_then(|inner| inner.downcast_ref::<Fault>()) {
        return Fault { position: fault.position.or(position), ..fault.clone() };
    }
    let message = match error.kind() {
        io::ErrorKind::UnexpectedEof => {
            "the gzip data end too early; the file is cut off: copy or create it again".into()
        }
        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => {
            format!("the gzip data are damaged ({error}); copy or create the file again")
        }
        _ => bounded_input::cannot_be_read(error),
    };
    Fault { position, message, is_io_error: !bounded_input::is_input_error(error) }
}

/// A reader that tracks its position, and fails if one piece (from one `begin` to the next) becomes too long.
#[derive(Debug)]
pub struct Lines<R> {
    inner: BufReader<R>,
    expected: &'static Expectation,
    position: Position,
    /// Start of the piece.
    begin: Position,
    left: usize,
    /// True if the piece has contained only blanks so far.
    is_blank: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(reader: R, expected: &'static Expectation) -> Self {
        Self {
            inner: BufReader::with_capacity(1 << 16, reader),
            expected,
            position: Position::START,
            begin: Position::START,
            left: MAX_PIECE,
            is_blank: true,
        }
    }

    /// Starts a new piece and returns its position.
    pub fn begin(&mut self) -> Position {
        self.left = MAX_PIECE;
        self.is_blank = true;
        self.begin = self.position;
        self.position
    }

    /// Removes the length limit of pieces.
    #[must_use]
    pub fn in_one_piece(self) -> Self {
        Self { left: usize::MAX, ..self }
    }

    /// Position of the next byte.
    pub fn position(&self) -> Position {
        self.position
    }

    /// Skips blanks and returns the next byte without consuming it; `None` at the end.
    pub fn first_byte(&mut self) -> Result<Option<u8>, Fault> {
        loop {
            let here = self.position;
            let text = self.fill_buf().map_err(|error| input_fault(Some(here), &error))?;
            let Some(&byte) = text.first() else {
                return Ok(None);
            };
            let blank = text.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
            if blank == 0 {
                return Ok(Some(byte));
            }
            self.consume(blank);
        }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl<R: Read> BufRead for Lines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        let text = self.inner.fill_buf()?;
        if self.left == 0 && !text.is_empty() {
            let what = self.expected.description;
            let message = if self.is_blank {
                format!("more than 1 MiB of blanks in one place; at most 1 MiB; is this a {what} file? remove them")
            } else {
                format!("one XML element or CSV row is too long; at most 1 MiB; is this a {what} file?")
            };
            return Err(Fault::at(self.begin, message).into());
        }
        Ok(&text[..text.len().min(self.left)])
    }

    fn consume(&mut self, count: usize) {
        let taken = self.inner.buffer().get(..count).unwrap_or_default();
        self.position = self.position.after(taken);
        self.is_blank = self.is_blank && taken.iter().all(u8::is_ascii_whitespace);
        self.left = self.left.saturating_sub(count);
        self.inner.consume(count);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::TRAFFIC;
    use super::*;

    #[test]
    fn lines_and_characters_are_counted() {
        let mut lines = Lines::new(&b"a\r\n\xC3\xA9xy"[..], &TRAFFIC);
        assert_eq!(lines.begin(), Position::START);
        lines.read_exact(&mut [0; 3]).unwrap();
        assert_eq!(lines.position(), Position { line: 2, column: 1 });
        lines.read_exact(&mut [0; 3]).unwrap();
        assert_eq!(lines.begin(), Position { line: 2, column: 3 });
    }

    #[test]
    fn blanks_before_the_text_are_counted() {
        let mut lines = Lines::new(&b" \n\r\n  <a>"[..], &TRAFFIC);
        assert_eq!(lines.first_byte().unwrap(), Some(b'<'));
        assert_eq!(lines.position(), Position { line: 3, column: 3 });
        assert_eq!(Lines::new(&b" \n "[..], &TRAFFIC).first_byte().unwrap(), None);
    }

    #[test]
    fn a_piece_may_be_as_long_as_the_limit_but_no_longer() {
        let text = vec![b'x'; MAX_PIECE];
        assert_eq!(Lines::new(&text[..], &TRAFFIC).read_to_end(&mut Vec::new()).unwrap(), MAX_PIECE);
        let longer = vec![b'x'; MAX_PIECE + 1];
        let error = Lines::new(&longer[..], &TRAFFIC).read_to_end(&mut Vec::new()).unwrap_err();
        let fault = input_fault(None, &error);
        assert!(fault.message.contains("at most 1 MiB"));
        assert_eq!(fault.position, Some(Position::START), "start of the piece");
    }

    #[test]
    fn too_many_blanks_are_reported_as_blanks() {
        let blanks = |count| [vec![b'\n'; count], b"<a>".to_vec()].concat();
        assert_eq!(Lines::new(&blanks(MAX_PIECE - 1)[..], &TRAFFIC).first_byte().unwrap(), Some(b'<'));
        let fault = Lines::new(&blanks(MAX_PIECE)[..], &TRAFFIC).first_byte().unwrap_err();
        assert_eq!(fault.position, Some(Position::START));
        assert!(fault.message.starts_with("more than 1 MiB of blanks"), "{fault}");
    }
}
