//! Plausibility checks of Parquet metadata. The Parquet reader allocates memory according to the metadata, so a few
//! forged bytes could exhaust all memory. Therefore the numbers are checked first.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use parquet::basic::Compression;
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData, RowGroupMetaData};

use crate::thrift::Thrift;

/// Maximum size of a footer (schema, row groups), bytes. The widest table of a record has 5 MB at the maximum row
/// count.
const MAX_FOOTER: u64 = 8 << 20;
/// Maximum number of columns and groups of columns. The widest table of a record has 34.
const MAX_COLUMNS: usize = 1000;
/// Maximum nesting depth of columns. Tables of a record are not nested.
const MAX_NESTED: usize = 16;
/// Maximum number of columns of all row groups together; the reader stores about 700 bytes for each. The widest table
/// of a record has 52,000 at the maximum row count.
const MAX_CHUNKS: usize = 60_000;
/// Maximum number of rows of a table: 1,000 targets once per second for a day.
pub const MAX_ROWS: u64 = 100_000_000;
/// Maximum size of a page header, bytes.
const MAX_PAGE_HEADER: u64 = 16 << 10;
/// Usual size of a page header without statistics, with some reserve, bytes.
const USUAL_PAGE_HEADER: u64 = 128;
/// Maximum size of an uncompressed page, bytes. Programs usually write pages of about 1 MiB.
const MAX_PAGE: i64 = 16 << 20;
/// Maximum compression ratio, with some reserve. The supported compression reaches 21.
const MAX_RATIO: i64 = 32;
/// Maximum number of values of a dictionary. A dictionary covers a few row groups at most.
const MAX_DICTIONARY: i64 = 1 << 20;
/// Maximum length of the text in a cell, bytes. Names of vehicles have up to 200 characters of 4 bytes.
pub const MAX_CELL: usize = 1 << 10;

/// Supported encodings of values, by their Parquet numbers: plain, dictionary (two variants), run-length, byte stream
/// split. Other encodings are not needed, and define themselves how much memory they need.
const ENCODINGS: [i64; 5] = [0, 2, 3, 8, 9];

/// Rejects a file whose footer is not plausible.
pub(crate) fn check_end(file: &mut File) -> io::Result<()> {
    let footer = footer(file)?.ok_or_else(|| io::Error::other("it does not end as a Parquet file"))?;
    check_footer(&footer).map_err(io::Error::other)
}

/// Rejects a file whose row count is not the sum of those of its row groups.
pub(crate) fn check_rows(metadata: &ParquetMetaData) -> Result<(), String> {
    let total = metadata.file_metadata().num_rows();
    let mut groups = metadata.row_groups().iter().map(RowGroupMetaData::num_rows);
    let rows = groups.try_fold(0_i64, |sum, rows| sum.checked_add(rows).filter(|_| rows >= 0));
    match rows {
        Some(rows) if rows == total => Ok(()),
        _ => Err(format!("its row count is {total}, but its row groups have a different number of rows")),
    }
}

/// Rejects columns with compressions and encodings that are not supported, and names them. Such a file may be valid.
pub(crate) fn check_format(metadata: &ParquetMetaData, columns: &[usize]) -> Result<(), String> {
    for group in metadata.row_groups() {
        for chunk in columns.iter().filter_map(|&column| group.columns().get(column)) {
            let name = || chunk.column_path().string();
            if !matches!(chunk.compression(), Compression::UNCOMPRESSED | Compression::SNAPPY) {
                // Of `ZSTD(ZstdLevel(1))` only the codec is used: the level is not stored in the file.
                let codec = format!("{:?}", chunk.compression());
                let codec = codec.split('(').next().unwrap_or_default();
                return Err(format!("its column {} is compressed by {codec}", name()));
            }
            if let Some(encoding) = chunk.encodings().find(|encoding| !is_supported(*encoding as i64)) {
                return Err(format!("its column {} has the encoding {encoding}", name()));
            }
        }
    }
    Ok(())
}

/// Returns true if an encoding is supported for values, or is the deprecated encoding of levels (4).
fn is_supported(encoding: i64) -> bool {
    ENCODINGS.contains(&encoding) || encoding == 4
}

