//! Result tables: as zero-copy Arrow streams, as one NumPy array per column, or as a data frame.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int32Type, Int64Type, TimestampMicrosecondType};
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int32Array, Int64Array, RecordBatch, RecordBatchIterator,
    RecordBatchReader, StringArray,
};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef, TimeUnit};
use numpy::IntoPyArray;
use parquet::basic::{LogicalType, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result as ParquetResult};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyTuple};
use standoff_io::display_text::nearest;
use standoff_io::parquet_file::{Error, RowBatches, Source};

use crate::exceptions::{InputError, StandoffError};

/// Number of rows per record batch.
const ROWS: usize = 65_536;

/// A result table.
///
/// ``table["x_m"]`` is a column as a NumPy array, :attr:`columns` lists the columns, and ``len(table)`` is the number of
/// rows. :meth:`to_pandas` and :meth:`to_polars` make data frames. A table of a file is read on demand.
///
/// It supports the Arrow C data interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``,
/// ``pandas.DataFrame.from_arrow(table)`` and DuckDB's ``select * from table`` read it without a copy.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Table {
    contents: Contents,
    /// Path of the file or name of the table, for messages.
    name: String,
    /// Object whose life keeps a temporary folder from being deleted.
    _owner: Option<Py<PyAny>>,
}

/// Place of a table's rows.
enum Contents {
    File { file: Source, schema: SchemaRef },
    Memory(RecordBatch),
}

/// Column of a table in memory.
pub(crate) enum Column {
    Text(Vec<Option<String>>),
    Float(Vec<Option<f64>>),
    Integer(Vec<Option<i64>>),
    Boolean(Vec<Option<bool>>),
}

impl Table {
    /// Opens the table in a file. The table holds a reference to `owner`, whose temporary folder may contain the file.
    pub(crate) fn open(path: &Path, owner: Option<Py<PyAny>>) -> PyResult<Self> {
        let shown = path.display().to_string();
        let opened = File::open(path).map_err(Error::from).and_then(|file| {
            let file = Source::open(file)?;
            let schema = arrow_schema_of(&file)?;
            Ok(Contents::File { file, schema })
        });
        let contents = opened.map_err(|error| refusal(&shown, error))?;
        Ok(Self { contents, name: shown, _owner: owner })
    }

    /// Makes a table of columns of equal length.
    pub(crate) fn in_memory(name: &str, columns: Vec<(&str, Column)>) -> PyResult<Self> {
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns
            .into_iter()
            .map(|(name, column)| {
                let array: ArrayRef = match column {
                    Column::Text(values) => Arc::new(StringArray::from(values)),
                    Column::Float(values) => Arc::new(Float64Array::from(values)),
                    Column::Integer(values) => Arc::new(Int64Array::from(values)),
                    Column::Boolean(values) => Arc::new(BooleanArray::from(values)),
                };
                (Field::new(name, array.data_type().clone(), true), array)
            })
            .unzip();
        let batch = RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays);
        let batch = batch.map_err(|error| StandoffError::new_err(format!("{name}: {error}")))?;
        Ok(Self { contents: Contents::Memory(batch), name: name.to_owned(), _owner: None })
    }

    fn schema(&self) -> &SchemaRef {
        match &self.contents {
            Contents::File { schema, .. } => schema,
            Contents::Memory(batch) => batch.schema_ref(),
        }
    }

    /// Makes a reader of one column, or of all.
    fn reader(&self, column: Option<usize>) -> PyResult<Box<dyn RecordBatchReader + Send>> {
        match &self.contents {
            Contents::File { file, schema } => {
                let schema = match column {
                    Some(column) => Arc::new(Schema::new(vec![schema.field(column).clone()])),
                    None => Arc::clone(schema),
                };
                let columns: Vec<_> =
                    schema.fields().iter().map(|field| (field.name().as_str(), physical(field))).collect();
                let batches = RowBatches::new([file.clone()], &columns).map_err(|error| refusal(&self.name, error))?;
                Ok(Box::new(FileReader { schema, batches }))
            }
            Contents::Memory(batch) => {
                let projected = column.map_or_else(|| Ok(batch.clone()), |column| batch.project(&[column]));
                let batch = projected.map_err(|error| StandoffError::new_err(format!("{}: {error}", self.name)))?;
                let schema = batch.schema();
                Ok(Box::new(RecordBatchIterator::new([Ok(batch)], schema)))
            }
        }
    }
}

