//! One Parquet file, written and read one row group at a time.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::vec;

use parquet::basic::Compression;
use parquet::errors::Result as ParquetResult;
use parquet::file::metadata::{FileMetaData, ParquetMetaData, ParquetMetaDataWriter};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use standoff_io::bounded_input;
use standoff_io::parquet_file::{self, RowBatches, Source};

use crate::RecordError;
use crate::column::{self, Columns, Fault, Row, ValueProblem};

/// Rows per row group: limits the memory, whatever the length of the run.
pub(crate) const GROUP_ROWS: usize = 65_536;

/// Maximum size of a table's file, bytes. The widest table has 28 GB at the maximum number of rows of targets.
pub const MAX_TABLE: u64 = 32 << 30;

/// Maximum number of rows that a reader buffers.
const BATCH_ROWS: usize = 4096;

/// Path of a table in a record's folder.
pub(crate) fn file_of<R: Row>(dir: &Path) -> PathBuf {
    dir.join(format!("{}.parquet", R::TABLE))
}

/// Where the bytes of a table go.
enum Sink {
    Disk(File),
    Memory(Vec<u8>),
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Disk(file) => file.write(bytes),
            Self::Memory(written) => written.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Disk(file) => file.flush(),
            Self::Memory(_) => Ok(()),
        }
    }
}

impl Sink {
    /// The file on disk, to be synced.
    fn file(&self) -> Option<&File> {
        match self {
            Self::Disk(file) => Some(file),
            Self::Memory(_) => None,
        }
    }
}

/// Folder of a record; `None` for a record in memory.
pub(crate) type Folder<'a> = Option<&'a Path>;

/// Writes a table.
pub struct TableWriter<R> {
    path: PathBuf,
    file: SerializedFileWriter<Sink>,
    columns: Columns<R>,
    rows: usize,
    /// Number of rows added so far, including buffered ones.
    pub(crate) pushed: u64,
    /// Number of row groups that have been synced to disk.
    synced_groups: usize,
}

impl<R: Row> TableWriter<R> {
    /// Creates a table of a record.
    pub(crate) fn create(folder: Folder<'_>, columns: Columns<R>) -> Result<Self, RecordError> {
        let path = file_of::<R>(folder.unwrap_or(Path::new("")));
        match folder {
            Some(_) => Self::with_columns(path, columns),
            None => Self::begin(path, Sink::Memory(Vec::new()), columns),
        }
    }

    /// Creates a table whose columns are only known at run time.
    pub fn with_columns(path: PathBuf, columns: Columns<R>) -> Result<Self, RecordError> {
        let file = File::create(&path).map_err(|reason| RecordError::write(&path, reason))?;
        Self::begin(path, Sink::Disk(file), columns)
    }

    fn begin(path: PathBuf, sink: Sink, columns: Columns<R>) -> Result<Self, RecordError> {
        let file = start(sink, &columns).map_err(|e| RecordError::parquet_write(&path, e))?;
        Ok(Self { path, file, columns, rows: 0, pushed: 0, synced_groups: 0 })
    }

    /// Adds rows of one time. After an error, the table must not be used any more.
    pub fn push(&mut self, mut rows: &mut [R]) -> Result<(), RecordError> {
        while !rows.is_empty() {
            let (now, later) = rows.split_at_mut(rows.len().min(GROUP_ROWS - self.rows));
            let put = self.columns.iter_mut().try_for_each(|column| column.put(now));
            put.map_err(|fault| refusal(&now[0], fault))?;
            (self.rows, self.pushed) = (self.rows + now.len(), self.pushed + now.len() as u64);
            if self.rows == GROUP_ROWS {
                self.flush()?;
            }
            rows = later;
        }
        Ok(())
    }

    /// Writes the remaining rows and syncs the file to disk. After that, the table must not be used any more.
    pub fn finish(&mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.file.finish().map_err(|e| RecordError::parquet_write(&self.path, e))?;
        let synced = self.file.inner().file().map_or(Ok(()), File::sync_all);
        synced.map_err(|reason| RecordError::write(&self.path, reason))
    }

    /// Name and bytes of the file of a finished table in memory; `None` if it is on disk.
    pub(crate) fn into_file(self) -> Option<(String, Vec<u8>)> {
        let Sink::Memory(bytes) = self.file.inner() else { return None };
        Some((self.path.display().to_string(), bytes.clone()))
    }

