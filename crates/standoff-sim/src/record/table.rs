//! One Parquet file, written and read one row group at a time.

use std::fs::File;
use std::io::Write;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::errors::Result as ParquetResult;
use parquet::file::metadata::{FileMetaData, ParquetMetaData, ParquetMetaDataWriter};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use standoff_io::bounded_input;
use standoff_io::parquet_file::{RowBatches, Source};

use super::RecordError;
use super::column::{Cells, Column, Fault, ValueProblem};

/// Rows per row group: limits the memory, whatever the length of the run.
pub(crate) const GROUP_ROWS: usize = 65_536;

/// Maximum size of a table's file, bytes. The widest table has 25 GB at the maximum number of rows of targets.
pub(crate) const MAX_TABLE: u64 = 32 << 30;

/// Row of a table. The same column order is used for writing and reading.
pub(crate) trait Row: Sized {
    /// Name of the table; the file is `<name>.parquet`.
    const TABLE: &'static str;
    /// Returns the columns of the table, empty.
    fn columns() -> Vec<Column>;
    /// Appends the row to the columns.
    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault>;
    /// Reads the next row from the columns.
    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault>;
    /// Time of the row for error messages, s.
    fn time_s(&self) -> f64 {
        0.0
    }
}

/// Path of a table in a record's folder.
pub(crate) fn file_of<R: Row>(dir: &Path) -> PathBuf {
    dir.join(format!("{}.parquet", R::TABLE))
}

/// Writes a table row by row; all rows have the same type.
pub(crate) struct TableWriter {
    path: PathBuf,
    file: SerializedFileWriter<File>,
    columns: Vec<Column>,
    rows: usize,
    /// Number of rows added so far, including buffered ones.
    pub(super) pushed: u64,
    /// Number of row groups that have been synced to disk.
    synced_groups: usize,
}

impl TableWriter {
    /// Creates the table of this row type in a record's folder.
    pub(crate) fn create<R: Row>(dir: &Path) -> Result<Self, RecordError> {
        Self::with_columns(file_of::<R>(dir), R::columns())
    }

    /// Creates a table whose columns are only known at run time.
    pub(crate) fn with_columns(path: PathBuf, columns: Vec<Column>) -> Result<Self, RecordError> {
        let file = File::create(&path).map_err(|reason| RecordError::write(&path, reason))?;
        let file = start(file, &columns).map_err(|e| RecordError::parquet_write(&path, e))?;
        Ok(Self { path, file, columns, rows: 0, pushed: 0, synced_groups: 0 })
    }

    /// Adds a row. After an error, the table must not be used any more.
    pub(crate) fn push<R: Row>(&mut self, row: &R) -> Result<(), RecordError> {
        row.put(&mut self.columns.iter_mut()).map_err(|fault| refusal(row, fault))?;
        (self.rows, self.pushed) = (self.rows + 1, self.pushed + 1);
        if self.rows == GROUP_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    /// Writes the remaining rows and syncs the file to disk. After that, the table must not be used any more.
    pub(crate) fn finish(&mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.file.finish().map_err(|e| RecordError::parquet_write(&self.path, e))?;
        let synced = self.file.inner().sync_all();
        synced.map_err(|reason| RecordError::write(&self.path, reason))
    }

    /// Syncs the file to disk, and returns the data that it lacks to be readable in its current state.
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
pub(super) struct Missing {
    /// Footer for the contents of the file.
    pub(super) footer: Vec<u8>,
    /// Buffered rows, as a separate Parquet file.
    pub(super) rows: Vec<u8>,
}

/// Returns the footer of the written data, and the buffered rows as a separate file.
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
        ValueProblem::NotFinite => RecordError::NotFinite { table, column, time_s },
        ValueProblem::TooLarge(value) => RecordError::TooLarge { table, column, time_s, value },
        ValueProblem::Bad(what) => {
            let path = format!("{table}.parquet");
            RecordError::damaged(Path::new(&path), format!("column {column} {what}"))
        }
    }
}

