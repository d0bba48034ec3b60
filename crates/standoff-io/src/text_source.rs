//! Reads text files of unknown origin, plain or gzip: unpacked, within size limits, as UTF-8 without byte order mark,
//! with LF line ends and known positions. Traffic files and maps are read with it.

mod expectation;
mod file_kind;
pub mod limits;
mod line_endings;
mod lines;
pub mod xml;

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::bounded_input::{self, size};
pub use expectation::Expectation;
use file_kind::{GZIP, HEAD, check_encoding, check_packing, check_unpacked};
use limits::{DEFLATE_RATIO, DENSE_TEXT, MAX_IDLE, MAX_RATIO, MAX_TEXT};
use line_endings::LineEnds;
pub use lines::{Fault, Lines, Position, input_fault};

/// Text that is read in pieces.
pub type Text<'a> = Lines<Box<dyn Read + 'a>>;

/// Opens the text file at `path`. Fails if it is not a file (but a pipe, for example), is too large, or [`text`] fails.
pub fn open(path: &Path, expected: &'static Expectation) -> Result<Text<'static>, Fault> {
    let mut file = bounded_input::open(path, MAX_TEXT).map_err(|error| input_fault(None, &error))?;
    check_size(&mut file, expected)?;
    text(file, expected)
}

const UTF_8_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Rejects a gzip file whose trailer states too large a size, before anything is unpacked.
fn check_size(file: &mut File, expected: &Expectation) -> Result<(), Fault> {
    let unpacked = unpacked_size(file).map_err(|error| input_fault(None, &error))?;
    match unpacked {
        Some(bytes) if bytes > MAX_TEXT => Err(Fault::whole(format!(
            "its last bytes state an unpacked size of {}; at most {}; cut the {} into parts, or, if the file is cut off, \
             copy it again",
            size(bytes),
            size(MAX_TEXT),
            expected.description
        ))),
        _ => Ok(()),
    }
}

/// Returns the unpacked size in the trailer of a gzip file, bytes, modulo 2^32; `None` if the size is impossible or the
/// file is not gzip.
fn unpacked_size(file: &mut File) -> io::Result<Option<u64>> {
    let mut head = Vec::new();
    file.by_ref().take(2).read_to_end(&mut head)?;
    let mut bytes = None;
    let length = file.metadata()?.len();
    if head == GZIP && length >= 6 {
        let mut last = [0; 4];
        file.seek(SeekFrom::End(-4))?;
        file.read_exact(&mut last)?;
        bytes = Some(u64::from(u32::from_le_bytes(last))).filter(|&bytes| bytes <= length * DEFLATE_RATIO);
    }
    file.rewind()?;
    Ok(bytes)
}

/// Returns the text of a file from its bytes. Fails if it is empty or has an unsupported compression or encoding;
/// reading fails where the text exceeds a limit or contains a NUL.
pub fn text<'a>(reader: impl Read + 'a, expected: &'static Expectation) -> Result<Text<'a>, Fault> {
    let (head, bytes) = peek(reader, HEAD)?;
    if head.is_empty() {
        return Err(Fault::whole(format!("is empty; must be {}", expected.formats)));
    }
    check_packing(&head)?;
    let is_gzip = head.starts_with(GZIP);
    let bytes = if is_gzip {
        Bytes::Gzip(Box::new(MultiGzDecoder::new(Counted { bytes, taken: 0, idle: 0 })))
    } else {
        Bytes::Plain(bytes)
    };
    let (head, mut text) = peek(Unpacked { bytes, given: 0, most: MAX_TEXT, expected }, HEAD)?;
    if is_gzip {
        check_unpacked(&head)?;
    }
    check_encoding(&head)?;
    if head.starts_with(UTF_8_MARK) {
        text.get_mut().0.set_position(UTF_8_MARK.len() as u64);
    }
    Ok(Lines::new(Box::new(LineEnds::new(WithoutNul { text, nul: false, expected })), expected))
}

/// A reader whose first bytes have been read ahead.
type Peeked<R> = io::Chain<Cursor<Vec<u8>>, R>;

/// Returns the first bytes (fewer at the end of the input), and a reader that still yields them.
fn peek<R: Read>(mut reader: R, bytes: u64) -> Result<(Vec<u8>, Peeked<R>), Fault> {
    let mut head = Vec::new();
    reader.by_ref().take(bytes).read_to_end(&mut head).map_err(|error| input_fault(None, &error))?;
    Ok((head.clone(), Cursor::new(head).chain(reader)))
}

enum Bytes<R: Read> {
    Plain(R),
    Gzip(Box<MultiGzDecoder<Counted<R>>>),
}

/// Counts the bytes that the decoder takes.
struct Counted<R> {
    bytes: R,
    taken: u64,
    /// Bytes taken since the decoder last produced output.
    idle: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.idle > MAX_IDLE {
            let message = format!("{} of gzip data decompress to nothing; create the file again", size(MAX_IDLE));
            return Err(Fault::whole(message).into());
        }
        let count = self.bytes.read(out)?;
        self.taken += count as u64;
        self.idle += count as u64;
        Ok(count)
    }
}

