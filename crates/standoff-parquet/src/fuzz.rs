//! A target of `bolero`: files that are nearly right. `scripts/fuzz` tries more of them.

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

const COLUMNS: [(&str, Type, bool); 3] =
    [("x_m", Type::DOUBLE, false), ("target", Type::INT32, false), ("kind", Type::BYTE_ARRAY, true)];

/// Two row groups of 40 rows each, with values that are missing, and texts in a dictionary.
fn sound() -> Vec<u8> {
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

/// Reads a block of whatever column there is; tells its rows and gives its numbers.
fn take(reader: &mut ColumnReader, rows: usize, x_m: &mut Vec<f64>) -> ParquetResult<usize> {
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

/// The rows of a file, and its numbers. What a file holds for nothing has no end: 100,000 rows are enough.
fn read(sources: impl IntoIterator<Item = Source>) -> Result<(usize, Vec<f64>), Error> {
    let mut blocks = Blocks::new(sources.into_iter().collect::<Vec<_>>(), &COLUMNS)?;
    let (mut rows, mut x_m) = (0, Vec::new());
    while rows < 100_000 {
        match blocks.next(64, |_, reader, rows| take(reader, rows, &mut x_m))? {
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
fn a_file_within_a_file_is_read_as_it_is_alone() {
    let sound = sound();
    let (rows, x_m) = read([Source::open(file(&sound)).unwrap()]).unwrap();
    assert_eq!((rows, x_m.len(), x_m[79]), (80, 80, 39.0));
    let within = [b"something before it".as_slice(), &sound].concat();
    let footer = Footer::at_end_of(&sound, 19).unwrap();
    let source = || Source::with_footer(Arc::new(file(&within)), &footer);
    assert_eq!(read([source(), source()]).unwrap().0, 160);
    assert!(Footer::at_end_of(&sound[..9], 0).is_err());
}

/// The library panics here where an error is due; who has a panic hook can tell such a panic from others.
#[test]
fn a_panic_is_told_as_damage_and_is_expected_only_while_reading() {
    let seen = crate::error::guarded(|| Ok(crate::panic_is_expected()));
    assert!(seen.unwrap() && !crate::panic_is_expected());
    let told = crate::error::guarded(|| -> ParquetResult<()> { panic!("as the library does") }).unwrap_err();
    assert!(matches!(told, Error::Damaged(what) if what == "its bytes cannot be decoded"));
    assert!(!crate::panic_is_expected());
}

#[test]
fn any_parquet_file_is_read_or_refused() {
    let sound = sound();
    let (tried, accepted) = (AtomicU64::new(0), AtomicU64::new(0));
    bolero::check!().with_type::<[(u16, u8, u8); 3]>().with_iterations(5_000).for_each(|changes| {
        let mut bytes = sound.clone();
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