/// Opens a Parquet file.
pub(crate) fn source(path: &Path) -> Result<Source, RecordError> {
    let file = bounded_input::open(path, MAX_TABLE).map_err(|reason| RecordError::read(path, reason))?;
    Source::open(file).map_err(|error| RecordError::parquet_read(path, error))
}

/// Reads a table row by row.
pub(crate) struct TableReader<R> {
    path: PathBuf,
    batches: RowBatches,
    columns: Vec<Column>,
    /// Number of buffered rows that have not been returned.
    left: usize,
    /// Number of returned rows, for error messages.
    taken: usize,
    kind: PhantomData<R>,
}

impl<R: Row> TableReader<R> {
    pub(crate) fn open(path: PathBuf) -> Result<Self, RecordError> {
        let source = source(&path)?;
        Self::of(path, R::columns(), [source])
    }

    /// Reads these columns from several sources in sequence and skips all other columns; `path` is for error messages.
    pub(crate) fn of(
        path: PathBuf,
        columns: Vec<Column>,
        sources: impl IntoIterator<Item = Source>,
    ) -> Result<Self, RecordError> {
        let requested: Vec<_> = columns.iter().map(|column| (column.name(), column.physical())).collect();
        let batches = RowBatches::new(sources, &requested).map_err(|error| RecordError::parquet_read(&path, error))?;
        Ok(Self { path, batches, columns, left: 0, taken: 0, kind: PhantomData })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Number of rows according to the metadata: the total before the first row is read.
    pub(crate) fn rows(&self) -> u64 {
        self.batches.rows()
    }

    /// Returns the next row, or `None` after the last.
    pub(crate) fn next_row(&mut self) -> Result<Option<R>, RecordError> {
        if self.left == 0 {
            let read = self.batches.next(GROUP_ROWS, |column, reader, rows| self.columns[column].read(reader, rows));
            self.left = read.map_err(|error| RecordError::parquet_read(&self.path, error))?;
            if self.left == 0 {
                return Ok(None);
            }
        }
        self.left -= 1;
        self.taken += 1;
        let row = R::get(&mut self.columns.iter_mut());
        row.map(Some).map_err(|fault| RecordError::damaged(&self.path, format!("row {}: {fault}", self.taken)))
    }
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::FileReader;
    use parquet::file::serialized_reader::SerializedFileReader;

    use super::super::column::Field;
    use super::super::schema::TargetRow;
    use super::*;

    fn row(target: u32) -> TargetRow {
        let name = format!("target {target}");
        TargetRow { target, name }
    }

    #[test]
    fn full_row_groups_are_written_immediately() {
        let home = tempfile::tempdir().unwrap();
        for (rows, groups) in [(0, 0), (1, 1), (GROUP_ROWS, 1), (GROUP_ROWS + 1, 2)] {
            let path = home.path().join("table.parquet");
            let mut table = TableWriter::with_columns(path.clone(), TargetRow::columns()).unwrap();
            let rows = u32::try_from(rows).unwrap();
            (0..rows).for_each(|target| table.push(&row(target)).unwrap());
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
        f64::declare("target", &mut columns);
        TableWriter::with_columns(path.clone(), columns).unwrap().finish().unwrap();
        let error = TableReader::<TargetRow>::open(path).map(drop).unwrap_err().to_string();
        let expected = "column target has the type DOUBLE, not INT32; save it again with the types that it had";
        assert!(error.contains(expected), "{error}");
    }

    #[test]
    fn non_finite_number_is_refused_with_the_allowed_range() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("table.parquet");
        let columns = Position::columns();
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
    fn full_disk_gives_the_reason_of_the_system() {
        let mut table = TableWriter::with_columns(PathBuf::from("/dev/full"), TargetRow::columns()).unwrap();
        table.push(&row(0)).unwrap();
        let error = table.finish().unwrap_err();
        let RecordError::Write { path, reason } = error else {
            panic!("{error}");
        };
        assert_eq!(path, Path::new("/dev/full"));
        assert_eq!(reason.kind(), std::io::ErrorKind::StorageFull);
    }
}