fn refusal(path: &str, error: Error) -> PyErr {
    match error {
        Error::System(reason) => StandoffError::new_err(format!("{path}: cannot be read: {reason}")),
        error => InputError::new_err(format!("{path}: damaged: {error}")),
    }
}

/// Types of the columns of a file. Fails if a column has a type that no table of results has.
fn arrow_schema_of(file: &Source) -> Result<SchemaRef, Error> {
    let field = |column: &Arc<parquet::schema::types::ColumnDescriptor>| {
        let name = column.path().string();
        let kind = match column.physical_type() {
            Physical::INT64 if matches!(column.logical_type_ref(), Some(LogicalType::Timestamp(_))) => utc(),
            Physical::DOUBLE => DataType::Float64,
            Physical::INT64 => DataType::Int64,
            Physical::INT32 => DataType::Int32,
            Physical::BOOLEAN => DataType::Boolean,
            Physical::BYTE_ARRAY => DataType::Utf8,
            other => return Err(Error::Foreign(format!("column {name} has the type {other}"))),
        };
        Ok(Field::new(name, kind, column.max_def_level() > 0))
    };
    let fields = file.schema().columns().iter().map(field).collect::<Result<Vec<_>, _>>()?;
    Ok(Arc::new(Schema::new(fields)))
}

/// Type of a time in UTC.
fn utc() -> DataType {
    DataType::Timestamp(TimeUnit::Microsecond, Some("UTC".into()))
}

/// Parquet type of a column.
fn physical(field: &Field) -> Physical {
    match field.data_type() {
        DataType::Float64 => Physical::DOUBLE,
        DataType::Int64 | DataType::Timestamp(..) => Physical::INT64,
        DataType::Int32 => Physical::INT32,
        DataType::Boolean => Physical::BOOLEAN,
        _ => Physical::BYTE_ARRAY,
    }
}

/// Reader of the record batches of a file.
struct FileReader {
    schema: SchemaRef,
    batches: RowBatches,
}

impl FileReader {
    fn next_batch(&mut self) -> Result<Option<RecordBatch>, ArrowError> {
        let mut arrays: Vec<ArrayRef> = Vec::with_capacity(self.schema.fields().len());
        let read = self.batches.next(ROWS, |column, reader, rows| {
            let is_optional = self.schema.field(column).is_nullable();
            let (array, found) = read_array(reader, rows, is_optional)?;
            arrays.push(if *self.schema.field(column).data_type() == utc() { in_utc(&array) } else { array });
            Ok(found)
        });
        match read.map_err(|error| ArrowError::ParquetError(error.to_string()))? {
            0 => Ok(None),
            _ => RecordBatch::try_new(Arc::clone(&self.schema), arrays).map(Some),
        }
    }
}

/// Converts microseconds to times.
fn in_utc(array: &ArrayRef) -> ArrayRef {
    Arc::new(array.as_primitive::<Int64Type>().reinterpret_cast::<TimestampMicrosecondType>().with_timezone("UTC"))
}

impl Iterator for FileReader {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_batch().transpose()
    }
}

impl RecordBatchReader for FileReader {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }
}