/// Rejects a footer that is not plausible.
pub(crate) fn check_footer(footer: &[u8]) -> Result<(), String> {
    let mut fault = None;
    let walked = Thrift::new(footer).structure(|thrift, id, value| {
        match id {
            2 => {
                let columns = thrift.structures(value)?;
                if columns > MAX_COLUMNS || !is_flat(thrift, columns)? {
                    fault = Some(format!("it has more than {MAX_COLUMNS} columns, or its columns are nested"));
                }
            }
            3 => {
                let rows = thrift.int(value)?;
                if !u64::try_from(rows).is_ok_and(|rows| rows <= MAX_ROWS) {
                    fault = Some(format!("its row count is {rows}; at most {MAX_ROWS} are allowed"));
                }
            }
            4 => {
                let groups = thrift.structures(value)?;
                if chunks(thrift, groups)? > MAX_CHUNKS {
                    fault = Some(format!("its {groups} row groups have more than {MAX_CHUNKS} columns in total"));
                }
            }
            _ => thrift.skip(value)?,
        }
        fault.is_none().then_some(())
    });
    match fault {
        Some(fault) => Err(fault),
        None => walked.ok_or_else(|| "its footer cannot be read".to_owned()),
    }
}

/// Reads the footer at the end of a file; `None` if the file does not end like a Parquet file.
fn footer(file: &mut File) -> io::Result<Option<Vec<u8>>> {
    const TAIL: u64 = 8;
    let length = file.seek(SeekFrom::End(0))?;
    let Some(start) = length.checked_sub(TAIL) else { return Ok(None) };
    let mut tail = [0; TAIL as usize];
    file.seek(SeekFrom::Start(start))?;
    file.read_exact(&mut tail)?;
    let [a, b, c, d, b'P', b'A', b'R', b'1'] = tail else { return Ok(None) };
    let bytes = u64::from(u32::from_le_bytes([a, b, c, d]));
    let Some(start) = start.checked_sub(bytes) else { return Ok(None) };
    if bytes > MAX_FOOTER {
        let what = format!("its footer has {bytes} bytes; at most {MAX_FOOTER} are allowed");
        return Err(io::Error::other(what));
    }
    file.seek(SeekFrom::Start(start))?;
    let mut footer = vec![0; bytes as usize];
    file.read_exact(&mut footer)?;
    Ok(Some(footer))
}

/// Reads the elements of a schema, parents before their children. Returns true if they are not nested too deeply and
/// match the child counts of their parents.
fn is_flat(thrift: &mut Thrift<'_>, elements: usize) -> Option<bool> {
    // Number of outstanding children of every open element.
    let mut open: Vec<usize> = Vec::new();
    for index in 0..elements {
        let mut children = 0;
        thrift.structure(|thrift, id, value| {
            if id == 5 {
                children = usize::try_from(thrift.int(value)?).ok()?;
                Some(())
            } else {
                thrift.skip(value)
            }
        })?;
        if index > 0 {
            while open.last() == Some(&0) {
                open.pop();
            }
            *open.last_mut()? -= 1;
        }
        open.push(children);
        if children > elements || open.len() > MAX_NESTED {
            return Some(false);
        }
    }
    Some(open.iter().all(|&children| children == 0))
}

/// Reads row groups and returns their total number of columns.
fn chunks(thrift: &mut Thrift<'_>, groups: usize) -> Option<usize> {
    let mut chunks = 0;
    for _ in 0..groups {
        thrift.structure(|thrift, id, value| {
            if id == 1 {
                let columns = thrift.structures(value)?;
                chunks += columns;
                (0..columns).try_for_each(|_| thrift.structure(|thrift, _, value| thrift.skip(value)))
            } else {
                thrift.skip(value)
            }
        })?;
    }
    Some(chunks)
}

/// Rejects a column of a row group whose pages are not plausible.
pub(crate) fn check_pages(file: &mut File, chunk: &ColumnChunkMetaData) -> io::Result<()> {
    let start = chunk.dictionary_page_offset().unwrap_or_else(|| chunk.data_page_offset());
    let bounds = (u64::try_from(start).ok(), u64::try_from(chunk.compressed_size()).ok());
    let (Some(mut at), Some(mut left)) = bounds else {
        return Err(io::Error::other("a column is outside the file"));
    };
    while left > 0 {
        let page = page(file, at, left)?;
        let page = page.ok_or_else(|| io::Error::other("a page header cannot be read"))?;
        let length = page.header + page.check().map_err(io::Error::other)?;
        if length > left {
            return Err(io::Error::other("a page is longer than its column"));
        }
        (at, left) = (at.saturating_add(length), left - length);
    }
    Ok(())
}

