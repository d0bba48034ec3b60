//! Minimal parser of Thrift's compact protocol, the format of Parquet metadata. It reads just enough to check that
//! numbers are plausible before the Parquet reader uses them.

/// Maximum nesting depth of metadata; Parquet's own metadata has a depth of five.
const MAX_DEPTH: usize = 32;

/// Type codes of values.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const SHORT: u8 = 4;
const INT: u8 = 5;
const LONG: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const STRUCT: u8 = 12;

/// A parser over the metadata. All methods return `None` if the metadata is truncated or invalid.
#[derive(Clone, Copy)]
pub(crate) struct Thrift<'a> {
    rest: &'a [u8],
    depth: usize,
}

/// Type code of a field whose value is not read yet.
pub(crate) type Kind = u8;

impl<'a> Thrift<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, depth: 0 }
    }

    /// Number of remaining bytes.
    pub(crate) fn left(&self) -> usize {
        self.rest.len()
    }

    /// Reads a structure. `take` is called for every field with its id and type, and must read or `skip` its value.
    pub(crate) fn structure(&mut self, mut take: impl FnMut(&mut Self, i16, Kind) -> Option<()>) -> Option<()> {
        if self.depth == MAX_DEPTH {
            return None;
        }
        self.depth += 1;
        let mut id: i16 = 0;
        loop {
            let byte = self.byte()?;
            let kind = byte & 0x0f;
            if kind == 0 {
                self.depth -= 1;
                return Some(());
            }
            id = match byte >> 4 {
                0 => i16::try_from(self.signed()?).ok()?,
                step => id.checked_add(i16::from(step))?,
            };
            take(self, id, kind)?;
        }
    }

    /// Reads an integer.
    pub(crate) fn int(&mut self, kind: Kind) -> Option<i64> {
        matches!(kind, SHORT | INT | LONG).then(|| self.signed()).flatten()
    }

    /// Reads the length of a list of structures. The structures follow.
    pub(crate) fn structures(&mut self, kind: Kind) -> Option<usize> {
        let (kind, length) = (kind == LIST).then(|| self.list()).flatten()?;
        (length == 0 || kind == STRUCT).then_some(length)
    }

    /// Skips a value.
    pub(crate) fn skip(&mut self, kind: Kind) -> Option<()> {
        match kind {
            TRUE | FALSE => Some(()),
            BYTE => self.byte().map(drop),
            SHORT | INT | LONG => self.varint().map(drop),
            DOUBLE => self.bytes(8).map(drop),
            BINARY => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.bytes(length).map(drop)
            }
            STRUCT => self.structure(|thrift, _, kind| thrift.skip(kind)),
            LIST | SET => {
                if self.depth == MAX_DEPTH {
                    return None;
                }
                self.depth += 1;
                let (kind, length) = self.list()?;
                for _ in 0..length {
                    // In a list, each boolean has a byte.
                    self.skip(if kind == TRUE || kind == FALSE { BYTE } else { kind })?;
                }
                self.depth -= 1;
                Some(())
            }
            _ => None,
        }
    }

    /// Reads the type and number of a list's elements. Each element takes at least one byte, which limits the number.
    fn list(&mut self) -> Option<(u8, usize)> {
        let byte = self.byte()?;
        let length = match byte >> 4 {
            15 => usize::try_from(self.varint()?).ok()?,
            short => usize::from(short),
        };
        (length <= self.rest.len()).then_some((byte & 0x0f, length))
    }

    fn byte(&mut self) -> Option<u8> {
        self.bytes(1)?.first().copied()
    }

    fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(bytes)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    }

    fn signed(&mut self) -> Option<i64> {
        let number = self.varint()?;
        Some((number >> 1) as i64 ^ -((number & 1) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `{1: -3, 2: "ab", 5: [{1: 7}, {}]}`
    const BYTES: [u8; 13] = [0x15, 0x05, 0x18, 0x02, b'a', b'b', 0x39, 0x2c, 0x15, 0x0e, 0x00, 0x00, 0x00];

    fn numbers(bytes: &[u8]) -> Option<Vec<i64>> {
        let mut numbers = Vec::new();
        Thrift::new(bytes).structure(|thrift, id, value| {
            match id {
                1 => numbers.push(thrift.int(value)?),
                5 => {
                    for _ in 0..thrift.structures(value)? {
                        thrift.structure(|thrift, _, value| {
                            numbers.push(thrift.int(value)?);
                            Some(())
                        })?;
                    }
                }
                _ => thrift.skip(value)?,
            }
            Some(())
        })?;
        Some(numbers)
    }

    #[test]
    fn fields_are_read_by_id_and_others_are_skipped() {
        assert_eq!(numbers(&BYTES), Some(vec![-3, 7]));
        let mut rest = Thrift::new(&BYTES);
        assert_eq!(rest.skip(STRUCT), Some(()));
        assert_eq!(rest.left(), 0);
    }

    #[test]
    fn truncated_metadata_is_rejected() {
        for length in 0..BYTES.len() {
            assert_eq!(numbers(&BYTES[..length]), None, "{length}");
        }
    }

    #[test]
    fn deep_nesting_and_excessive_lengths_are_rejected() {
        assert_eq!(Thrift::new(&[0x1c; 100_000]).skip(STRUCT), None);
        assert_eq!(Thrift::new(&[0x19; 100_000]).skip(LIST), None);
        assert_eq!(Thrift::new(&[0xf5, 0xff, 0xff, 0xff, 0x7f]).skip(LIST), None);
    }
}
