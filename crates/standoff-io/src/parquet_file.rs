//! Parquet files, alone or embedded in another file, read in batches of rows. Panics of the Parquet library become
//! errors; see [`panic_is_expected`].
//!
//! Metadata are trusted as the Parquet library trusts them, except that a dictionary may not state more values than it
//! has bytes. A manipulated file can therefore exhaust the memory; `docs/user/limits.md` describes this.
//!
//! ```no_run
//! use parquet::basic::Type;
//! use parquet::column::reader::ColumnReader;
//! use standoff_io::parquet_file::{Error, RowBatches, Source};
//!
//! let source = Source::open(std::fs::File::open("truth.parquet")?)?;
//! let mut batches = RowBatches::new([source], &[("x_m", Type::DOUBLE)])?;
//! let mut x_m: Vec<f64> = Vec::new();
//! while batches.next(65_536, |_, reader, rows| match reader {
//!     ColumnReader::DoubleColumnReader(reader) => Ok(reader.read_records(rows, None, None, &mut x_m)?.0),
//!     _ => Ok(0),
//! })? > 0
//! {}
//! # Ok::<(), Error>(())
//! ```

mod error;
mod positional;
mod row_batches;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData};

use parquet::schema::types::SchemaDescriptor;
use positional::Positional;

use crate::bounded_input::Input;

pub use error::{COMPRESSION, Error, guarded, panic_is_expected};
pub use row_batches::RowBatches;

/// A Parquet file and its metadata. It is opened once and can be read repeatedly, also by several threads at a time.
#[derive(Debug, Clone)]
pub struct Source {
    file: Arc<Positional>,
    footer: Footer,
}

/// Metadata of a file.
#[derive(Debug, Clone)]
pub struct Footer(Arc<ParquetMetaData>);

impl Source {
    /// Opens a Parquet file. Fails if its footer cannot be read.
    pub fn open(file: impl Into<Input>) -> Result<Self, Error> {
        let file = Positional(Arc::new(file.into()));
        let metadata = guarded(|| ParquetMetaDataReader::new().parse_and_finish(&file))?;
        Ok(Self { file: Arc::new(file), footer: Footer(Arc::new(metadata)) })
    }

    /// Schema of the file.
    pub fn schema(&self) -> &SchemaDescriptor {
        self.footer.0.file_metadata().schema_descr()
    }

    /// Number of rows according to the metadata.
    pub fn rows(&self) -> u64 {
        u64::try_from(self.footer.0.file_metadata().num_rows()).unwrap_or(0)
    }

    /// Creates a source from a file and a footer that is stored elsewhere.
    pub fn with_footer(file: Arc<Input>, footer: &Footer) -> Self {
        Self { file: Arc::new(Positional(file)), footer: footer.clone() }
    }
}

impl Footer {
    /// Parses the footer at the end of `bytes`. The Parquet file begins at `offset` bytes in another file.
    pub fn at_end_of(bytes: &[u8], offset: i64) -> Result<Self, Error> {
        // A footer is Thrift metadata, its length in 4 bytes, and the 4 bytes of Parquet's magic number.
        let thrift = || {
            let (bytes, end) = bytes.split_last_chunk::<8>()?;
            let length = usize::try_from(u32::from_le_bytes(*end.first_chunk()?)).ok()?;
            bytes.get(bytes.len().checked_sub(length)?..)
        };
        let thrift = thrift().ok_or_else(|| ParquetError::General("a footer is truncated".to_owned()))?;
        let metadata = guarded(|| moved(ParquetMetaDataReader::decode_metadata(thrift)?, offset))?;
        Ok(Self(Arc::new(metadata)))
    }
}

/// Shifts the metadata of a file that begins at `offset` in another one.
fn moved(metadata: ParquetMetaData, offset: i64) -> ParquetResult<ParquetMetaData> {
    let group = |group: &RowGroupMetaData| {
        let columns = group.columns().iter().map(|column| {
            let dictionary = column.dictionary_page_offset().map(|at| at.saturating_add(offset));
            let data = column.data_page_offset().saturating_add(offset);
            column.clone().into_builder().set_dictionary_page_offset(dictionary).set_data_page_offset(data).build()
        });
        group.clone().into_builder().set_column_metadata(columns.collect::<ParquetResult<_>>()?).build()
    };
    let groups = metadata.row_groups().iter().map(group).collect::<ParquetResult<_>>()?;
    Ok(metadata.into_builder().set_row_groups(groups).build())
}
