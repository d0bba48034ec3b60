//! What a Parquet file may say of itself: the Parquet reader makes room for what it is told, and would take all memory
//! for a few bytes that lie. So the numbers are looked at first.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use parquet::basic::Compression;
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData, RowGroupMetaData};

use crate::thrift::Thrift;

/// Largest description of a file (schema, row groups), bytes: the widest table has 5 MB at the most rows.
const MAX_FOOTER: u64 = 8 << 20;
/// Most columns and groups of columns; the widest table has 34.
const MAX_COLUMNS: usize = 1000;
/// Deepest nesting of columns: the record's own have none.
const MAX_NESTED: usize = 16;
/// Most columns of all row groups together: the reader keeps some 700 bytes of each. The widest table has 52,000 at the
/// most rows.
const MAX_CHUNKS: usize = 60_000;
/// Most rows of a table: a day of 1,000 targets every second.
pub const MAX_ROWS: u64 = 100_000_000;
/// Largest description of a page, bytes.
const MAX_PAGE_HEADER: u64 = 16 << 10;
/// As large as it is without statistics, with some room.
const USUAL_PAGE_HEADER: u64 = 128;
/// Largest page, unpacked, bytes: programs make them of about 1 MiB.
const MAX_PAGE: i64 = 16 << 20;
/// The most that the packing in use can unpack to, in times of its size, with some room: it has 21.
const MAX_RATIO: i64 = 32;
/// Most values of a dictionary: they are that of a few row groups at most.
const MAX_DICTIONARY: i64 = 1 << 20;
/// Longest text of a cell, bytes: a vehicle's name has up to 200 characters, of 4 bytes.
pub const MAX_CELL: usize = 1 << 10;

/// The encodings of values that are read, by their numbers: plain, dictionary (twice), runs, split streams. The others
/// are of no use here, and say themselves how much room they need.
const ENCODINGS: [i64; 5] = [0, 2, 3, 8, 9];

/// Refuses a file whose description is not plausible.
pub(crate) fn check_end(file: &mut File) -> io::Result<()> {
    let footer = footer(file)?.ok_or_else(|| io::Error::other("it does not end as a Parquet file"))?;
    check_footer(&footer).map_err(io::Error::other)
}

/// Refuses row groups that are not as many rows as the file says.
pub(crate) fn check_rows(metadata: &ParquetMetaData) -> Result<(), String> {
    let told = metadata.file_metadata().num_rows();
    let mut groups = metadata.row_groups().iter().map(RowGroupMetaData::num_rows);
    let rows = groups.try_fold(0_i64, |sum, rows| sum.checked_add(rows).filter(|_| rows >= 0));
    match rows {
        Some(rows) if rows == told => Ok(()),
        _ => Err(format!("it says that it has {told} rows, and something else of its parts")),
    }
}

/// Refuses columns in compressions and encodings that are not read here, and tells which: the file may be as good as any.
pub(crate) fn check_format(metadata: &ParquetMetaData, columns: &[usize]) -> Result<(), String> {
    for group in metadata.row_groups() {
        for chunk in columns.iter().filter_map(|&column| group.columns().get(column)) {
            let name = || chunk.column_path().string();
            if !matches!(chunk.compression(), Compression::UNCOMPRESSED | Compression::SNAPPY) {
                // `ZSTD(ZstdLevel(1))`: the level is not in the file.
                let codec = format!("{:?}", chunk.compression());
                let codec = codec.split('(').next().unwrap_or_default();
                return Err(format!("its column {} is compressed by {codec}", name()));
            }
            if let Some(encoding) = chunk.encodings().find(|encoding| !is_read(*encoding as i64)) {
                return Err(format!("its column {} has the encoding {encoding}", name()));
            }
        }
    }
    Ok(())
}

/// Values in this encoding are read. Levels have one of their own, which has come out of use.
fn is_read(encoding: i64) -> bool {
    ENCODINGS.contains(&encoding) || encoding == 4
}

/// Refuses a description that is not plausible.
pub(crate) fn check_footer(footer: &[u8]) -> Result<(), String> {
    let mut fault = None;
    let walked = Thrift::new(footer).structure(|thrift, id, value| {
        match id {
            2 => {
                let columns = thrift.structures(value)?;
                if columns > MAX_COLUMNS || !is_flat(thrift, columns)? {
                    fault = Some(format!("it has more than {MAX_COLUMNS} columns, or they are nested"));
                }
            }
            3 => {
                let rows = thrift.int(value)?;
                if !u64::try_from(rows).is_ok_and(|rows| rows <= MAX_ROWS) {
                    fault = Some(format!("it says that it has {rows} rows; at most {MAX_ROWS}"));
                }
            }
            4 => {
                let groups = thrift.structures(value)?;
                if chunks(thrift, groups)? > MAX_CHUNKS {
                    fault = Some(format!("its {groups} row groups have more than {MAX_CHUNKS} columns in all"));
                }
            }
            _ => thrift.skip(value)?,
        }
        fault.is_none().then_some(())
    });
    match fault {
        Some(fault) => Err(fault),
        None => walked.ok_or_else(|| "what it says of itself cannot be read".to_owned()),
    }
}

