//! One Parquet file: rows go in and come out through the columns of one row group at a time.

use std::fs::File;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{SchemaDescriptor, Type};

use super::RecordError;
use super::column::{Cells, Column, Fault, What};

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
        Ok(Self { path, file, columns, rows: 0, kind: PhantomData })
    }

    /// Adds a row. After an error the table is not to be used any more.
    pub(crate) fn push(&mut self, row: &R) -> Result<(), RecordError> {
        row.put(&mut self.columns.iter_mut()).map_err(|fault| refusal(row, fault))?;
        self.rows += 1;
        if self.rows == GROUP_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    /// Writes what is left and sees it onto the disk.
    pub(crate) fn finish(mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.file.finish().map_err(|e| RecordError::parquet_write(&self.path, e))?;
        let synced = self.file.inner().sync_all();
        synced.map_err(|reason| RecordError::write(&self.path, reason))
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

fn start(file: File, columns: &[Column]) -> ParquetResult<SerializedFileWriter<File>> {
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

fn write_group(file: &mut SerializedFileWriter<File>, columns: &[Column]) -> ParquetResult<()> {
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

/// Reads a table row by row.
pub(crate) struct TableReader<R> {
    path: PathBuf,
    file: SerializedFileReader<File>,
    columns: Vec<Column>,
    /// Where each of our columns is in the file.
    places: Vec<usize>,
    next_group: usize,
    /// Rows of the group in hand that were not taken yet.
    left: usize,
    /// Rows taken, for messages.
    taken: usize,
    kind: PhantomData<R>,
}

impl<R: Row> TableReader<R> {
    pub(crate) fn open(path: PathBuf) -> Result<Self, RecordError> {
        Self::with_columns(path, R::columns())
    }

    /// Reads these columns and passes over all others.
    pub(crate) fn with_columns(path: PathBuf, columns: Vec<Column>) -> Result<Self, RecordError> {
        let file = File::open(&path).map_err(|reason| RecordError::read(&path, reason))?;
        let file = guarded(|| SerializedFileReader::new(file)).map_err(|e| RecordError::parquet_read(&path, e))?;
        let schema = file.metadata().file_metadata().schema_descr();
        let places: Result<_, _> = columns.iter().map(|c| place(c, schema)).collect();
        let places = places.map_err(|what| RecordError::damaged(&path, what))?;
        Ok(Self { path, file, columns, places, next_group: 0, left: 0, taken: 0, kind: PhantomData })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// How many rows it says it has.
    pub(crate) fn rows(&self) -> u64 {
        u64::try_from(self.file.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// The next row, or `None` after the last.
    pub(crate) fn next_row(&mut self) -> Result<Option<R>, RecordError> {
        while self.left == 0 {
            if self.next_group == self.file.num_row_groups() {
                return Ok(None);
            }
            self.left = guarded(|| self.read_group()).map_err(|e| RecordError::parquet_read(&self.path, e))?;
            self.next_group += 1;
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

    fn read_group(&mut self) -> ParquetResult<usize> {
        let group = self.file.get_row_group(self.next_group)?;
        let rows = usize::try_from(group.metadata().num_rows())?;
        for (column, place) in self.columns.iter_mut().zip(&self.places) {
            column.read(group.get_column_reader(*place)?, rows)?;
        }
        Ok(rows)
    }
}

/// Runs the parquet crate on bytes of which nobody knows where they have been: it panics on some
/// damaged files (60.1: a dictionary page that is missing, for one) where an error is due.
fn guarded<T>(read: impl FnOnce() -> ParquetResult<T>) -> ParquetResult<T> {
    // What a panic leaves half done is not used again: the error ends the reading.
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| {
        let what = "its bytes cannot be decoded".to_owned();
        Err(ParquetError::General(what))
    })
}

/// Where the column is in a file; columns that this version does not know are passed over.
fn place(column: &Column, schema: &SchemaDescriptor) -> Result<usize, String> {
    let found = schema.columns().iter().position(|c| c.path().parts() == [column.name()]);
    match found {
        Some(place) if column.fits(&schema.column(place)) => Ok(place),
        Some(_) => Err(format!("column {} has another type", column.name())),
        None => Err(format!("column {} is missing", column.name())),
    }
}

#[cfg(test)]
mod tests {
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
            assert_eq!(table.file.num_row_groups(), groups);
            (0..rows).for_each(|target| assert_eq!(table.next_row().unwrap(), Some(row(target))));
            assert_eq!(table.next_row().unwrap(), None);
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
