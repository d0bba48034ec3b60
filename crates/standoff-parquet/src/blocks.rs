//! Columns of a file, a block of rows at a time.

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
use crate::plausible;
use crate::source::{Footer, Source};

/// Reads the same columns of one source after the other, and passes over all others.
pub struct Blocks {
    /// What is still to be read, the next first.
    sources: VecDeque<Source>,
    names: Vec<String>,
    /// Where each of the columns is in the file, of those that are there.
    places: Vec<Option<usize>>,
    /// Of the first source.
    next_group: usize,
    /// Bytes of the first source's columns that were looked at: a part that stands for many would take its time as often.
    looked_at: u64,
    /// What reads each of the columns of the group in hand, and which column that is.
    readers: Vec<(usize, ColumnReader)>,
    /// Rows of that group that were not read yet: other programs make groups that are too large for one go.
    unread: usize,
}

impl Blocks {
    /// Reads these columns, each by its name and the type of its values, and whether it may be missing. Fails if one that
    /// may not is missing, if one is of another type, if the sources do not have them at the same places, or if they are packed or encoded otherwise than is read here.
    pub fn new(sources: impl Into<VecDeque<Source>>, columns: &[(&str, Type, bool)]) -> Result<Self, Error> {
        let (sources, mut places) = (sources.into(), Vec::new());
        for Source { footer: Footer(metadata), .. } in &sources {
            plausible::check_rows(metadata).map_err(Error::Damaged)?;
            let schema = metadata.file_metadata().schema_descr();
            let found = columns.iter().map(|&(name, kind, may_miss)| match place(name, kind, schema)? {
                None if !may_miss => Err(Error::Damaged(format!("column {name} is missing"))),
                found => Ok(found),
            });
            let found = found.collect::<Result<Vec<_>, _>>()?;
            let there: Vec<usize> = found.iter().copied().flatten().collect();
            plausible::check_format(metadata, &there).map_err(Error::Foreign)?;
            if !(places.is_empty() || places == found) {
                return Err(Error::Damaged("its parts have other columns".to_owned()));
            }
            places = found;
        }
        let names = columns.iter().map(|(name, ..)| (*name).to_owned()).collect();
        Ok(Self { sources, names, places, next_group: 0, looked_at: 0, readers: Vec::new(), unread: 0 })
    }

    /// Of each column in the order given, whether it is missing.
    pub fn missing(&self) -> impl Iterator<Item = bool> {
        self.places.iter().map(Option::is_none)
    }

    /// How many rows it says it has: all, as long as none was taken.
    pub fn rows(&self) -> u64 {
        self.sources.iter().map(Source::rows).fold(0, u64::saturating_add)
    }

    /// Reads the next rows, up to `most`, and tells how many; 0 after the last. `read` takes that many rows of a column,
    /// by its place in the order given, and tells how many there were. Fails if a column holds fewer rows than it says, or
    /// cannot be decoded; after that there is nothing more to read.
    pub fn next(
        &mut self,
        most: usize,
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
        let rows = self.unread.min(most);
        guarded(|| {
            self.readers.iter_mut().try_for_each(|(column, reader)| match read(*column, reader, rows)? {
                there if there == rows => Ok(()),
                there => Err(damage(format!("column {} holds {there} of its {rows} rows", self.names[*column]))),
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
        // To look at what the reader is about to believe.
        let mut bytes = file.try_clone()?;
        let length = bytes.metadata()?.len();
        self.readers.clear();
        for (column, place) in self.places.iter().enumerate() {
            let Some(place) = *place else { continue };
            let chunk = about.columns().get(place).ok_or_else(|| damage("a column is missing"))?;
            self.looked_at = self.looked_at.saturating_add(u64::try_from(chunk.compressed_size())?);
            if self.looked_at > length {
                return Err(damage("its columns are longer than the file"));
            }
            plausible::check_pages(&mut bytes, chunk)?;
            self.readers.push((column, group.get_column_reader(place)?));
        }
        self.unread = usize::try_from(about.num_rows())?;
        Ok(())
    }
}

fn damage(what: impl Into<String>) -> ParquetError {
    ParquetError::General(what.into())
}

/// Where the column is in a file, if it is there. Other programs make every column optional when they copy a table: it is enough that the
/// values are there.
fn place(name: &str, kind: Type, schema: &SchemaDescriptor) -> Result<Option<usize>, Error> {
    let mut found = schema.columns().iter().enumerate().filter(|(_, column)| column.path().parts() == [name]);
    let Some((place, column)) = found.next() else { return Ok(None) };
    if found.next().is_some() {
        return Err(Error::Damaged(format!("column {name} is there twice")));
    }
    if column.physical_type() == kind && column.max_def_level() <= 1 && column.max_rep_level() == 0 {
        return Ok(Some(place));
    }
    // Pandas makes floating-point numbers of whole ones if some are missing.
    Err(Error::Foreign(format!("column {name} has the type {}, not {kind}", column.physical_type())))
}