    /// Syncs the file to disk, and returns the data that it lacks to be readable in its current state.
    pub(crate) fn missing(&mut self) -> Result<Missing, RecordError> {
        let groups = self.file.flushed_row_groups().len();
        if groups > self.synced_groups {
            let synced = self.file.flush().and_then(|()| self.file.inner().file().map_or(Ok(()), File::sync_data));
            synced.map_err(|reason| RecordError::write(&self.path, reason))?;
            self.synced_groups = groups;
        }
        let missing = missing(&self.file, &self.columns, self.rows);
        missing.map_err(|e| RecordError::parquet_write(&self.path, e))
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        if self.rows > 0 {
            write_group(&mut self.file, &self.columns).map_err(|e| RecordError::parquet_write(&self.path, e))?;
            self.columns.iter_mut().for_each(|column| column.buffer_mut().clear());
            self.rows = 0;
        }
        Ok(())
    }
}

fn start<R, W: Write + Send>(file: W, columns: &Columns<R>) -> ParquetResult<SerializedFileWriter<W>> {
    let fields: ParquetResult<Vec<_>> =
        columns.iter().map(|c| c.buffer().schema(&c.declaration().name).map(Arc::new)).collect();
    let schema = Type::group_type_builder("schema").with_fields(fields?).build()?;
    // The file must not depend on the library version or the machine.
    let properties = WriterProperties::builder()
        .set_created_by("standoff".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

/// Data that a growing table's file lacks to be readable.
pub(crate) struct Missing {
    /// Footer for the contents of the file.
    pub(crate) footer: Vec<u8>,
    /// Buffered rows, as a separate Parquet file.
    pub(crate) rows: Vec<u8>,
}

/// Returns the footer of the written data, and the buffered rows as a separate file.
fn missing<R, W: Write + Send>(
    file: &SerializedFileWriter<W>,
    columns: &Columns<R>,
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

fn write_group<R, W: Write + Send>(file: &mut SerializedFileWriter<W>, columns: &Columns<R>) -> ParquetResult<()> {
    let mut group = file.next_row_group()?;
    for column in columns {
        if let Some(mut writer) = group.next_column()? {
            column.buffer().write(writer.untyped())?;
            writer.close()?;
        }
    }
    group.close().map(drop)
}

fn refusal<R: Row>(row: &R, Fault { column, what }: Fault) -> RecordError {
    let (table, time_s) = (R::TABLE, row.time_s());
    match what {
        ValueProblem::NotFinite => RecordError::NotFinite { table, column, time_s },
        ValueProblem::TooLarge(value) => RecordError::TooLarge { table, column, time_s, value },
        ValueProblem::Bad(what) => {
            let path = format!("{table}.parquet");
            RecordError::damaged(Path::new(&path), format!("column {column} {what}"))
        }
    }
}

/// Opens a Parquet file.
pub fn source(path: &Path) -> Result<Source, RecordError> {
    let file = bounded_input::open(path, MAX_TABLE).map_err(|reason| RecordError::read(path, reason))?;
    Source::open(file).map_err(|error| RecordError::parquet_read(path, error))
}

/// Reads a table row by row.
pub struct TableReader<R> {
    path: PathBuf,
    batches: RowBatches,
    columns: Columns<R>,
    /// Row with values of the right length; each value is replaced.
    prototype: R,
    /// Buffered rows that have not been returned.
    rows: vec::IntoIter<R>,
    /// Invalid value in the row after them.
    fault: Option<Fault>,
    /// Number of returned rows, for error messages.
    taken: usize,
}

impl<R: Row> TableReader<R> {
    /// Opens a table. Fails if it lacks columns of the row type.
    pub(crate) fn open(path: PathBuf) -> Result<Self, RecordError> {
        let source = source(&path)?;
        Self::of(path, R::default(), column::columns(), [source])
    }

    /// Reads these columns from several sources in sequence and skips all other columns; `path` is for error messages.
    pub fn of(
        path: PathBuf,
        prototype: R,
        columns: Columns<R>,
        sources: impl IntoIterator<Item = Source>,
    ) -> Result<Self, RecordError> {
        let sources: Vec<Source> = sources.into_iter().collect();
        let requested = columns.iter().map(|column| (&*column.declaration().name, column.buffer().physical()));
        let requested: Vec<_> = requested.collect();
        let batches = RowBatches::new(sources, &requested).map_err(|error| RecordError::parquet_read(&path, error))?;
        Ok(Self { path, batches, columns, prototype, rows: Vec::new().into_iter(), fault: None, taken: 0 })
    }

    /// File of the table.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of rows according to the metadata: the total before the first row is read.
    pub fn rows(&self) -> u64 {
        self.batches.rows()
    }

    /// Returns the next row, or `None` after the last.
    pub fn next_row(&mut self) -> Result<Option<R>, RecordError> {
        if self.rows.len() == 0 && self.fault.is_none() {
            self.read_batch().map_err(|error| RecordError::parquet_read(&self.path, error))?;
        }
        let row = self.rows.next();
        self.taken += 1;
        match self.fault.take_if(|_| row.is_none()) {
            Some(fault) => Err(RecordError::damaged(&self.path, format!("row {}: {fault}", self.taken))),
            None => Ok(row),
        }
    }

    /// Buffers the next rows: those before the first one with an invalid value.
    fn read_batch(&mut self) -> Result<(), parquet_file::Error> {
        let mut rows = Vec::new();
        let mut first: Option<(usize, Fault)> = None;
        self.batches.next(BATCH_ROWS, |column, reader, count| {
            rows.resize(count, self.prototype.clone());
            let (found, fault) = self.columns[column].read(&mut rows, reader)?;
            first = first.take().into_iter().chain(fault).min_by_key(|(row, _)| *row);
            Ok(found)
        })?;
        if let Some((row, fault)) = first {
            rows.truncate(row);
            self.fault = Some(fault);
        }
        self.rows = rows.into_iter();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::FileReader;
    use parquet::file::serialized_reader::SerializedFileReader;

    use super::*;
    use crate::column::{Field as _, rows};
    use crate::schema::TargetRow;

    fn row(target: u32) -> TargetRow {
        let name = format!("target {target}");
        TargetRow { target, name }
    }

    #[test]
    fn full_row_groups_are_written_immediately() {
        let home = tempfile::tempdir().unwrap();
        for (rows, groups) in [(0, 0), (1, 1), (GROUP_ROWS, 1), (GROUP_ROWS + 1, 2)] {
            let path = home.path().join("table.parquet");
            let mut table = TableWriter::with_columns(path.clone(), column::columns()).unwrap();
            let rows = u32::try_from(rows).unwrap();
            table.push(&mut (0..rows).map(row).collect::<Vec<_>>()).unwrap();
            assert!(table.rows < GROUP_ROWS);
            table.finish().unwrap();

            let written = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
            assert_eq!(written.num_row_groups(), groups);
            let mut table = TableReader::<TargetRow>::open(path).unwrap();
            (0..rows).for_each(|target| assert_eq!(table.next_row().unwrap(), Some(row(target))));
            assert_eq!(table.next_row().unwrap(), None);
        }
    }

    /// pandas saves integer columns with missing values as doubles.
    #[test]
    fn column_of_another_type_is_not_reported_as_damaged() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let mut columns = Vec::new();
        f64::declare(column::Declaration::new("target", ""), &mut columns, |row: &mut Position| &mut row.x_m);
        TableWriter::with_columns(path.clone(), columns).unwrap().finish().unwrap();
        let error = TableReader::<TargetRow>::open(path).map(drop).unwrap_err().to_string();
        let expected = "column target has the type DOUBLE, not INT32; save it again with the types that it had";
        assert!(error.contains(expected), "{error}");
    }

    #[test]
    fn non_finite_number_is_refused_with_the_allowed_range() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let columns = column::columns::<Position>();
        for (y_m, expected) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (-2e100, "-2e100")] {
            // Written directly, because a row type would refuse the value.
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
            let message = format!("table.parquet is damaged: row 1: column y_m is {expected}; must be -1e100 to 1e100");
            assert!(error.contains(&message), "{error}");
        }
    }

    rows! {
        /// A row of two numbers.
        struct Position in "table" {
            /// East, m.
            pub x_m: f64,
            /// North, m.
            pub y_m: f64,
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn full_disk_gives_the_reason_of_the_system() {
        let mut table = TableWriter::with_columns(PathBuf::from("/dev/full"), column::columns()).unwrap();
        table.push(&mut [row(0)]).unwrap();
        let error = table.finish().unwrap_err();
        let RecordError::Write { path, reason } = error else {
            panic!("{error}");
        };
        assert_eq!(path, Path::new("/dev/full"));
        assert_eq!(reason.kind(), std::io::ErrorKind::StorageFull);
    }
}
