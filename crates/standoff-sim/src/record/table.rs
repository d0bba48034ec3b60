//! One Parquet file: rows go in and come out through the columns of one row group at a time.

use std::cell::Cell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::Write;
use std::marker::PhantomData;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

use parquet::basic::Compression;
use parquet::column::reader::ColumnReader;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::{FileMetaData, ParquetMetaData, ParquetMetaDataReader, ParquetMetaDataWriter};
use parquet::file::properties::{EnabledStatistics, ReaderProperties, WriterProperties};
use parquet::file::reader::RowGroupReader;
use parquet::file::serialized_reader::SerializedRowGroupReader;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{SchemaDescriptor, Type};

use super::checkpoint::Missing;
use super::column::{Cells, Column, Fault, What};
use super::{RecordError, plausible};
use crate::input;

/// Rows per row group: it bounds the memory of a run of any length.
pub(crate) const GROUP_ROWS: usize = 65_536;

/// A row of a table. One order of columns serves both ways.
pub(crate) trait Row: Sized {
    /// Name of the table; the file is `<name>.parquet`.
    const TABLE: &'static str;
    /// The table's columns, empty.
    fn columns() -> Vec<Column>;
    /// Puts the row at the end of the columns.
    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault>;
    /// Takes the next row out of the columns.
    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault>;
    /// The row's time for messages, s.
    fn time_s(&self) -> f64 {
        0.0
    }
}

/// The file of a table in a record's folder.
pub(crate) fn file_of<R: Row>(dir: &Path) -> PathBuf {
    dir.join(format!("{}.parquet", R::TABLE))
}

/// Writes a table row by row.
pub(crate) struct TableWriter<R> {
    path: PathBuf,
    file: SerializedFileWriter<File>,
    columns: Vec<Column>,
    rows: usize,
    /// Rows that went in, those in hand included.
    pushed: u64,
    /// Row groups that are known to be on the disk.
    synced_groups: usize,
    kind: PhantomData<R>,
}

impl<R: Row> TableWriter<R> {
    pub(crate) fn create(path: PathBuf) -> Result<Self, RecordError> {
        Self::with_columns(path, R::columns())
    }

    /// A table whose columns are known only when it is written.
    pub(crate) fn with_columns(path: PathBuf, columns: Vec<Column>) -> Result<Self, RecordError> {
        let file = File::create(&path).map_err(|reason| RecordError::write(&path, reason))?;
        let file = start(file, &columns).map_err(|e| RecordError::parquet_write(&path, e))?;
        Ok(Self { path, file, columns, rows: 0, pushed: 0, synced_groups: 0, kind: PhantomData })
    }

