//! A Parquet file, alone or embedded in another file.

use std::fs::File;
use std::sync::Arc;

use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData};

use crate::error::{Error, guarded};
use crate::metadata_checks;

/// A Parquet file and its metadata. It is opened once and can be read repeatedly.
#[derive(Debug, Clone)]
pub struct Source {
    pub(crate) file: Arc<File>,
    pub(crate) footer: Footer,
}

/// Validated metadata of a file.
#[derive(Debug, Clone)]
pub struct Footer(pub(crate) Arc<ParquetMetaData>);

impl Source {
    /// Opens a Parquet file. Fails if its metadata is not plausible.
    pub fn open(mut file: File) -> Result<Self, Error> {
        metadata_checks::check_end(&mut file)?;
        let metadata = guarded(|| ParquetMetaDataReader::new().parse_and_finish(&file))?;
        Ok(Self { file: Arc::new(file), footer: Footer(Arc::new(metadata)) })
    }

    /// Creates a source from a file and a footer that is stored elsewhere.
    pub fn with_footer(file: Arc<File>, footer: &Footer) -> Self {
        Self { file, footer: footer.clone() }
    }

    /// Row count according to the metadata.
    pub(crate) fn rows(&self) -> u64 {
        u64::try_from(self.footer.0.file_metadata().num_rows()).unwrap_or(0)
    }
}

impl Footer {
    /// Parses the footer at the end of `bytes`. The Parquet file begins at `offset` bytes in another file. Fails if the
    /// footer is not plausible.
    pub fn at_end_of(bytes: &[u8], offset: i64) -> Result<Self, Error> {
        // A footer is Thrift metadata, its length in 4 bytes, and the 4 bytes of Parquet's magic number.
        let thrift = || {
            let (bytes, end) = bytes.split_last_chunk::<8>()?;
            let length = usize::try_from(u32::from_le_bytes(*end.first_chunk()?)).ok()?;
            bytes.get(bytes.len().checked_sub(length)?..)
        };
        let thrift = thrift().ok_or_else(|| ParquetError::General("a footer is truncated".to_owned()))?;
        metadata_checks::check_footer(thrift).map_err(Error::Damaged)?;
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
