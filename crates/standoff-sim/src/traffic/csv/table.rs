//! Reads the rows of a CSV table, and knows the place of each field.

use std::io::{self, BufRead, Read};

use csv::{ByteRecord, ReaderBuilder};

use super::super::lines::{Fault, Lines, Position, input_fault};

/// The rows, with the place of each field.
pub(super) struct Table<R> {
    reader: csv::Reader<RowText<R>>,
    /// The current row.
    pub(super) row: ByteRecord,
}

impl<R: Read> Table<R> {
    pub(super) fn new(lines: Lines<R>) -> Self {
        let start = lines.position();
        let text = RowText { lines, start, text: Vec::new() };
        Self {
            reader: ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text),
            row: ByteRecord::new(),
        }
    }

    /// Goes to the next row; `false` at the end.
    pub(super) fn next_row(&mut self) -> Result<bool, Fault> {
        self.reader.get_mut().text.clear();
        self.reader.read_byte_record(&mut self.row).map_err(|error| {
            let position = self.reader.get_ref().lines.position();
            match error.into_kind() {
                csv::ErrorKind::Io(error) => input_fault(Some(position), &error),
                other => Fault::at(position, format!("not CSV: {other:?}")),
            }
        })
    }

    /// Field `index` of this row.
    pub(super) fn text(&self, index: usize) -> Result<&str, Fault> {
        std::str::from_utf8(self.row.get(index).unwrap_or_default())
            .map_err(|_| self.fault(index, "not text; must be UTF-8; save the file as UTF-8".to_string()))
    }

    /// A fault in field `index` of this row.
    pub(super) fn fault(&self, index: usize, message: String) -> Fault {
        let RowText { start, text, .. } = self.reader.get_ref();
        let mut in_quotes = false;
        let commas = text.iter().enumerate().filter(|&(_, &byte)| {
            in_quotes ^= byte == b'"';
            byte == b',' && !in_quotes
        });
        let begin = index.checked_sub(1).and_then(|comma| commas.map(|(at, _)| at + 1).nth(comma)).unwrap_or(0);
        Fault::at(start.after(&text[..begin]), message)
    }
}

/// Gives the text line by line, without comments and blank lines, and keeps that of the current row.
///
/// The CSV reader asks for more only when it has used up what it got, so nothing is read ahead of the row.
struct RowText<R> {
    lines: Lines<R>,
    start: Position,
    text: Vec<u8>,
}

impl<R: Read> RowText<R> {
    /// Skips comments and blank lines, and begins a row behind them.
    fn begin_row(&mut self) -> io::Result<()> {
        loop {
            self.start = self.lines.begin();
            match self.lines.fill_buf()?.first() {
                Some(b'#') => while self.take_line(&mut [0; 512])?.last().is_some_and(|&byte| byte != b'\n') {},
                Some(b'\n' | b'\r') => self.lines.consume(1),
                _ => return Ok(()),
            }
        }
    }

    /// As much of the line as `out` holds, with its end.
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
        if self.text.is_empty() {
            self.begin_row()?;
        }
        let line = self.take_line(out)?;
        self.text.extend_from_slice(line);
        Ok(line.len())
    }
}
