//! Mutates valid inputs into nearly valid ones.

use std::ops::Range;

/// Source of the fuzzer's choices, one byte at a time; yields zeros after the last byte.
pub(crate) struct Choices<'a> {
    bytes: &'a [u8],
}

/// Maximum size of an input, bytes: enough to reach every part of a parser, and fast to try.
const MAX_BYTES: usize = 8 << 10;

/// Numbers that often break parsers.
const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e-320",
    "1e3",
    "1e9",
    "-1e9",
    "1e999",
    "-1e999",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "0x10",
    "1_000",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "2147483648",
    "1e",
    "",
];

/// Texts that often break parsers, terminals, web pages and file systems.
const TEXTS: [&str; 23] = [
    "\0",
    "\u{feff}",
    "\r",
    "\r\n",
    "\n",
    "\u{1b}[2J",
    "\u{1b}]0;x\u{7}",
    "\u{202e}",
    "\u{9b}",
    "\u{2028}",
    "../x",
    "/dev/zero",
    "<img src=x onerror=alert(1)>",
    "'",
    "\"",
    "\\",
    "\u{fffd}",
    "é",
    "\u{10ffff}",
    " ",
    "#",
    "&#0;",
    "%s%n",
];

impl<'a> Choices<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    fn byte(&mut self) -> usize {
        let Some((&first, rest)) = self.bytes.split_first() else { return 0 };
        self.bytes = rest;
        first.into()
    }

    /// Returns a number below `end`, or 0 if `end` is 0.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        let high = if end > 256 { self.byte() } else { 0 };
        (high << 8 | self.byte()) % end.max(1)
    }

    pub(crate) fn one_of<'b, T>(&mut self, all: &'b [T]) -> &'b T {
        &all[self.below(all.len())]
    }

    /// Returns a corpus file with up to four changes, usually one.
    pub(crate) fn mutated(&mut self, corpus: &[Vec<u8>], tokens: &[&str]) -> Vec<u8> {
        let mut input = self.one_of(corpus).clone();
        for _ in 0..*self.one_of(&[0, 1, 1, 1, 1, 2, 3, 4]) {
            self.change(&mut input, corpus, tokens);
            input.truncate(MAX_BYTES);
        }
        input
    }

    /// Returns the bytes with up to three changes, cuts included; for binary formats.
    pub(crate) fn damaged(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        for _ in 0..*self.one_of(&[0, 1, 1, 1, 2, 3]) {
            if bytes.is_empty() {
                break;
            }
            let at = self.below(bytes.len());
            match self.below(8) {
                0 => bytes.truncate(at),
                1 | 2 => bytes[at] = self.byte() as u8,
                3 => bytes[at] = *self.one_of(&[0, 1, 0x7f, 0x80, 0xff]),
                4 => drop(bytes.drain(at..(at + 1 + self.below(8)).min(bytes.len()))),
                5 => bytes.insert(at, self.byte() as u8),
                _ => bytes[at] ^= 1 << self.below(8),
            }
        }
        bytes
    }

    fn change(&mut self, input: &mut Vec<u8>, corpus: &[Vec<u8>], tokens: &[&str]) {
        let at = self.below(input.len() + 1);
        match self.below(12) {
            // Replace a number by another one.
            0..=3 => {
                let number = |byte: u8| byte.is_ascii_digit() || b"+-.".contains(&byte);
                let span = span(input, at, number);
                input.splice(span, self.one_of(&NUMBERS).bytes());
            }
            // Replace a word by a token of the format.
            4 | 5 => {
                let word = span(input, at, |byte| byte.is_ascii_alphanumeric() || byte == b'_');
                input.splice(word, self.one_of(tokens).bytes());
            }
            6 => drop(input.splice(at..at, self.one_of(tokens).bytes())),
            7 => drop(input.splice(at..at, self.one_of(&TEXTS).bytes())),
            // Duplicate a line, move a copy elsewhere, or (below) remove it.
            8 => {
                let line = span(input, at, |byte| byte != b'\n');
                let text = input[line.clone()].to_vec();
                let to = if self.below(2) == 0 { line.end } else { self.below(input.len() + 1) };
                input.splice(to..to, [&b"\n"[..], &text].concat());
            }
            9 => drop(input.drain(span(input, at, |byte| byte != b'\n'))),
            // Continue with the rest of another file.
            10 => {
                let other = self.one_of(corpus);
                input.truncate(at);
                input.extend(&other[at.min(other.len())..]);
            }
            _ => *input = self.damaged(std::mem::take(input)),
        }
    }
}

/// Returns the first run of matching bytes at or after `at`; if there is none, the first in the whole input.
fn span(input: &[u8], at: usize, of: impl Fn(u8) -> bool) -> Range<usize> {
    let from = |start: usize| input[start..].iter().position(|&byte| of(byte)).map(|found| start + found);
    let Some(start) = from(at).or_else(|| from(0)) else { return at..at };
    let begin = input[..start].iter().rposition(|&byte| !of(byte)).map_or(0, |before| before + 1);
    let end = input[start..].iter().position(|&byte| !of(byte)).map_or(input.len(), |length| start + length);
    begin..end
}