    /// Adds a row. After an error the table is not to be used any more.
    pub(crate) fn push(&mut self, row: &R) -> Result<(), RecordError> {
        row.put(&mut self.columns.iter_mut()).map_err(|fault| refusal(row, fault))?;
        (self.rows, self.pushed) = (self.rows + 1, self.pushed + 1);
        if self.rows == GROUP_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    /// Its name, and how many rows went in.
    pub(super) fn count(&self) -> (String, u64) {
        (R::TABLE.to_owned(), self.pushed)
    }

    /// Writes what is left and sees it onto the disk. After that the table is not to be used any more.
    pub(crate) fn finish(&mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.file.finish().map_err(|e| RecordError::parquet_write(&self.path, e))?;
        let synced = self.file.inner().sync_all();
        synced.map_err(|reason| RecordError::write(&self.path, reason))
    }

    /// Sees what is in the file onto the disk, and gives what it lacks to be read as it is now.
    pub(super) fn missing(&mut self) -> Result<Missing, RecordError> {
        let groups = self.file.flushed_row_groups().len();
        if groups > self.synced_groups {
            let synced = self.file.flush().and_then(|()| self.file.inner().sync_data());
            synced.map_err(|reason| RecordError::write(&self.path, reason))?;
            self.synced_groups = groups;
        }
        let missing = missing(&self.file, &self.columns, self.rows);
        missing.map_err(|e| RecordError::parquet_write(&self.path, e))
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        if self.rows > 0 {
            write_group(&mut self.file, &self.columns).map_err(|e| RecordError::parquet_write(&self.path, e))?;
            self.columns.iter_mut().for_each(Column::clear);
            self.rows = 0;
        }
        Ok(())
    }
}

fn start<W: Write + Send>(file: W, columns: &[Column]) -> ParquetResult<SerializedFileWriter<W>> {
    let fields: ParquetResult<Vec<_>> = columns.iter().map(|c| c.schema().map(Arc::new)).collect();
    let schema = Type::group_type_builder("schema").with_fields(fields?).build()?;
    // Neither the library's version nor anything of this machine goes into the file.
    let properties = WriterProperties::builder()
        .set_created_by("standoff".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

/// The footer of what was written so far, and the rows in hand as a file of their own.
fn missing<W: Write + Send>(
    file: &SerializedFileWriter<W>,
    columns: &[Column],
    rows_in_hand: usize,
) -> ParquetResult<Missing> {
    let groups = file.flushed_row_groups().to_vec();
    let rows = groups.iter().map(|group| group.num_rows()).sum();
    let about = FileMetaData::new(1, rows, None, None, Arc::new(file.schema_descr().clone()), None);
    let mut footer = Vec::new();
    ParquetMetaDataWriter::new(&mut footer, &ParquetMetaData::new(about, groups)).finish()?;
    let mut rows = start(Vec::new(), columns)?;
    if rows_in_hand > 0 {
        write_group(&mut rows, columns)?;
    }
    Ok(Missing { footer, rows: rows.into_inner()? })
}

fn write_group<W: Write + Send>(file: &mut SerializedFileWriter<W>, columns: &[Column]) -> ParquetResult<()> {
    let mut group = file.next_row_group()?;
    for column in columns {
        if let Some(mut writer) = group.next_column()? {
            column.write(writer.untyped())?;
            writer.close()?;
        }
    }
    group.close().map(drop)
}

fn refusal<R: Row>(row: &R, Fault { column, what }: Fault) -> RecordError {
    let (table, time_s) = (R::TABLE, row.time_s());
    match what {
        What::NotFinite => RecordError::NotFinite { table, column, time_s },
        What::TooLarge(value) => RecordError::TooLarge { table, column, time_s, value },
        What::Bad(what) => {
            let path = format!("{table}.parquet");
            RecordError::damaged(Path::new(&path), format!("column {column} {what}"))
        }
    }
}

/// Row groups, and the file that holds them. It is opened once, and read as often as need be.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) file: Arc<File>,
    pub(crate) metadata: Arc<ParquetMetaData>,
}

impl Source {
    /// A Parquet file, if what it says of itself is plausible.
    pub(crate) fn open(path: &Path) -> Result<Self, RecordError> {
        let mut file = input::open(path, u64::MAX).map_err(|reason| RecordError::read(path, reason))?;
        plausible::check_end(&mut file).map_err(|reason| RecordError::bad_bytes(path, reason))?;
        let metadata = guarded(|| ParquetMetaDataReader::new().parse_and_finish(&file));
        let metadata = metadata.map_err(|e| RecordError::parquet_read(path, e))?;
        Ok(Self { file: Arc::new(file), metadata: Arc::new(metadata) })
    }
}

/// Reads a table row by row.
pub(crate) struct TableReader<R> {
    path: PathBuf,
    /// What is still to be read, the next first.
    sources: VecDeque<Source>,
    columns: Vec<Column>,
    /// Where each of our columns is in the file, of those that are there.
    places: Vec<usize>,
    /// Of the first source.
    next_group: usize,
    /// Bytes of the first source's columns that were looked at: a part that stands for many would take its time as often.
    looked_at: u64,
    /// What reads each of our columns of the group in hand.
    readers: Vec<ColumnReader>,
    /// Rows of that group that were not read yet: other programs make groups that are too large for one go.
    unread: usize,
    /// Rows in hand that were not taken yet.
    left: usize,
    /// Rows taken, for messages.
    taken: usize,
    kind: PhantomData<R>,
}

impl<R: Row> TableReader<R> {
    pub(crate) fn open(path: PathBuf) -> Result<Self, RecordError> {
        let source = Source::open(&path)?;
        Self::of(path, R::columns(), [source])
    }

    /// Reads these columns of one source after the other, and passes over all others; `path` is for messages.
    pub(crate) fn of(
        path: PathBuf,
        mut columns: Vec<Column>,
        sources: impl Into<VecDeque<Source>>,
    ) -> Result<Self, RecordError> {
        let (sources, mut places) = (sources.into(), Vec::new());
        for source in &sources {
            plausible::check_rows(&source.metadata).map_err(|what| RecordError::damaged(&path, what))?;
            let schema = source.metadata.file_metadata().schema_descr();
            let found: Result<Vec<usize>, _> =
                columns.iter_mut().filter_map(|c| place(c, schema, &path).transpose()).collect();
            let found = found?;
            plausible::check_format(&source.metadata, &found).map_err(|what| RecordError::foreign(&path, what))?;
            if !(places.is_empty() || places == found) {
                return Err(RecordError::damaged(&path, "its parts have other columns".to_owned()));
            }
            places = found;
        }
        Ok(Self {
            path,
            sources,
            columns,
            places,
            next_group: 0,
            looked_at: 0,
            readers: Vec::new(),
            unread: 0,
            left: 0,
            taken: 0,
            kind: PhantomData,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// How many rows it says it has: all, as long as none was taken.
    pub(crate) fn rows(&self) -> u64 {
        let rows = |source: &Source| u64::try_from(source.metadata.file_metadata().num_rows()).unwrap_or(0);
        self.sources.iter().map(rows).fold(0, u64::saturating_add)
    }

    /// The next row, or `None` after the last.
    pub(crate) fn next_row(&mut self) -> Result<Option<R>, RecordError> {
        while self.left == 0 {
            if self.unread == 0 {
                let Some(source) = self.sources.front() else { return Ok(None) };
                if self.next_group == source.metadata.num_row_groups() {
                    self.sources.pop_front();
                    (self.next_group, self.looked_at) = (0, 0);
                    continue;
                }
                // Some programs write them.
                if source.metadata.row_group(self.next_group).num_rows() == 0 {
                    self.next_group += 1;
                    continue;
                }
                guarded(|| self.open_group()).map_err(|e| RecordError::parquet_read(&self.path, e))?;
                self.next_group += 1;
            }
            self.left = guarded(|| self.read_rows()).map_err(|e| RecordError::parquet_read(&self.path, e))?;
            self.unread -= self.left;
        }
        self.left -= 1;
        self.taken += 1;
        match R::get(&mut self.columns.iter_mut()) {
            Ok(row) => Ok(Some(row)),
            Err(fault) => {
                let what = format!("row {}: {fault}", self.taken);
                Err(RecordError::damaged(&self.path, what))
            }
        }
    }

    fn open_group(&mut self) -> ParquetResult<()> {
        let Some(Source { file, metadata }) = self.sources.front() else { return Ok(()) };
        let (about, index) = (metadata.row_group(self.next_group), metadata.page_index_for_row_group(self.next_group));
        let properties = Arc::new(ReaderProperties::builder().build());
        let group = SerializedRowGroupReader::new(Arc::clone(file), about, index, properties)?;
        // To look at what the reader is about to believe.
        let mut bytes = file.try_clone()?;
        let length = bytes.metadata()?.len();
        self.unread = usize::try_from(about.num_rows())?;
        self.readers.clear();
        for &place in &self.places {
            let chunk = about.columns().get(place).ok_or_else(|| damage("a column is missing"))?;
            self.looked_at = self.looked_at.saturating_add(u64::try_from(chunk.compressed_size())?);
            if self.looked_at > length {
                return Err(damage("its columns are longer than the file"));
            }
            plausible::check_pages(&mut bytes, chunk)?;
            self.readers.push(group.get_column_reader(place)?);
        }
        Ok(())
    }

    fn read_rows(&mut self) -> ParquetResult<usize> {
        let rows = self.unread.min(GROUP_ROWS);
        let there = self.columns.iter_mut().filter(|column| column.is_there());
        for (column, reader) in there.zip(&mut self.readers) {
            column.read(reader, rows)?;
        }
        Ok(rows)
    }
}

pub(super) fn damage(what: &str) -> ParquetError {
    ParquetError::General(what.to_owned())
}

/// Runs the parquet crate on bytes of which nobody knows where they have been: it panics on some
/// damaged files (60.1: a dictionary page that is missing, for one) where an error is due.
pub(super) fn guarded<T>(read: impl FnOnce() -> ParquetResult<T>) -> ParquetResult<T> {
    // What a panic leaves half done is not used again: the error ends the reading.
    quietly(|| catch_unwind(AssertUnwindSafe(read))).unwrap_or_else(|_| Err(damage("its bytes cannot be decoded")))
}

thread_local! {
    /// A panic of this thread is expected, and caught.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Does something without the message that a panic prints, on this thread; others are not concerned.
fn quietly<T>(work: impl FnOnce() -> T) -> T {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                print(panic);
            }
        }));
    });
    QUIET.set(true);
    let done = work();
    QUIET.set(false);
    done
}