/// Unpacked bytes, within size limits.
struct Unpacked<R: Read> {
    bytes: Bytes<R>,
    given: u64,
    most: u64,
    expected: &'static Expectation,
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let (count, taken) = match &mut self.bytes {
            Bytes::Plain(bytes) => (bytes.read(out)?, None),
            Bytes::Gzip(decoder) => {
                let count = decoder.read(out)?;
                let packed = decoder.get_mut();
                if count > 0 {
                    packed.idle = 0;
                }
                (count, Some(packed.taken))
            }
        };
        self.given += count as u64;
        if self.given > self.most {
            let message =
                format!("has more than {} of text; cut the {} into parts", size(self.most), self.expected.description);
            return Err(Fault::whole(message).into());
        }
        match taken {
            Some(taken) if self.given > DENSE_TEXT && self.given / MAX_RATIO > taken => {
                let message = format!(
                    "unpacks to more than {MAX_RATIO} times its size ({} from {}), which is too dense for {}; if this is \
                     intended, unpack it first",
                    size(self.given),
                    size(taken),
                    self.expected.complete_form
                );
                Err(Fault::whole(message).into())
            }
            _ => Ok(count),
        }
    }
}

/// Text up to its first NUL, at which reading fails.
struct WithoutNul<R> {
    text: R,
    /// True if the next byte is the NUL.
    nul: bool,
    expected: &'static Expectation,
}

impl<R: Read> Read for WithoutNul<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = if self.nul { 0 } else { self.text.read(out)? };
        let text = out.get(..count).unwrap_or_default();
        let length = if text.contains(&0) { text.iter().take_while(|&&byte| byte != 0).count() } else { count };
        self.nul |= length < count;
        if self.nul && length == 0 {
            let what = self.expected.description;
            let message =
                format!("a NUL byte, which text does not contain; is this a {what} file? copy or create it again");
            return Err(Fault::whole(message).into());
        }
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    use super::*;

    pub(super) static TRAFFIC: Expectation =
        Expectation { description: "traffic", complete_form: "traffic", formats: "FCD XML or CSV" };

    pub(super) const CSV: &str = "t,id,x,y\n1,v,3,4\n";

    fn read_all(text: Text<'_>) -> Result<String, Fault> {
        let (mut lines, mut all) = (text.in_one_piece(), String::new());
        let read = lines.read_to_string(&mut all);
        read.map_err(|error| input_fault(Some(lines.position()), &error)).map(|_| all)
    }

    /// Reads the text of a file to its end.
    pub(super) fn read(bytes: &[u8]) -> Result<String, Fault> {
        read_all(text(bytes, &TRAFFIC)?)
    }

    /// Returns gzip of `head` and repetitions of `unit`, unpacked `bytes` long.
    fn bomb(head: &str, unit: &str, bytes: usize) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(head.as_bytes()).unwrap();
        let piece = unit.repeat((1 << 20) / unit.len());
        for _ in 0..bytes / piece.len() {
            encoder.write_all(piece.as_bytes()).unwrap();
        }
        encoder.finish().unwrap()
    }

    #[test]
    fn gzip_that_is_too_dense_for_traffic_is_refused() {
        for (head, unit) in [("<fcd-export>", "<a/>"), ("t,id,x,y\n", "#\n")] {
            let error = read(&bomb(head, unit, 2 * DENSE_TEXT as usize)).unwrap_err();
            assert!(error.message.starts_with("unpacks to more than 100 times its size (17 MiB from"), "{error}");
        }
        let dense = bomb(CSV, "#\n", DENSE_TEXT as usize / 2);
        assert!(read(&dense).is_ok(), "a small dense text is harmless");
    }

    #[test]
    fn gzip_members_without_end_are_refused() {
        let empty = GzEncoder::new(Vec::new(), Compression::best()).finish().unwrap();
        let members = empty.repeat(3 * MAX_IDLE as usize / empty.len());
        assert!(read(&members).unwrap_err().message.starts_with("1024 KiB of gzip data decompress to nothing"));
    }

    #[test]
    fn a_text_without_end_is_refused() {
        let mut text = Unpacked { bytes: Bytes::Plain(io::repeat(b' ')), given: 0, most: 100_000, expected: &TRAFFIC };
        let error = text.read_to_end(&mut Vec::new()).unwrap_err();
        assert_eq!(input_fault(None, &error).message, "has more than 98 KiB of text; cut the traffic into parts");
    }

    #[test]
    fn a_gzip_trailer_with_too_large_a_size_is_rejected_if_plausible() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("f.gz");
        let mut bytes = bomb(CSV, "#\n", 1 << 20);
        let mut message_with = |length: usize, claim: u32| {
            bytes.resize(length, 0);
            bytes.extend(claim.to_le_bytes());
            std::fs::write(&path, &bytes).unwrap();
            open(&path, &TRAFFIC).and_then(read_all).unwrap_err().message
        };
        let message = message_with(1 << 20, 600 << 20);
        assert!(message.starts_with("its last bytes state an unpacked size of 600 MiB; at most 512 MiB"), "{message}");
        let message = message_with(1 << 18, 600 << 20);
        assert!(message.contains("gzip data"), "a file this small cannot unpack to this size: {message}");
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