/// Reads the next rows of a column; returns also their number.
fn read_array(reader: &mut ColumnReader, rows: usize, is_optional: bool) -> ParquetResult<(ArrayRef, usize)> {
    /// Makes the array from the values, or from values and nulls.
    macro_rules! array {
        ($reader:expr, $array:ty) => {{
            let (values, levels, found) = read_values($reader, rows, is_optional)?;
            let array: ArrayRef = match levels {
                None => Arc::new(<$array>::from(values)),
                Some(levels) => {
                    let mut values = values.into_iter();
                    Arc::new(levels.into_iter().map(|level| values.next_if_is(level)).collect::<$array>())
                }
            };
            (array, found)
        }};
    }
    Ok(match reader {
        ColumnReader::DoubleColumnReader(reader) => array!(reader, Float64Array),
        ColumnReader::Int64ColumnReader(reader) => array!(reader, Int64Array),
        ColumnReader::Int32ColumnReader(reader) => array!(reader, Int32Array),
        ColumnReader::BoolColumnReader(reader) => array!(reader, BooleanArray),
        ColumnReader::ByteArrayColumnReader(reader) => {
            let (values, levels, found) = read_values(reader, rows, is_optional)?;
            let text = |bytes: &ByteArray| bytes.as_utf8().map(str::to_owned);
            let texts = values.iter().map(text).collect::<ParquetResult<Vec<String>>>()?;
            let array = match levels {
                None => StringArray::from(texts),
                Some(levels) => {
                    let mut texts = texts.into_iter();
                    levels.into_iter().map(|level| texts.next_if_is(level)).collect()
                }
            };
            (Arc::new(array), found)
        }
        _ => return Err(ParquetError::General("a column has an unexpected type".to_owned())),
    })
}

/// Values of optional columns, which are stored without the nulls.
trait NextIfIs: Iterator {
    /// Returns the next value if the definition level states that there is one.
    fn next_if_is(&mut self, level: i16) -> Option<Self::Item> {
        if level > 0 { self.next() } else { None }
    }
}

impl<I: Iterator> NextIfIs for I {}

/// Values that are not null; the definition level of every row if the column is optional; and the number of rows.
type Values<T> = (Vec<T>, Option<Vec<i16>>, usize);

fn read_values<T: parquet::data_type::DataType>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    is_optional: bool,
) -> ParquetResult<Values<T::T>> {
    let (mut values, mut levels, mut found) = (Vec::new(), is_optional.then(Vec::new), 0);
    while found < rows {
        match reader.read_records(rows - found, levels.as_mut(), None, &mut values)?.0 {
            0 => break,
            records => found += records,
        }
    }
    Ok((values, levels, found))
}

#[pymethods]
impl Table {
    /// Names of the columns, in order; the suffix of a name is the unit.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    fn __len__(&self) -> usize {
        match &self.contents {
            Contents::File { file, .. } => usize::try_from(file.rows()).unwrap_or_default(),
            Contents::Memory(batch) => batch.num_rows(),
        }
    }

    /// Returns one column, as :meth:`to_numpy`.
    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        self.to_numpy(py, column)
    }

    fn __contains__(&self, column: &str) -> bool {
        self.schema().index_of(column).is_ok()
    }

    /// Iterates over the rows, as tuples that know the names of the columns: ``pandas.DataFrame(table)`` uses them.
    /// :meth:`to_pandas` is faster.
    fn __iter__<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        this.py().import("standoff._frames")?.call_method1("rows", (this,))
    }

    /// Makes a ``pandas.DataFrame``; needs pandas 2 or newer, not pyarrow.
    ///
    /// Numeric columns with missing values become float64 with NaN.
    ///
    /// :returns: a new data frame with the columns of the table.
    fn to_pandas<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        this.py().import("standoff._frames")?.call_method1("to_pandas", (this,))
    }

    /// Makes a ``polars.DataFrame`` without a copy; needs polars.
    fn to_polars<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        this.py().import("standoff._frames")?.call_method1("to_polars", (this,))
    }

    /// Reads one column as a NumPy array, shape ``(len(table),)``.
    ///
    /// Numeric columns with missing values become float64 with NaN. Text columns, and boolean columns with missing
    /// values, become object arrays with None. Times in UTC become datetime64[us].
    ///
    /// :param column: name of the column; its suffix is the unit.
    /// :returns: a new array of float64, int64, int32, bool, datetime64 or object.
    /// :raises KeyError: if no column has this name.
    fn to_numpy<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        let place = self.schema().index_of(column).map_err(|_| {
            let names = self.columns();
            let similar = nearest(column, &names.iter().map(String::as_str).collect::<Vec<_>>());
            let suggestion = similar.map_or_else(String::new, |name| format!("; did you mean {name:?}?"));
            PyKeyError::new_err(format!("no column {column:?}{suggestion}; columns: {}", names.join(", ")))
        })?;
        let reader = self.reader(Some(place))?;
        let read = py.detach(|| reader.map(|batch| batch.map(|batch| Arc::clone(batch.column(0)))).collect());
        let arrays: Vec<ArrayRef> =
            Result::map_err(read, |error: ArrowError| InputError::new_err(format!("{}: damaged: {error}", self.name)))?;
        in_numpy(py, self.schema().field(place).data_type(), &arrays)
    }

    /// Returns the first rows, at most those of a record batch, as a table in memory.
    fn _head(&self, rows: usize) -> PyResult<Self> {
        let batch = match self.reader(None)?.next() {
            Some(batch) => batch.map_err(|error| InputError::new_err(format!("{}: damaged: {error}", self.name)))?,
            None => RecordBatch::new_empty(Arc::clone(self.schema())),
        };
        let head = batch.slice(0, rows.min(batch.num_rows()));
        Ok(Self { contents: Contents::Memory(head), name: self.name.clone(), _owner: None })
    }

    /// Exports the table as a stream of the Arrow C data interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // The protocol allows the producer to ignore the requested schema; the consumer then casts.
        drop(requested_schema);
        let stream = FFI_ArrowArrayStream::new(self.reader(None)?);
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream").map(Bound::into_any)
    }

    /// Exports names and types of the columns as a schema of the Arrow C data interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let schema = FFI_ArrowSchema::try_from(self.schema().as_ref());
        let schema = schema.map_err(|error| InputError::new_err(format!("{}: {error}", self.name)))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema").map(Bound::into_any)
    }

    fn __repr__(&self) -> String {
        format!("Table({} rows: {})", self.__len__(), self.columns().join(", "))
    }

    /// HTML for notebooks: the first rows.
    fn _repr_html_(this: &Bound<'_, Self>) -> PyResult<String> {
        this.py().import("standoff._frames")?.call_method1("html", (this,))?.extract()
    }
}