/// Where the column is in a file, if it need be there; columns that this version does not know are passed over.
fn place(column: &mut Column, schema: &SchemaDescriptor, path: &Path) -> Result<Option<usize>, RecordError> {
    let mut found = schema.columns().iter().enumerate().filter(|(_, c)| c.path().parts() == [column.name()]);
    let place = found.next().map(|(place, _)| place);
    if found.next().is_some() {
        return Err(RecordError::damaged(path, format!("column {} is there twice", column.name())));
    }
    match place {
        Some(place) if column.fits(&schema.column(place)) => Ok(Some(place)),
        Some(place) => {
            let (name, other) = (column.name(), schema.column(place).physical_type());
            // Pandas makes floating-point numbers of whole ones if some are missing.
            Err(RecordError::foreign(path, format!("column {name} has the type {other}, not {}", column.physical())))
        }
        None if column.miss() => Ok(None),
        None => Err(RecordError::damaged(path, format!("column {} is missing", column.name()))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::Field;
    use super::super::rows::TargetRow;
    use super::*;

    fn row(target: u32) -> TargetRow {
        let name = format!("target {target}");
        TargetRow { target, name }
    }

    #[test]
    fn a_full_row_group_is_written_at_once() {
        let home = tempfile::tempdir().unwrap();
        for (rows, groups) in [(0, 0), (1, 1), (GROUP_ROWS, 1), (GROUP_ROWS + 1, 2)] {
            let path = home.path().join("table.parquet");
            let mut table = TableWriter::create(path.clone()).unwrap();
            let rows = u32::try_from(rows).unwrap();
            (0..rows).for_each(|target| table.push(&row(target)).unwrap());
            assert!(table.rows < GROUP_ROWS);
            table.finish().unwrap();

            let mut table = TableReader::<TargetRow>::open(path).unwrap();
            assert_eq!(table.sources[0].metadata.num_row_groups(), groups);
            (0..rows).for_each(|target| assert_eq!(table.next_row().unwrap(), Some(row(target))));
            assert_eq!(table.next_row().unwrap(), None);
        }
    }

    #[test]
    fn a_column_that_is_there_twice_is_refused() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let columns = || TargetRow::columns().into_iter().chain(TargetRow::columns()).collect();
        TableWriter::<TargetRow>::with_columns(path.clone(), columns()).unwrap().finish().unwrap();
        let error = TableReader::<TargetRow>::open(path).map(drop).unwrap_err().to_string();
        assert!(error.contains("column target is there twice"), "{error}");
    }

    /// As pandas saves whole numbers of which some are missing.
    #[test]
    fn a_column_of_another_type_is_not_called_damaged() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let mut columns = Vec::new();
        f64::declare("target", &mut columns);
        TableWriter::<TargetRow>::with_columns(path.clone(), columns).unwrap().finish().unwrap();
        let error = TableReader::<TargetRow>::open(path).map(drop).unwrap_err().to_string();
        let expected = "column target has the type DOUBLE, not INT32; save it again with the types that it had";
        assert!(error.contains(expected), "{error}");
    }

    #[test]
    fn a_number_that_is_none_is_refused_with_what_is_allowed() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let columns = Position::columns();
        for (y_m, expected) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (-2e100, "-2e100")] {
            // What a row of ours would not put there.
            let file = File::create(&path).unwrap();
            let mut file = start(file, &columns).unwrap();
            let mut group = file.next_row_group().unwrap();
            for value in [1.0, y_m] {
                let mut column = group.next_column().unwrap().unwrap();
                column.typed::<parquet::data_type::DoubleType>().write_batch(&[value], None, None).unwrap();
                column.close().unwrap();
            }
            group.close().unwrap();
            file.close().unwrap();
            let mut table = TableReader::<Position>::open(path.clone()).unwrap();
            let error = table.next_row().map(drop).unwrap_err().to_string();
            let told = format!("table.parquet is damaged: row 1: column y_m is {expected}; -1e100 to 1e100");
            assert!(error.contains(&told), "{error}");
        }
    }

    /// A row of two numbers.
    #[derive(Debug)]
    struct Position {
        _x_m: f64,
        _y_m: f64,
    }

    impl Row for Position {
        const TABLE: &'static str = "table";

        fn columns() -> Vec<Column> {
            let mut columns = Vec::new();
            f64::declare("x_m", &mut columns);
            f64::declare("y_m", &mut columns);
            columns
        }

        fn put(&self, _cells: &mut Cells<'_>) -> Result<(), Fault> {
            Ok(())
        }

        fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
            Ok(Self { _x_m: f64::get(cells)?, _y_m: f64::get(cells)? })
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_gives_the_systems_reason() {
        let mut table = TableWriter::create(PathBuf::from("/dev/full")).unwrap();
        table.push(&row(0)).unwrap();
        let error = table.finish().unwrap_err();
        let RecordError::Write { path, reason } = error else {
            panic!("{error}");
        };
        assert_eq!(path, Path::new("/dev/full"));
        assert_eq!(reason.kind(), std::io::ErrorKind::StorageFull);
    }
}
