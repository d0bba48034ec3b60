//! Converts line ends to LF: lines of the input may end with LF, CR and LF, or, on old computers, CR alone.

use std::io::{self, Read};

/// Text whose lines all end with LF alone.
pub(super) struct LineEnds<R> {
    text: R,
    /// True if the previous byte was a CR: a following LF belongs to the same line end.
    after_cr: bool,
}

impl<R> LineEnds<R> {
    pub(super) fn new(text: R) -> Self {
        Self { text, after_cr: false }
    }
}

impl<R: Read> Read for LineEnds<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.text.read(out)?;
            let text = out.get_mut(..count).unwrap_or_default();
            if !self.after_cr && !text.contains(&b'\r') {
                return Ok(count);
            }
            let length = self.rewrite(text);
            // A single LF can vanish; an empty result is not the end of the text.
            if length > 0 || count == 0 {
                return Ok(length);
            }
        }
    }
}

impl<R> LineEnds<R> {
    /// Rewrites the text in place and returns its new length.
    fn rewrite(&mut self, text: &mut [u8]) -> usize {
        let mut length = 0;
        for at in 0..text.len() {
            let byte = text[at];
            if !(byte == b'\n' && self.after_cr) {
                text[length] = if byte == b'\r' { b'\n' } else { byte };
                length += 1;
            }
            self.after_cr = byte == b'\r';
        }
        length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a text through a buffer of `size` bytes.
    fn read(text: &str, size: usize) -> String {
        let mut lines = LineEnds::new(text.as_bytes());
        let (mut all, mut buffer) = (Vec::new(), vec![0; size]);
        loop {
            match lines.read(&mut buffer).unwrap() {
                0 => return String::from_utf8(all).unwrap(),
                count => all.extend_from_slice(&buffer[..count]),
            }
        }
    }

    #[test]
    fn every_line_ends_with_lf_for_any_buffer_size() {
        for size in 1..20 {
            assert_eq!(read("a\r\nb\rc\nd\r\r\n\n\r", size), "a\nb\nc\nd\n\n\n\n", "{size}");
            assert_eq!(read("\r\n\r\n\r\n", size), "\n\n\n", "{size}");
            assert_eq!(read("no end", size), "no end", "{size}");
        }
    }
}
