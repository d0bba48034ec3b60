//! Reading of columns in batches of rows.

use std::collections::VecDeque;
use std::sync::Arc;

use parquet::basic::Type;
use parquet::column::reader::ColumnReader;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::properties::ReaderProperties;
use parquet::file::reader::RowGroupReader;
use parquet::file::serialized_reader::SerializedRowGroupReader;
use parquet::schema::types::SchemaDescriptor;

use crate::error::{Error, guarded};
use crate::metadata_checks;
use crate::source::{Footer, Source};

/// Reads the same columns from several sources in sequence and ignores all other columns.
pub struct Blocks {
    /// Sources that remain to be read, the next one first.
    sources: VecDeque<Source>,
    names: Vec<String>,
    /// Index of each column in the file.
    places: Vec<usize>,
    /// Next row group of the first source.
    next_group: usize,
    /// Number of bytes of the first source's columns that were checked. Limited by the file length, because a
    /// manipulated file could refer to the same bytes many times.
    looked_at: u64,
    /// Readers of the current row group, each with the index of its requested column.
    readers: Vec<(usize, ColumnReader)>,
    /// Rows of the current group that are not read yet. Groups written by other programs may be larger than a batch.
    unread: usize,
}

impl Blocks {
    /// Prepares to read columns, each given by name and type. Fails if a column is missing, if a column has another
    /// type, if the sources have the columns at different positions, or if their compression or encoding is not
    /// supported.
    pub fn new(sources: impl Into<VecDeque<Source>>, columns: &[(&str, Type)]) -> Result<Self, Error> {
        let (sources, mut places) = (sources.into(), Vec::new());
        for Source { footer: Footer(metadata), .. } in &sources {
            metadata_checks::check_rows(metadata).map_err(Error::Damaged)?;
            let schema = metadata.file_metadata().schema_descr();
            let found = columns.iter().map(|&(name, kind)| {
                let missing = || Error::Damaged(format!("column {name} is missing"));
                column_index(name, kind, schema)?.ok_or_else(missing)
            });
            let found = found.collect::<Result<Vec<_>, _>>()?;
            metadata_checks::check_format(metadata, &found).map_err(Error::Foreign)?;
            if !(places.is_empty() || places == found) {
                return Err(Error::Damaged("its parts have different columns".to_owned()));
            }
            places = found;
        }
        let names = columns.iter().map(|(name, ..)| (*name).to_owned()).collect();
        Ok(Self { sources, names, places, next_group: 0, looked_at: 0, readers: Vec::new(), unread: 0 })
    }

    /// Total row count of the remaining sources according to their metadata; valid before the first row is read.
    pub fn rows(&self) -> u64 {
        self.sources.iter().map(Source::rows).fold(0, u64::saturating_add)
    }

    /// Reads the next rows, up to `max_rows`, and returns their number; 0 after the last row. `read` is called for each
    /// column with its index in the order of [`Self::new`], its reader and the number of rows to read, and returns the
    /// number of rows read. Fails if a column has fewer rows than its metadata states, or cannot be decoded. After an
    /// error, reading ends.
    pub fn next(
        &mut self,
        max_rows: usize,
        mut read: impl FnMut(usize, &mut ColumnReader, usize) -> ParquetResult<usize>,
    ) -> Result<usize, Error> {
        while self.unread == 0 {
            let Some(Source { footer: Footer(metadata), .. }) = self.sources.front() else { return Ok(0) };
            if self.next_group == metadata.num_row_groups() {
                self.sources.pop_front();
                (self.next_group, self.looked_at) = (0, 0);
                continue;
            }
            // Some programs write groups without rows.
            if metadata.row_group(self.next_group).num_rows() > 0 {
                guarded(|| self.open_group())?;
            }
            self.next_group += 1;
        }
        let rows = self.unread.min(max_rows);
        guarded(|| {
            self.readers.iter_mut().try_for_each(|(column, reader)| match read(*column, reader, rows)? {
                found if found == rows => Ok(()),
                found => Err(damage(format!("column {} has {found} of its {rows} rows", self.names[*column]))),
            })
        })?;
        self.unread -= rows;
        Ok(rows)
    }

    fn open_group(&mut self) -> ParquetResult<()> {
        let Some(Source { file, footer: Footer(metadata) }) = self.sources.front() else { return Ok(()) };
        let (about, index) = (metadata.row_group(self.next_group), metadata.page_index_for_row_group(self.next_group));
        let properties = Arc::new(ReaderProperties::builder().build());
        let group = SerializedRowGroupReader::new(Arc::clone(file), about, index, properties)?;
        // A second handle to check the pages before the reader uses them.
        let mut bytes = file.try_clone()?;
        let length = bytes.metadata()?.len();
        self.readers.clear();
        for (column, &place) in self.places.iter().enumerate() {
            let chunk = about.columns().get(place).ok_or_else(|| damage("a column is missing"))?;
            self.looked_at = self.looked_at.saturating_add(u64::try_from(chunk.compressed_size())?);
            if self.looked_at > length {
                return Err(damage("its columns are longer than the file"));
            }
            metadata_checks::check_pages(&mut bytes, chunk)?;
            self.readers.push((column, group.get_column_reader(place)?));
        }
        self.unread = usize::try_from(about.num_rows())?;
        Ok(())
    }
}

fn damage(what: impl Into<String>) -> ParquetError {
    ParquetError::General(what.into())
}

/// Index of a column in a file; `None` if it is missing. Optional columns are accepted, because other programs make
/// every column optional when they copy a table.
fn column_index(name: &str, kind: Type, schema: &SchemaDescriptor) -> Result<Option<usize>, Error> {
    let mut found = schema.columns().iter().enumerate().filter(|(_, column)| column.path().parts() == [name]);
    let Some((index, column)) = found.next() else { return Ok(None) };
    if found.next().is_some() {
        return Err(Error::Damaged(format!("column {name} occurs twice")));
    }
    if column.physical_type() == kind && column.max_def_level() <= 1 && column.max_rep_level() == 0 {
        return Ok(Some(index));
    }
    // For example, Pandas converts integers to floating-point numbers if some are missing.
    Err(Error::Foreign(format!("column {name} has the type {}, not {kind}", column.physical_type())))
}
