//! Result tables: as zero-copy Arrow streams, or as one NumPy array per column.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch, RecordBatchReader};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, DataType, SchemaRef};
use numpy::IntoPyArray;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyTuple};
use standoff_io::parquet_file::{Error, guarded};

use crate::exceptions::{InputError, StandoffError};
use crate::pread_file::Positional;

/// Number of rows per record batch.
const ROWS: usize = 65_536;

/// A result table in a Parquet file, read on demand.
///
/// It supports the Arrow C data interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``,
/// ``pandas.DataFrame.from_arrow(table)`` and DuckDB's ``select * from table`` read it without a copy.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Table {
    file: Positional,
    metadata: ArrowReaderMetadata,
    /// Path of the file, for messages.
    path: String,
    /// Object whose life keeps a temporary folder from being deleted.
    _owner: Option<Py<PyAny>>,
}

impl Table {
    /// Opens the table in a file. The table holds a reference to `owner`, whose temporary folder may contain the file.
    pub(crate) fn open(path: &Path, owner: Option<Py<PyAny>>) -> PyResult<Self> {
        let shown = path.display().to_string();
        let opened = File::open(path).map_err(Error::from).and_then(|file| {
            let metadata = guarded(|| ArrowReaderMetadata::load(&file, Default::default()))?;
            Ok((Positional(Arc::new(file)), metadata))
        });
        let (file, metadata) = opened.map_err(|error| refusal(&shown, error))?;
        Ok(Self { file, metadata, path: shown, _owner: owner })
    }

    fn schema(&self) -> &SchemaRef {
        self.metadata.schema()
    }

    /// Makes a reader of these columns.
    fn reader(&self, columns: ProjectionMask) -> PyResult<Guarded> {
        let read = guarded(|| {
            let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(self.file.clone(), self.metadata.clone());
            builder.with_batch_size(ROWS).with_projection(columns).build()
        });
        read.map(|reader| Guarded { schema: reader.schema(), reader }).map_err(|error| refusal(&self.path, error))
    }
}

fn refusal(path: &str, error: Error) -> PyErr {
    match error {
        Error::System(reason) => StandoffError::new_err(format!("{path}: cannot be read: {reason}")),
        error => InputError::new_err(format!("{path}: damaged: {error}")),
    }
}

/// A reader that returns panics as errors, because it is called from C.
struct Guarded {
    schema: SchemaRef,
    reader: ParquetRecordBatchReader,
}

impl Iterator for Guarded {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        guarded(|| Ok(self.reader.next()))
            .unwrap_or_else(|error| Some(Err(ArrowError::ParquetError(error.to_string()))))
    }
}

impl RecordBatchReader for Guarded {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }
}

#[pymethods]
impl Table {
    /// Names of the columns, in order.
    #[getter]
    fn column_names(&self) -> Vec<String> {
        self.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// Number of rows.
    #[getter]
    fn num_rows(&self) -> i64 {
        self.metadata.metadata().file_metadata().num_rows()
    }

    fn __len__(&self) -> usize {
        usize::try_from(self.num_rows()).unwrap_or_default()
    }

    /// Reads one column as a NumPy array, shape ``(num_rows,)``.
    ///
    /// Numeric columns with missing values become float64 with NaN. Text columns, and boolean columns with missing
    /// values, become object arrays with None.
    ///
    /// :param column: name of the column; its suffix is the unit.
    /// :returns: a new array of float64, int64, int32, bool or object.
    /// :raises KeyError: if no column has this name.
    fn to_numpy<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        let place = self.schema().index_of(column).map_err(|_| {
            let names = self.column_names().join(", ");
            PyKeyError::new_err(format!("no column {column:?}; columns: {names}"))
        })?;
        let schema = self.metadata.metadata().file_metadata().schema_descr();
        let reader = self.reader(ProjectionMask::leaves(schema, [place]))?;
        let read = py.detach(|| reader.map(|batch| batch.map(|batch| Arc::clone(batch.column(0)))).collect());
        let arrays: Vec<ArrayRef> =
            Result::map_err(read, |error: ArrowError| InputError::new_err(format!("{}: damaged: {error}", self.path)))?;
        in_numpy(py, self.schema().field(place).data_type(), &arrays)
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
        let stream = FFI_ArrowArrayStream::new(Box::new(self.reader(ProjectionMask::all())?));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream").map(Bound::into_any)
    }

    /// Exports names and types of the columns as a schema of the Arrow C data interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let schema = FFI_ArrowSchema::try_from(self.schema().as_ref());
        let schema = schema.map_err(|error| InputError::new_err(format!("{}: {error}", self.path)))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema").map(Bound::into_any)
    }

    fn __repr__(&self) -> String {
        format!("Table({} rows: {})", self.num_rows(), self.column_names().join(", "))
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
