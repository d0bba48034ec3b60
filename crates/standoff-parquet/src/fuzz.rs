//! Fuzz test with `bolero`: files that are almost valid. `scripts/fuzz` tries more of them.

use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parquet::basic::Type;
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::Result as ParquetResult;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::{Blocks, Error, Footer, Source};

const COLUMNS: [(&str, Type); 3] = [("x_m", Type::DOUBLE), ("target", Type::INT32), ("kind", Type::BYTE_ARRAY)];

/// A valid file: two row groups of 40 rows each, with missing values and dictionary-encoded text.
fn valid() -> Vec<u8> {
    let schema = "message schema { required double x_m; optional int32 target; required binary kind; }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut file = SerializedFileWriter::new(Vec::new(), schema, Arc::new(WriterProperties::default())).unwrap();
    for _ in 0..2 {
        let mut group = file.next_row_group().unwrap();
        let x_m: Vec<f64> = (0..40).map(f64::from).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&x_m, None, None).unwrap();
        column.close().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        let levels: Vec<i16> = (0..40).map(|row| row % 2).collect();
        column.typed::<Int32Type>().write_batch(&(0..20).collect::<Vec<_>>(), Some(&levels), None).unwrap();
        column.close().unwrap();
        let kinds: Vec<ByteArray> = (0..40).map(|row| ["cued", "lost"][row % 2].into()).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<ByteArrayType>().write_batch(&kinds, None, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
    }
    file.into_inner().unwrap()
}

/// Reads a batch of rows of a column. Returns the number of rows; values of `x_m` are appended.
fn read_batch(reader: &mut ColumnReader, rows: usize, x_m: &mut Vec<f64>) -> ParquetResult<usize> {
    let mut levels = Vec::new();
    Ok(match reader {
        ColumnReader::DoubleColumnReader(reader) => reader.read_records(rows, Some(&mut levels), None, x_m)?.0,
        ColumnReader::Int32ColumnReader(reader) => {
            reader.read_records(rows, Some(&mut levels), None, &mut Vec::new())?.0
        }
        ColumnReader::ByteArrayColumnReader(reader) => {
            reader.read_records(rows, Some(&mut levels), None, &mut Vec::new())?.0
        }
        _ => 0,
    })
}

/// Reads a file and returns the number of rows and the values of `x_m`. Stops after 100,000 rows, because a small file
/// may contain almost any number of empty rows.
fn read(sources: impl IntoIterator<Item = Source>) -> Result<(usize, Vec<f64>), Error> {
    let mut blocks = Blocks::new(sources.into_iter().collect::<Vec<_>>(), &COLUMNS)?;
    let (mut rows, mut x_m) = (0, Vec::new());
    while rows < 100_000 {
        match blocks.next(64, |_, reader, rows| read_batch(reader, rows, &mut x_m))? {
            0 => break,
            read => rows += read,
        }
    }
    Ok((rows, x_m))
}

fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    file
}

#[test]
fn an_embedded_file_is_read_like_a_separate_file() {
    let valid = valid();
    let (rows, x_m) = read([Source::open(file(&valid)).unwrap()]).unwrap();
    assert_eq!((rows, x_m.len(), x_m[79]), (80, 80, 39.0));
    let within = [b"something before it".as_slice(), &valid].concat();
    let footer = Footer::at_end_of(&valid, 19).unwrap();
    let source = || Source::with_footer(Arc::new(file(&within)), &footer);
    assert_eq!(read([source(), source()]).unwrap().0, 160);
    assert!(Footer::at_end_of(&valid[..9], 0).is_err());
}

/// The library panics where it should return an error. A panic hook can distinguish such a panic from others.
#[test]
fn a_panic_is_reported_as_damage_and_is_expected_only_while_reading() {
    let is_expected = crate::error::guarded(|| Ok(crate::panic_is_expected()));
    assert!(is_expected.unwrap() && !crate::panic_is_expected());
    let error =
        crate::error::guarded(|| -> ParquetResult<()> { panic!("simulated panic of the library") }).unwrap_err();
    assert!(matches!(error, Error::Damaged(what) if what == "its bytes cannot be decoded"));
    assert!(!crate::panic_is_expected());
}

#[test]
fn any_parquet_file_is_read_or_rejected() {
    let valid = valid();
    let (tried, accepted) = (AtomicU64::new(0), AtomicU64::new(0));
    bolero::check!().with_type::<[(u16, u8, u8); 3]>().with_iterations(5_000).for_each(|changes| {
        let mut bytes = valid.clone();
        for &(at, how, byte) in changes {
            let at = usize::from(at) % bytes.len().max(1);
            match how % 8 {
                0 => bytes.truncate(at),
                1 => bytes.insert(at, byte),
                2 | 3 => bytes[at] = byte,
                4 => bytes[at] ^= 1 << (byte % 8),
                _ => {}
            }
            if bytes.is_empty() {
                break;
            }
        }
        tried.fetch_add(1, Ordering::Relaxed);
        match Source::open(file(&bytes)).and_then(|source| read([source])) {
            Ok((rows, x_m)) => {
                assert!(x_m.len() <= rows);
                accepted.fetch_add(1, Ordering::Relaxed);
            }
            Err(Error::System(reason)) => panic!("{reason}"),
            Err(Error::Damaged(what) | Error::Foreign(what)) => assert!(!what.is_empty()),
        }
    });
    let share = accepted.into_inner() as f64 / tried.into_inner() as f64;
    assert!(share > 0.05, "only {share} of the inputs were accepted");
}