/// Reads the page header at an offset, in at most `max_bytes` bytes; `None` if it cannot be parsed.
fn page(file: &mut File, at: u64, max_bytes: u64) -> io::Result<Option<Page>> {
    for length in [USUAL_PAGE_HEADER, MAX_PAGE_HEADER] {
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(at))?;
        file.take(length.min(max_bytes)).read_to_end(&mut bytes)?;
        if let Some(page) = Page::read(&bytes) {
            return Ok(Some(page));
        }
    }
    Ok(None)
}

/// A page header.
#[derive(Default)]
struct Page {
    /// Length of the header, bytes.
    header: u64,
    kind: i64,
    unpacked: i64,
    packed: i64,
    values: i64,
    encoding: i64,
    /// Type-specific headers that are present: fields 5 to 8.
    described: Vec<i16>,
}

/// Page types (data, dictionary, data of format version 2): the type number and the field of its type-specific header.
const DATA: (i64, i16) = (0, 5);
const DICTIONARY: (i64, i16) = (2, 7);
const DATA_2: (i64, i16) = (3, 8);

impl Page {
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut page = Self::default();
        let mut thrift = Thrift::new(bytes);
        thrift.structure(|thrift, id, value| match id {
            1 => thrift.int(value).map(|kind| page.kind = kind),
            2 => thrift.int(value).map(|unpacked| page.unpacked = unpacked),
            3 => thrift.int(value).map(|packed| page.packed = packed),
            5..=8 => {
                page.described.push(id);
                let encoding = if id == 8 { 4 } else { 2 };
                thrift.structure(|thrift, id, value| match id {
                    1 => thrift.int(value).map(|values| page.values = values),
                    id if id == encoding => thrift.int(value).map(|encoding| page.encoding = encoding),
                    _ => thrift.skip(value),
                })
            }
            _ => thrift.skip(value),
        })?;
        page.header = (bytes.len() - thrift.left()) as u64;
        Some(page)
    }

    /// Returns the length of the page after its header, bytes, if the header is plausible.
    fn check(&self) -> Result<u64, String> {
        let &Self { unpacked, packed, values, encoding, .. } = self;
        let is = |(kind, field)| self.kind == kind && self.described == [field];
        let is_dictionary = is(DICTIONARY);
        if !(is(DATA) || is(DATA_2) || is_dictionary) {
            return Err("a page is neither data nor a dictionary, or is described as both".to_owned());
        }
        let max = MAX_PAGE.min(packed.saturating_mul(MAX_RATIO).saturating_add(1 << 10));
        if !(0..=max).contains(&unpacked) {
            return Err(format!("a page of {packed} bytes claims to unpack to {unpacked}; at most {max} are allowed"));
        }
        if !ENCODINGS.contains(&encoding) {
            return Err(format!("a page has encoding {encoding}; write the table with plain or dictionary encoding"));
        }
        let max_unpacked = values.saturating_mul(MAX_CELL as i64 + 16).saturating_add(64 << 10);
        // Empty pages are rejected because there could be very many.
        let min_values = if is_dictionary { 0 } else { 1 };
        if values < min_values || unpacked > max_unpacked {
            return Err(format!("a page of {unpacked} bytes has an implausible value count of {values}"));
        }
        if is_dictionary && values > MAX_DICTIONARY.min(unpacked) {
            return Err(format!("a dictionary of {unpacked} bytes has an implausible value count of {values}"));
        }
        u64::try_from(packed).map_err(|_| format!("a page has an invalid size of {packed} bytes"))
    }
}

#[cfg(test)]
mod tests {
    use parquet::errors::ParquetError;

    use super::*;
    use crate::Error;

    fn of_kind((kind, field): (i64, i16)) -> Page {
        Page { header: 20, kind, unpacked: 800, packed: 100, values: 100, encoding: 0, described: vec![field] }
    }

    #[test]
    fn a_page_has_exactly_one_matching_type_header() {
        for kind in [DATA, DICTIONARY, DATA_2] {
            assert_eq!(of_kind(kind).check(), Ok(100));
        }
        for described in [vec![], vec![7, 8], vec![5, 5], vec![6], vec![8]] {
            for kind in [DATA, DICTIONARY] {
                let page = Page { described: described.clone(), ..of_kind(kind) };
                let expected = "a page is neither data nor a dictionary, or is described as both";
                assert_eq!(page.check(), Err(expected.to_owned()));
            }
        }
        // {1: 2, 2: 4, 3: 4, 7: {1: 2^31 - 1, 2: 0}, 8: {1: 1}}: the value count of field 8 would hide that of the
        // dictionary.
        let bytes = b"\x15\x04\x15\x08\x15\x08\x4c\x15\xfe\xff\xff\xff\x0f\x15\x00\x00\x1c\x15\x02\x00\x00";
        assert!(Page::read(bytes).unwrap().check().is_err());
    }

