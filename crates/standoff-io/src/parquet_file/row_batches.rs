//! Reading of columns in batches of rows.

use std::collections::VecDeque;
use std::sync::Arc;

use parquet::basic::{Encoding, Type};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{ColumnReader, get_column_reader};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::properties::ReaderProperties;
use parquet::file::reader::RowGroupReader;
use parquet::file::serialized_reader::SerializedRowGroupReader;
use parquet::schema::types::SchemaDescriptor;

use super::{Error, Footer, Source, guarded};

/// Reads the same columns from several sources in sequence and ignores all other columns.
pub struct RowBatches {
    /// Sources that remain to be read, the next one first, each with the index of every column in its file.
    sources: VecDeque<(Source, Vec<usize>)>,
    names: Vec<String>,
    /// Next row group of the first source.
    next_group: usize,
    /// Readers of the current row group, one per column.
    readers: Vec<ColumnReader>,
    /// Rows of the current group that are not read yet. Groups written by other programs may be larger than a batch.
    unread: usize,
}

impl RowBatches {
    /// Prepares to read columns, each given by name and type. Fails if a column is missing or has another type.
    pub fn new(sources: impl IntoIterator<Item = Source>, columns: &[(&str, Type)]) -> Result<Self, Error> {
        let places = |source: Source| {
            let schema = source.footer.0.file_metadata().schema_descr();
            let places = columns.iter().map(|&(name, kind)| column_index(name, kind, schema)).collect::<Result<_, _>>();
            places.map(|places| (source, places))
        };
        let names = columns.iter().map(|(name, ..)| (*name).to_owned()).collect();
        let sources = sources.into_iter().map(places).collect::<Result<_, _>>()?;
        Ok(Self { sources, names, next_group: 0, readers: Vec::new(), unread: 0 })
    }

    /// Total row count of the remaining sources according to the metadata of their row groups; valid before the first
    /// row is read.
    pub fn rows(&self) -> u64 {
        let groups = self.sources.iter().flat_map(|(source, _)| source.footer.0.row_groups());
        groups.map(|group| u64::try_from(group.num_rows()).unwrap_or(0)).fold(0, u64::saturating_add)
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
            let Some((source, _)) = self.sources.front() else { return Ok(0) };
            if self.next_group == source.footer.0.num_row_groups() {
                self.sources.pop_front();
                self.next_group = 0;
                continue;
            }
            // Some programs write groups without rows.
            if source.footer.0.row_group(self.next_group).num_rows() > 0 {
                guarded(|| self.open_group())?;
            }
            self.next_group += 1;
        }
        let rows = self.unread.min(max_rows);
        guarded(|| {
            self.readers.iter_mut().enumerate().try_for_each(|(column, reader)| match read(column, reader, rows)? {
                found if found == rows => Ok(()),
                found => Err(damage(format!("column {} has {found} of its {rows} rows", self.names[column]))),
            })
        })?;
        self.unread -= rows;
        Ok(rows)
    }

    fn open_group(&mut self) -> ParquetResult<()> {
        let Some((Source { file, footer: Footer(metadata) }, places)) = self.sources.front() else { return Ok(()) };
        let (about, index) = (metadata.row_group(self.next_group), metadata.page_index_for_row_group(self.next_group));
        let properties = Arc::new(ReaderProperties::builder().build());
        let group = SerializedRowGroupReader::new(Arc::clone(file), about, index, properties)?;
        let reader = |&place: &usize| {
            let pages = CheckedPages(group.get_column_page_reader(place)?);
            Ok(get_column_reader(about.schema_descr().column(place), Box::new(pages)))
        };
        self.readers = places.iter().map(reader).collect::<ParquetResult<_>>()?;
        self.unread = usize::try_from(about.num_rows())?;
        Ok(())
    }
}

/// Pages of a column. For a dictionary, and for some encodings, the library allocates memory for as many values as the
/// page states, and a single damaged byte could let it state billions. Such pages are rejected.
struct CheckedPages(Box<dyn PageReader>);

impl PageReader for CheckedPages {
    fn get_next_page(&mut self) -> ParquetResult<Option<Page>> {
        use Encoding::{BYTE_STREAM_SPLIT, PLAIN, PLAIN_DICTIONARY, RLE, RLE_DICTIONARY};
        let page = self.0.get_next_page()?;
        match &page {
            Some(Page::DictionaryPage { buf, num_values, .. }) if *num_values as usize > buf.len() => {
                Err(damage(format!("a dictionary of {} bytes states {num_values} values", buf.len())))
            }
            Some(page)
                if ![PLAIN, PLAIN_DICTIONARY, RLE_DICTIONARY, RLE, BYTE_STREAM_SPLIT].contains(&page.encoding()) =>
            {
                Err(ParquetError::NYI(format!("a column has the encoding {}", page.encoding())))
            }
            _ => Ok(page),
        }
    }

    fn peek_next_page(&mut self) -> ParquetResult<Option<PageMetadata>> {
        self.0.peek_next_page()
    }

    fn skip_next_page(&mut self) -> ParquetResult<()> {
        self.0.skip_next_page()
    }
}

impl Iterator for CheckedPages {
    type Item = ParquetResult<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

fn damage(what: impl Into<String>) -> ParquetError {
    ParquetError::General(what.into())
}

/// Index of a column in a file. Optional columns are accepted, because other programs make every column optional when
/// they copy a table.
fn column_index(name: &str, kind: Type, schema: &SchemaDescriptor) -> Result<usize, Error> {
    let mut columns = schema.columns().iter().enumerate();
    let found = columns.find(|(_, column)| column.path().parts() == [name]);
    let (index, column) = found.ok_or_else(|| Error::Damaged(format!("column {name} is missing")))?;
    if column.physical_type() == kind && column.max_def_level() <= 1 && column.max_rep_level() == 0 {
        return Ok(index);
    }
    // For example, Pandas converts integers to floating-point numbers if some are missing.
    Err(Error::Foreign(format!("column {name} has the type {}, not {kind}", column.physical_type())))
}
