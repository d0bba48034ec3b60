//! Tests of Parquet files: what is damaged, and what is not supported.

use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::sync::Arc;

use parquet::basic::{Encoding, Type};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::Result as ParquetResult;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use super::*;

const COLUMNS: [(&str, Type); 2] = [("x_m", Type::DOUBLE), ("kind", Type::BYTE_ARRAY)];

/// A file with two row groups of 40 rows each.
fn written(properties: WriterProperties) -> Vec<u8> {
    let schema = parse_message_type("message schema { required double x_m; required binary kind; }").unwrap();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties)).unwrap();
    for _ in 0..2 {
        let mut group = file.next_row_group().unwrap();
        let x_m: Vec<f64> = (0..40).map(f64::from).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&x_m, None, None).unwrap();
        column.close().unwrap();
        let kinds: Vec<ByteArray> = (0..40).map(|row| ["cued", "lost"][row % 2].into()).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<ByteArrayType>().write_batch(&kinds, None, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
    }
    file.into_inner().unwrap()
}

fn valid() -> Vec<u8> {
    written(WriterProperties::default())
}

fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    file
}

/// Reads files and returns the number of rows and the values of `x_m`.
fn read(sources: impl IntoIterator<Item = Source>) -> Result<(usize, Vec<f64>), Error> {
    let mut batches = RowBatches::new(sources, &COLUMNS)?;
    let (mut rows, mut x_m) = (0, Vec::new());
    loop {
        let read = batches.next(64, |_, reader, rows| match reader {
            ColumnReader::DoubleColumnReader(reader) => Ok(reader.read_records(rows, None, None, &mut x_m)?.0),
            ColumnReader::ByteArrayColumnReader(reader) => {
                Ok(reader.read_records(rows, None, None, &mut Vec::new())?.0)
            }
            _ => Ok(0),
        })?;
        match read {
            0 => return Ok((rows, x_m)),
            read => rows += read,
        }
    }
}

fn error(bytes: &[u8]) -> Error {
    Source::open(file(bytes)).and_then(|source| read([source])).unwrap_err()
}

#[test]
fn an_embedded_file_is_read_like_a_separate_file() {
    let valid = valid();
    let source = Source::open(file(&valid)).unwrap();
    assert_eq!(RowBatches::new([source.clone()], &COLUMNS).unwrap().rows(), 80);
    let (rows, x_m) = read([source]).unwrap();
    assert_eq!((rows, x_m.len(), x_m[79]), (80, 80, 39.0));
    let within = [b"something before it".as_slice(), &valid].concat();
    let footer = Footer::at_end_of(&valid, 19).unwrap();
    let source = || Source::with_footer(Arc::new(file(&within).into()), &footer);
    assert_eq!(read([source(), source()]).unwrap().0, 160);
    assert!(Footer::at_end_of(&valid[..9], 0).is_err());
}

#[test]
fn a_file_of_another_kind_and_a_truncated_file_are_damaged() {
    let valid = valid();
    for (bytes, expected) in [
        (&b"xxxxxxxxxxxx"[..], "Invalid Parquet file. Corrupt footer"),
        (&valid[..valid.len() / 2], "Invalid Parquet file. Corrupt footer"),
        (b"PAR1", "Parquet file too small. Size is 4 but need 8"),
        (b"\xff\xff\xff\xffPAR1", "Parquet file too small. Size is 8 but need 4294967303"),
    ] {
        let Error::Damaged(what) = error(bytes) else { panic!("{bytes:?}") };
        assert!(what.contains(expected), "{what}");
    }
}

/// A flipped bit could otherwise let a dictionary allocate memory for billions of values.
#[test]
fn a_dictionary_with_more_values_than_bytes_is_damaged() {
    let mut bytes = valid();
    // In the header of the last dictionary, {1: 2 values} of 16 bytes.
    let header = b"\x4c\x15\x04\x15\x00";
    let at = bytes.windows(header.len()).rposition(|window| window == header).unwrap();
    bytes[at + 2] = 2 * 17;
    let Error::Damaged(what) = error(&bytes) else { panic!("the dictionary is accepted") };
    assert_eq!(what, "a dictionary of 16 bytes states 17 values");
}

#[test]
fn an_unsupported_encoding_is_foreign() {
    let properties = WriterProperties::builder().set_dictionary_enabled(false).set_encoding(Encoding::DELTA_BYTE_ARRAY);
    let bytes = written(properties.set_column_encoding("x_m".into(), Encoding::PLAIN).build());
    let Error::Foreign(what) = error(&bytes) else { panic!("the encoding is accepted") };
    assert_eq!(what, "a column has the encoding DELTA_BYTE_ARRAY");
}

/// The library panics where it should return an error. A panic hook can distinguish such a panic from others.
#[test]
fn a_panic_is_reported_as_damage_and_is_expected_only_while_reading() {
    let is_expected = guarded(|| Ok(panic_is_expected()));
    assert!(is_expected.unwrap() && !panic_is_expected());
    let error = guarded(|| -> ParquetResult<()> { panic!("simulated panic of the library") }).unwrap_err();
    assert!(matches!(error, Error::Damaged(what) if what == "its bytes cannot be decoded"));
    assert!(!panic_is_expected());
}

/// A folder can be opened like a file, but reading it fails.
#[test]
#[cfg(target_os = "linux")]
fn an_io_error_is_not_reported_as_damage() {
    let home = tempfile::tempdir().unwrap();
    let error = Source::open(File::open(home.path()).unwrap()).unwrap_err();
    assert!(matches!(&error, Error::System(reason) if reason.raw_os_error() == Some(21)), "{error}");
}