/// The description at the end of a file, if there is one.
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
        let what = format!("what it says of itself has {bytes} bytes; at most {MAX_FOOTER}");
        return Err(io::Error::other(what));
    }
    file.seek(SeekFrom::Start(start))?;
    let mut footer = vec![0; bytes as usize];
    file.read_exact(&mut footer)?;
    Ok(Some(footer))
}

/// Reads the elements of a schema, parents before their children; tells whether they are not nested too deeply, and as
/// many as their parents say.
fn is_flat(thrift: &mut Thrift<'_>, elements: usize) -> Option<bool> {
    // How many children are to come, of every element that is open.
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

/// Reads row groups, and tells how many columns they have together.
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

/// Refuses a column of a row group whose pages are not plausible.
pub(crate) fn check_pages(file: &mut File, chunk: &ColumnChunkMetaData) -> io::Result<()> {
    let start = chunk.dictionary_page_offset().unwrap_or_else(|| chunk.data_page_offset());
    let bounds = (u64::try_from(start).ok(), u64::try_from(chunk.compressed_size()).ok());
    let (Some(mut at), Some(mut left)) = bounds else {
        return Err(io::Error::other("a column lies outside of the file"));
    };
    while left > 0 {
        let page = page(file, at, left)?;
        let page = page.ok_or_else(|| io::Error::other("what a page says of itself cannot be read"))?;
        let length = page.header + page.check().map_err(io::Error::other)?;
        if length > left {
            return Err(io::Error::other("a page is longer than its column"));
        }
        (at, left) = (at.saturating_add(length), left - length);
    }
    Ok(())
}

/// What the page at a place says of itself, in at most `most` bytes; `None` if it cannot be read.
fn page(file: &mut File, at: u64, most: u64) -> io::Result<Option<Page>> {
    for length in [USUAL_PAGE_HEADER, MAX_PAGE_HEADER] {
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(at))?;
        file.take(length.min(most)).read_to_end(&mut bytes)?;
        if let Some(page) = Page::read(&bytes) {
            return Ok(Some(page));
        }
    }
    Ok(None)
}

/// What a page says of itself.
#[derive(Default)]
struct Page {
    /// Length of the description, bytes.
    header: u64,
    kind: i64,
    unpacked: i64,
    packed: i64,
    values: i64,
    encoding: i64,
    /// Which descriptions by kind of page there are: fields 5 to 8.
    described: Vec<i16>,
}