/// Concatenates the parts of a column into one NumPy array.
fn in_numpy<'py>(py: Python<'py>, kind: &DataType, parts: &[ArrayRef]) -> PyResult<Bound<'py, PyAny>> {
    let is_full = parts.iter().all(|part| part.null_count() == 0);
    /// Values unchanged or, if some are missing, as floating-point numbers with NaN.
    macro_rules! numbers {
        ($kind:ty) => {{
            let parts = parts.iter().map(|part| part.as_primitive::<$kind>());
            if is_full {
                let values: Vec<_> = parts.flat_map(|part| part.values().iter().copied()).collect();
                values.into_pyarray(py).into_any()
            } else {
                let value = |value: Option<_>| value.map_or(f64::NAN, |value| value as f64);
                let values: Vec<f64> = parts.flat_map(|part| part.iter().map(value)).collect();
                values.into_pyarray(py).into_any()
            }
        }};
    }
    Ok(match kind {
        DataType::Float64 => numbers!(Float64Type),
        DataType::Int64 => numbers!(Int64Type),
        DataType::Int32 => numbers!(Int32Type),
        DataType::Timestamp(..) => {
            let parts = parts.iter().map(|part| part.as_primitive::<TimestampMicrosecondType>());
            let values: Vec<i64> = parts.flat_map(|part| part.values().iter().copied()).collect();
            values.into_pyarray(py).call_method1("astype", ("datetime64[us]",))?
        }
        DataType::Boolean => {
            let values = parts.iter().flat_map(|part| part.as_boolean().iter());
            match values.collect::<Option<Vec<bool>>>() {
                Some(values) => values.into_pyarray(py).into_any(),
                None => objects(py, parts.iter().flat_map(|part| part.as_boolean().iter()))?,
            }
        }
        DataType::Utf8 => objects(py, parts.iter().flat_map(|part| part.as_string::<i32>().iter()))?,
        other => {
            let what = format!("a column of type {other} cannot be converted to NumPy: read it through Arrow");
            return Err(InputError::new_err(what));
        }
    })
}

/// Makes an object array.
fn objects<'py>(
    py: Python<'py>,
    values: impl Iterator<Item = Option<impl IntoPyObject<'py>>>,
) -> PyResult<Bound<'py, PyAny>> {
    let values = PyTuple::new(py, values.collect::<Vec<_>>())?;
    py.import("numpy")?.call_method1("array", (values, "O"))
}
