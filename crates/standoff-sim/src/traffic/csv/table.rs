//! Reads the rows of a CSV table with the position of each field.

use std::io::{self, BufRead, Cursor, Read};

use csv::{ByteRecord, ReaderBuilder};
use standoff_io::text_source::limits::MAX_PIECE;
use standoff_io::text_source::{Fault, Lines, NOT_UTF_8, Position, input_fault};

use super::quotes::{self, Wrong};

/// Rows of a table, with the position of each field.
pub(super) struct Table<R> {
    reader: csv::Reader<RowText<R>>,
    /// The current row.
    pub(super) row: ByteRecord,
    /// Separator between fields.
    pub(super) separator: u8,
}

impl<R: Read> Table<R> {
    /// Creates the table; determines the separator from the header.
    pub(super) fn new(lines: Lines<R>) -> Result<Self, Fault> {
        let start = lines.position();
        let mut text =
            RowText { lines, start, ahead: Cursor::default(), text: Vec::new(), separator: b',', separators: None };
        text.look_ahead().map_err(|error| input_fault(Some(text.lines.position()), &error))?;
        // Spreadsheets write the separator into a line before the header.
        let named = quotes::named_separator(text.ahead.get_ref());
        if named.is_some() {
            text.ahead = Cursor::default();
            text.look_ahead().map_err(|error| input_fault(Some(text.lines.position()), &error))?;
        }
        let separator = named.unwrap_or_else(|| quotes::separator(text.ahead.get_ref()));
        text.separator = separator;
        let reader = ReaderBuilder::new().has_headers(false).flexible(true).delimiter(separator).from_reader(text);
        Ok(Self { reader, row: ByteRecord::new(), separator })
    }

    /// Reads the next row; `false` at the end. Fails if the quotes of the row are not paired.
    pub(super) fn next_row(&mut self) -> Result<bool, Fault> {
        self.reader.get_mut().text.clear();
        let read = self.reader.read_byte_record(&mut self.row);
        let text = &self.reader.get_ref().text;
        // A row can be too long because of an unclosed quote.
        if (read.is_ok() || text.len() >= MAX_PIECE) && text.contains(&b'"') {
            self.check_quotes()?;
        }
        // The first row is the header.
        self.reader.get_mut().separators.get_or_insert(self.row.len().saturating_sub(1));
        read.map_err(|error| {
            let position = self.reader.get_ref().lines.position();
            match error.into_kind() {
                csv::ErrorKind::Io(error) => input_fault(Some(position), &error),
                other => Fault::at(position, format!("not CSV: {other:?}")),
            }
        })
    }

    fn check_quotes(&self) -> Result<(), Fault> {
        let RowText { start, text, separator, .. } = self.reader.get_ref();
        let place = |at: usize| start.after(&text[..at]);
        let Some(Wrong { open, close }) = quotes::fields(text, *separator).1 else { return Ok(()) };
        let closed = close.map(|close| format!("is closed at {}, in the middle of a field", place(close)));
        let what = closed.unwrap_or_else(|| "is not closed".to_string());
        let advice =
            "quotes must enclose a whole field; close it before the separator, remove it, or double it within quotes";
        Err(Fault::at(place(open), format!("a quote opens here and {what}; {advice}")))
    }

    /// Returns the text of field `index` of this row.
    pub(super) fn text(&self, index: usize) -> Result<&str, Fault> {
        std::str::from_utf8(self.row.get(index).unwrap_or_default())
            .map_err(|_| self.fault(index, NOT_UTF_8.to_string()))
    }

    /// Creates an error in field `index` of this row.
    pub(super) fn fault(&self, index: usize, message: String) -> Fault {
        let RowText { start, text, separator, .. } = self.reader.get_ref();
        let begin = quotes::fields(text, *separator).0.get(index).copied().unwrap_or(0);
        Fault::at(start.after(&text[..begin]), message)
    }
}

/// Yields the text line by line, without comments and blank lines, and stores the text of the current row.
///
/// The CSV reader requests more only after it has used all it got, so nothing is read ahead of the row.
struct RowText<R> {
    lines: Lines<R>,
    start: Position,
    /// The first line, read ahead of the CSV reader.
    ahead: Cursor<Vec<u8>>,
    text: Vec<u8>,
    separator: u8,
    /// Number of separators in the header, once it has been read.
    separators: Option<usize>,
}

impl<R: Read> RowText<R> {
    /// Starts the first row and reads its first line.
    fn look_ahead(&mut self) -> io::Result<()> {
        self.begin_row()?;
        self.lines.read_until(b'\n', self.ahead.get_mut()).map(drop)
    }

    /// Skips comments and blank lines, and starts a row after them.
    fn begin_row(&mut self) -> io::Result<()> {
        loop {
            self.skip_blank_lines()?;
            self.start = self.lines.begin();
            if self.lines.fill_buf()?.first() != Some(&b'#') {
                return Ok(());
            }
            let mut separators = 0;
            loop {
                let mut part = [0; 512];
                let part = self.take_line(&mut part)?;
                separators += part.iter().filter(|&&byte| byte == self.separator).count();
                if part.last().is_none_or(|&byte| byte == b'\n') {
                    break;
                }
            }
            if self.separators == Some(separators) {
                let what = format!("begins with # like a comment, but has {} fields like a row", separators + 1);
                let advice = "quote the name if this is a row, or remove the line";
                return Err(Fault::at(self.start, format!("{what}; {advice}")).into());
            }
        }
    }

    fn skip_blank_lines(&mut self) -> io::Result<()> {
        self.lines.begin();
        loop {
            let blank = self.lines.fill_buf()?.iter().take_while(|&&byte| byte == b'\n').count();
            if blank == 0 {
                return Ok(());
            }
            self.lines.consume(blank);
        }
    }

    /// Returns as much of the line as fits into `out`, line end included.
    fn take_line<'a>(&mut self, out: &'a mut [u8]) -> io::Result<&'a [u8]> {
        let line = self.lines.fill_buf()?;
        let length = line.iter().position(|&byte| byte == b'\n').map_or(line.len(), |end| end + 1).min(out.len());
        let out = &mut out[..length];
        out.copy_from_slice(&line[..length]);
        self.lines.consume(length);
        Ok(out)
    }
}

impl<R: Read> Read for RowText<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut count = self.ahead.read(out)?;
        if count == 0 {
            if self.text.is_empty() {
                self.begin_row()?;
            }
            count = self.take_line(out)?.len();
        }
        self.text.extend_from_slice(&out[..count]);
        Ok(count)
    }
}