/// Data, a dictionary, and data in version 2 of the format: the kind of a page, and the field that describes it.
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

    /// The length of what follows its description, if all that it says is plausible.
    fn check(&self) -> Result<u64, String> {
        let &Self { unpacked, packed, values, encoding, .. } = self;
        let is = |(kind, field)| self.kind == kind && self.described == [field];
        let is_dictionary = is(DICTIONARY);
        if !(is(DATA) || is(DATA_2) || is_dictionary) {
            return Err("a page is neither data nor a dictionary, or says both".to_owned());
        }
        let most = MAX_PAGE.min(packed.saturating_mul(MAX_RATIO).saturating_add(1 << 10));
        if !(0..=most).contains(&unpacked) {
            return Err(format!("a page says that {packed} bytes of it unpack to {unpacked}; at most {most}"));
        }
        if !ENCODINGS.contains(&encoding) {
            return Err(format!("a page has encoding {encoding}; write the table with plain or dictionary encoding"));
        }
        let room = values.saturating_mul(MAX_CELL as i64 + 16).saturating_add(64 << 10);
        // Pages of nothing could be very many.
        let least = if is_dictionary { 0 } else { 1 };
        if values < least || unpacked > room {
            return Err(format!("a page of {unpacked} bytes says that it holds {values} values"));
        }
        if is_dictionary && values > MAX_DICTIONARY.min(unpacked) {
            return Err(format!("a dictionary of {unpacked} bytes says that it holds {values} values"));
        }
        u64::try_from(packed).map_err(|_| format!("a page says that it has {packed} bytes"))
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
    fn a_page_is_described_once_as_what_it_is() {
        for kind in [DATA, DICTIONARY, DATA_2] {
            assert_eq!(of_kind(kind).check(), Ok(100));
        }
        for described in [vec![], vec![7, 8], vec![5, 5], vec![6], vec![8]] {
            for kind in [DATA, DICTIONARY] {
                let page = Page { described: described.clone(), ..of_kind(kind) };
                assert_eq!(page.check(), Err("a page is neither data nor a dictionary, or says both".to_owned()));
            }
        }
        // {1: 2, 2: 4, 3: 4, 7: {1: 2^31 - 1, 2: 0}, 8: {1: 1}}: the last one tells less than the dictionary takes.
        let bytes = b"\x15\x04\x15\x08\x15\x08\x4c\x15\xfe\xff\xff\xff\x0f\x15\x00\x00\x1c\x15\x02\x00\x00";
        assert!(Page::read(bytes).unwrap().check().is_err());
    }

    #[test]
    fn a_page_that_would_take_more_room_than_it_can_need_is_refused() {
        let sound = || of_kind(DATA);
        for (page, expected) in [
            (
                Page { unpacked: i64::from(i32::MAX), ..sound() },
                "a page says that 100 bytes of it unpack to 2147483647",
            ),
            (Page { packed: 1 << 30, unpacked: 1 << 30, ..sound() }, "at most 16777216"),
            (Page { packed: -1, ..sound() }, "a page says that it has -1 bytes"),
            (Page { encoding: 7, ..sound() }, "a page has encoding 7; write the table with plain"),
            (Page { values: -1, ..sound() }, "says that it holds -1 values"),
            (
                Page { packed: 1 << 20, unpacked: 1 << 20, values: 1, ..sound() },
                "a page of 1048576 bytes says that it holds 1",
            ),
            (Page { values: 0, ..sound() }, "says that it holds 0 values"),
            (Page { values: 801, ..of_kind(DICTIONARY) }, "a dictionary of 800 bytes says that it holds 801"),
        ] {
            let message = page.check().unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn very_many_columns_of_row_groups_are_refused() {
        // {4: [{1: [{}, ...]}, ...]} with 200 columns in each of up to 9,999 groups.
        let footer = |groups: u16| {
            let varint = |n: u16| [n as u8 | 0x80, (n >> 7) as u8];
            let group = [&[0x19, 0xfc][..], &varint(200), &[0; 200], &[0]].concat();
            [&[0x49, 0xfc][..], &varint(groups), &group.repeat(groups.into()), &[0]].concat()
        };
        assert_eq!(check_footer(&footer(300)), Ok(()));
        let told = "its 301 row groups have more than 60000 columns in all".to_owned();
        assert_eq!(check_footer(&footer(301)), Err(told));
    }

    /// A schema of groups, each in the one before: `{4: name, 5: children}`.
    fn nested(depth: usize) -> Vec<u8> {
        let mut schema = [0x48, 0x01, b'g', 0x15, 0x02, 0x00].repeat(depth);
        schema.extend([0x48, 0x01, b'c', 0x00]);
        schema
    }

    #[test]
    fn columns_that_are_nested_deeply_or_say_there_are_more_are_told() {
        let is_flat = |schema: &[u8], elements| is_flat(&mut Thrift::new(schema), elements);
        assert_eq!(is_flat(&nested(3), 4), Some(true));
        assert_eq!(is_flat(&nested(500), 501), Some(false));
        assert_eq!(is_flat(&nested(3), 3), Some(false), "the last one is missing");
        assert_eq!(is_flat(&[0x48, 0x01, b'g', 0x15, 0xfe, 0xff, 0xff, 0xff, 0x0f, 0x00], 1), Some(false));
        assert_eq!(is_flat(&nested(3)[..9], 4), None);
    }

    /// A folder opens as a file does, and the first byte of it cannot be read.
    #[test]
    #[cfg(target_os = "linux")]
    fn a_disk_that_fails_is_not_told_as_damage() {
        let home = tempfile::tempdir().unwrap();
        let folder = || File::open(home.path()).unwrap();
        let error = page(&mut folder(), 0, 100).map(drop).unwrap_err();
        for told in [ParquetError::from(error).into(), check_end(&mut folder()).unwrap_err().into()] {
            assert!(matches!(&told, Error::System(reason) if reason.raw_os_error() == Some(21)), "{told}");
        }
    }

    #[test]
    fn a_file_that_does_not_end_as_one_is_refused() {
        let refused = |bytes: &[u8]| {
            let mut file = tempfile::tempfile().unwrap();
            std::io::Write::write_all(&mut file, bytes).unwrap();
            check_end(&mut file).unwrap_err().to_string()
        };
        for bytes in [&b""[..], b"PAR1", b"xxxx\xff\xff\xff\xffPAR1", b"\x00\x00\x00\x00PARE"] {
            assert_eq!(refused(bytes), "it does not end as a Parquet file");
        }
        assert_eq!(refused(b"\x1c\x01\x00\x00\x00PAR1"), "what it says of itself cannot be read");
        // {3: rows}
        assert_eq!(
            refused(b"6\xfe\xff\xff\xff\xff\xff\xff\xff\xff\x01\x00\x0c\x00\x00\x00PAR1"),
            "it says that it has 9223372036854775807 rows; at most 100000000"
        );
    }
}
