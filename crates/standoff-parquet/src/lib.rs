//! Safe reading of Parquet files of unknown origin.
//!
//! The Parquet library allocates memory according to the metadata of a file, and panics on some damaged files.
//! Therefore this crate validates the metadata of the file and of every page before the library uses it: sizes, counts,
//! nesting and encodings. Rows are read in batches, independent of the row count of a row group. Remaining panics are
//! caught and reported as damage; see [`panic_is_expected`].
//!
//! Supported: flat columns of numbers, booleans and text, plain or dictionary encoded, uncompressed or compressed by
//! snappy.
//!
//! ```no_run
//! use parquet::basic::Type;
//! use parquet::column::reader::ColumnReader;
//! use standoff_parquet::{Blocks, Source};
//!
//! let source = Source::open(std::fs::File::open("truth.parquet")?)?;
//! let mut blocks = Blocks::new([source], &[("x_m", Type::DOUBLE)])?;
//! let mut x_m: Vec<f64> = Vec::new();
//! while blocks.next(65_536, |_, reader, rows| match reader {
//!     ColumnReader::DoubleColumnReader(reader) => Ok(reader.read_records(rows, None, None, &mut x_m)?.0),
//!     _ => Ok(0),
//! })? > 0
//! {}
//! # Ok::<(), standoff_parquet::Error>(())
//! ```

mod error;
#[cfg(test)]
mod fuzz;
mod metadata_checks;
mod row_batches;
mod source;
mod thrift;

pub use error::{Error, guarded, panic_is_expected};
pub use metadata_checks::{MAX_CELL, MAX_ROWS};
pub use row_batches::Blocks;
pub use source::{Footer, Source};
