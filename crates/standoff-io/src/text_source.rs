//! Reads text files of unknown origin, plain or gzip: unpacked, within size limits, as UTF-8 without byte order mark,
//! with LF line ends and known positions. Traffic files and maps are read with it.

mod expectation;
mod file_kind;
mod gunzip;
pub mod limits;
mod line_endings;
mod lines;
pub mod xml;

use std::io::{self, Cursor, Read};
use std::path::Path;

use crate::bounded_input::{self, size};
pub use expectation::Expectation;
use file_kind::{GZIP, HEAD, check_encoding, check_kind};
use gunzip::Gunzip;
use limits::MAX_TEXT;
use line_endings::LineEnds;
pub use lines::{Fault, Lines, Position, input_fault};

/// Text that is read in pieces.
pub type Text<'a> = Lines<Box<dyn Read + 'a>>;

/// Opens the text file at `path`. Fails if it is not a file (but a pipe, for example), is too large, or [`text`] fails.
pub fn open(path: &Path, expected: &'static Expectation) -> Result<Text<'static>, Fault> {
    let file = bounded_input::open(path, MAX_TEXT).map_err(|error| input_fault(None, &error))?;
    text(file, expected)
}

/// Message for text in another encoding, such as Latin-1.
pub const NOT_UTF_8: &str = "not text; must be UTF-8; save the file as UTF-8, or convert it, for example with \
                             iconv -f ISO-8859-1 -t UTF-8";

/// Begin of the message of `serde_json` for such text.
pub const NOT_UNICODE: &str = "invalid unicode code point";

const UTF_8_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Rejects the bytes of a file that is not plain text in UTF-8, with the way to such text.
pub fn check_is_text(bytes: &[u8], expected: &Expectation) -> Result<(), Fault> {
    check_kind(bytes, expected)?;
    check_encoding(bytes)?;
    if bytes.starts_with(GZIP) {
        return Err(Fault::whole("is compressed with gzip; decompress it first, with gunzip".to_owned()));
    }
    match std::str::from_utf8(bytes) {
        Ok(_) => Ok(()),
        Err(error) => Err(Fault::at(Position::START.after(&bytes[..error.valid_up_to()]), NOT_UTF_8.to_owned())),
    }
}

/// Returns the text of a file from its bytes. Fails if it is empty or has an unsupported compression or encoding;
/// reading fails where the text exceeds the size limit or contains a NUL.
pub fn text<'a>(reader: impl Read + 'a, expected: &'static Expectation) -> Result<Text<'a>, Fault> {
    let (head, bytes) = peek(reader, HEAD)?;
    if head.is_empty() {
        return Err(Fault::whole(format!("is empty; must be {}", expected.formats)));
    }
    check_kind(&head, expected)?;
    let unpacked: Box<dyn Read + 'a> =
        if head.starts_with(GZIP) { Box::new(Gunzip::new(bytes)) } else { Box::new(bytes) };
    let is_packed = head.starts_with(GZIP);
    let (head, mut text) = peek(unpacked, HEAD)?;
    if is_packed && head.starts_with(GZIP) {
        return Err(Fault::whole("is compressed with gzip twice; decompress it once, with gunzip".to_owned()));
    }
    if is_packed {
        check_kind(&head, expected)
            .map_err(|fault| Fault::whole(format!("once decompressed, it {}", fault.message)))?;
    }
    check_encoding(&head)?;
    if head.starts_with(UTF_8_MARK) {
        text.get_mut().0.set_position(UTF_8_MARK.len() as u64);
    }
    let checked = Checked { text, size_bytes: 0, max_bytes: MAX_TEXT, is_at_nul: false, expected };
    Ok(Lines::new(Box::new(LineEnds::new(checked)), expected))
}

/// A reader whose first bytes have been read ahead.
type Peeked<R> = io::Chain<Cursor<Vec<u8>>, R>;

/// Returns the first bytes (fewer at the end of the input), and a reader that still yields them.
fn peek<R: Read>(mut reader: R, bytes: u64) -> Result<(Vec<u8>, Peeked<R>), Fault> {
    let mut head = Vec::new();
    reader.by_ref().take(bytes).read_to_end(&mut head).map_err(|error| input_fault(None, &error))?;
    Ok((head.clone(), Cursor::new(head).chain(reader)))
}

/// Text within the size limit, up to its first NUL, at which reading fails.
struct Checked<R> {
    text: R,
    /// Number of bytes so far.
    size_bytes: u64,
    max_bytes: u64,
    /// True if the next byte is the NUL.
    is_at_nul: bool,
    expected: &'static Expectation,
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let what = self.expected.description;
        let count = if self.is_at_nul { 0 } else { self.text.read(out)? };
        self.size_bytes += count as u64;
        if self.size_bytes > self.max_bytes {
            let message = format!("has more than {} of text; cut the {what} into parts", size(self.max_bytes));
            return Err(Fault::whole(message).into());
        }
        let text = out.get(..count).unwrap_or_default();
        let length = if text.contains(&0) { text.iter().take_while(|&&byte| byte != 0).count() } else { count };
        self.is_at_nul |= length < count;
        if self.is_at_nul && length == 0 {
            let message =
                format!("a NUL byte, which text does not contain; is this a {what} file? copy or create it again");
            return Err(Fault::whole(message).into());
        }
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) static TRAFFIC: Expectation =
        Expectation { description: "traffic", formats: "FCD XML or CSV", is_map: false };

    /// Reads the text of a file to its end.
    pub(super) fn read(bytes: &[u8]) -> Result<String, Fault> {
        let (mut text, mut all) = (text(bytes, &TRAFFIC)?, String::new());
        let read = text.read_to_string(&mut all);
        read.map_err(|error| input_fault(Some(text.position()), &error)).map(|_| all)
    }

    #[test]
    fn a_text_without_end_is_refused() {
        let text = io::repeat(b' ');
        let mut text = Checked { text, size_bytes: 0, max_bytes: 100_000, is_at_nul: false, expected: &TRAFFIC };
        let error = text.read_to_end(&mut Vec::new()).unwrap_err();
        assert_eq!(input_fault(None, &error).message, "has more than 98 KiB of text; cut the traffic into parts");
    }

    #[test]
    fn a_nul_is_rejected_with_its_position() {
        for (bytes, line, column) in [
            (&b"t,id,x,y\n1,v\0,3,4\n"[..], 2, 4),
            (b"<fcd-export>\n <timestep\0 time=\"1\"/></fcd-export>", 2, 11),
            (b"\0\0\0", 1, 1),
            (b"  \0", 1, 3),
        ] {
            let fault = read(bytes).unwrap_err();
            assert!(fault.message.starts_with("a NUL byte"), "{fault}");
            assert_eq!(fault.position, Some(Position { line, column }));
        }
    }
}