    #[test]
    fn a_page_that_would_need_too_much_memory_is_rejected() {
        let sound = || of_kind(DATA);
        for (page, expected) in [
            (Page { unpacked: i64::from(i32::MAX), ..sound() }, "a page of 100 bytes claims to unpack to 2147483647"),
            (Page { packed: 1 << 30, unpacked: 1 << 30, ..sound() }, "at most 16777216"),
            (Page { packed: -1, ..sound() }, "a page has an invalid size of -1 bytes"),
            (Page { encoding: 7, ..sound() }, "a page has encoding 7; write the table with plain"),
            (Page { values: -1, ..sound() }, "an implausible value count of -1"),
            (
                Page { packed: 1 << 20, unpacked: 1 << 20, values: 1, ..sound() },
                "a page of 1048576 bytes has an implausible value count of 1",
            ),
            (Page { values: 0, ..sound() }, "an implausible value count of 0"),
            (
                Page { values: 801, ..of_kind(DICTIONARY) },
                "a dictionary of 800 bytes has an implausible value count of 801",
            ),
        ] {
            let message = page.check().unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn too_many_columns_of_row_groups_are_rejected() {
        // {4: [{1: [{}, ...]}, ...]} with 200 columns in each of up to 9,999 groups.
        let footer = |groups: u16| {
            let varint = |n: u16| [n as u8 | 0x80, (n >> 7) as u8];
            let group = [&[0x19, 0xfc][..], &varint(200), &[0; 200], &[0]].concat();
            [&[0x49, 0xfc][..], &varint(groups), &group.repeat(groups.into()), &[0]].concat()
        };
        assert_eq!(check_footer(&footer(300)), Ok(()));
        let expected = "its 301 row groups have more than 60000 columns in total".to_owned();
        assert_eq!(check_footer(&footer(301)), Err(expected));
    }

    /// A schema of nested groups: `{4: name, 5: children}`.
    fn nested(depth: usize) -> Vec<u8> {
        let mut schema = [0x48, 0x01, b'g', 0x15, 0x02, 0x00].repeat(depth);
        schema.extend([0x48, 0x01, b'c', 0x00]);
        schema
    }

    #[test]
    fn deep_nesting_and_wrong_child_counts_are_detected() {
        let is_flat = |schema: &[u8], elements| is_flat(&mut Thrift::new(schema), elements);
        assert_eq!(is_flat(&nested(3), 4), Some(true));
        assert_eq!(is_flat(&nested(500), 501), Some(false));
        assert_eq!(is_flat(&nested(3), 3), Some(false), "the last element is missing");
        assert_eq!(is_flat(&[0x48, 0x01, b'g', 0x15, 0xfe, 0xff, 0xff, 0xff, 0x0f, 0x00], 1), Some(false));
        assert_eq!(is_flat(&nested(3)[..9], 4), None);
    }

    /// A folder can be opened like a file, but reading it fails.
    #[test]
    #[cfg(target_os = "linux")]
    fn an_io_error_is_not_reported_as_damage() {
        let home = tempfile::tempdir().unwrap();
        let folder = || File::open(home.path()).unwrap();
        let error = page(&mut folder(), 0, 100).map(drop).unwrap_err();
        for error in [ParquetError::from(error).into(), check_end(&mut folder()).unwrap_err().into()] {
            assert!(matches!(&error, Error::System(reason) if reason.raw_os_error() == Some(21)), "{error}");
        }
    }

    #[test]
    fn a_file_without_a_valid_footer_is_rejected() {
        let error = |bytes: &[u8]| {
            let mut file = tempfile::tempfile().unwrap();
            std::io::Write::write_all(&mut file, bytes).unwrap();
            check_end(&mut file).unwrap_err().to_string()
        };
        for bytes in [&b""[..], b"PAR1", b"xxxx\xff\xff\xff\xffPAR1", b"\x00\x00\x00\x00PARE"] {
            assert_eq!(error(bytes), "it does not end as a Parquet file");
        }
        assert_eq!(error(b"\x1c\x01\x00\x00\x00PAR1"), "its footer cannot be read");
        // {3: rows}
        assert_eq!(
            error(b"6\xfe\xff\xff\xff\xff\xff\xff\xff\xff\x01\x00\x0c\x00\x00\x00PAR1"),
            "its row count is 9223372036854775807; at most 100000000 are allowed"
        );
    }
}
