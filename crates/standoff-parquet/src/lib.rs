//! Parquet files of unknown origin, read without harm.
//!
//! The library of Parquet makes room for what a file says of itself, and panics on some damaged files. So the description
//! of the file and of every page is looked at before it is believed: sizes, counts, nesting, encodings. Rows come in blocks,
//! however many a row group says it has. A panic that is left is caught, and told as damage; see [`panic_is_expected`].
//!
//! What is read: flat columns of numbers, truths and text, plain or dictionary encoded, packed by snappy or not at all.
//!
//! ```no_run
//! use parquet::basic::Type;
//! use parquet::column::reader::ColumnReader;
//! use standoff_parquet::{Blocks, Source};
//!
//! let source = Source::open(std::fs::File::open("truth.parquet")?)?;
//! let mut blocks = Blocks::new([source], &[("x_m", Type::DOUBLE, false)])?;
//! let mut x_m: Vec<f64> = Vec::new();
//! while blocks.next(65_536, |_, reader, rows| match reader {
//!     ColumnReader::DoubleColumnReader(reader) => Ok(reader.read_records(rows, None, None, &mut x_m)?.0),
//!     _ => Ok(0),
//! })? > 0
//! {}
//! # Ok::<(), standoff_parquet::Error>(())
//! ```

mod blocks;
mod error;
#[cfg(test)]
mod fuzz;
mod plausible;
mod source;
mod thrift;

pub use blocks::Blocks;
pub use error::{Error, guarded, panic_is_expected};
pub use plausible::{MAX_CELL, MAX_ROWS};
pub use source::{Footer, Source};
