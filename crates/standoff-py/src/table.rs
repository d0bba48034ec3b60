//! Tables of results: Arrow for whoever reads it, without a copy, and NumPy, a column at a time.

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
use standoff_parquet::{Error, Source, guarded};

use crate::failure::{InputError, StandoffError};
use crate::positional::Positional;

/// Rows that are read at a time.
const ROWS: usize = 65_536;

/// A table of results in a Parquet file, read when it is asked for.
///
/// It speaks Arrow's C data interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``,
/// ``pandas.DataFrame.from_arrow(table)`` and DuckDB's ``select * from table`` take it over without a copy.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Table {
    file: Positional,
    metadata: ArrowReaderMetadata,
    /// The file's path, for messages.
    path: String,
    /// What keeps the file where it is.
    _owner: Option<Py<PyAny>>,
}

impl Table {
    /// The table in a file, which `owner` may have to keep where it is.
    pub(crate) fn open(path: &Path, owner: Option<Py<PyAny>>) -> PyResult<Self> {
        let told = path.display().to_string();
        let opened = File::open(path).map_err(Error::from).and_then(|file| {
            // It looks at what the file says of itself before anybody believes it.
            Source::open(file.try_clone()?)?;
            let metadata = guarded(|| ArrowReaderMetadata::load(&file, Default::default()))?;
            Ok((Positional(Arc::new(file)), metadata))
        });
        let (file, metadata) = opened.map_err(|error| refusal(&told, error))?;
        Ok(Self { file, metadata, path: told, _owner: owner })
    }

    fn schema(&self) -> &SchemaRef {
        self.metadata.schema()
    }

    /// Reads these columns.
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

/// A reader whose panics are errors: it is called from C.
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
    /// Names of the columns, in their order.
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

    /// One column as a NumPy array, shape ``(num_rows,)``.
    ///
    /// Numbers where some are missing are float64 with NaN there; text, and truths where some are missing, are
    /// objects with None.
    ///
    /// :param column: its name; the unit stands behind it.
    /// :returns: a new array of float64, int64, int32, bool or object.
    /// :raises KeyError: there is no such column.
    fn to_numpy<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        let place = self.schema().index_of(column).map_err(|_| {
            let names = self.column_names().join(", ");
            PyKeyError::new_err(format!("no column {column:?}; there are {names}"))
        })?;
        let schema = self.metadata.metadata().file_metadata().schema_descr();
        let reader = self.reader(ProjectionMask::leaves(schema, [place]))?;
        let read = py.detach(|| reader.map(|batch| batch.map(|batch| Arc::clone(batch.column(0)))).collect());
        let arrays: Vec<ArrayRef> =
            Result::map_err(read, |error: ArrowError| InputError::new_err(format!("{}: damaged: {error}", self.path)))?;
        in_numpy(py, self.schema().field(place).data_type(), &arrays)
    }

    /// The table as a stream of Arrow's C data interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Whoever asks for other types must cast: the protocol leaves it to the producer whether it does.
        drop(requested_schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(self.reader(ProjectionMask::all())?));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream").map(Bound::into_any)
    }

    /// Names and types of the columns as a schema of Arrow's C data interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let schema = FFI_ArrowSchema::try_from(self.schema().as_ref());
        let schema = schema.map_err(|error| InputError::new_err(format!("{}: {error}", self.path)))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema").map(Bound::into_any)
    }

    fn __repr__(&self) -> String {
        format!("Table({} rows: {})", self.num_rows(), self.column_names().join(", "))
    }
}

/// The parts of a column, as one array.
fn in_numpy<'py>(py: Python<'py>, kind: &DataType, parts: &[ArrayRef]) -> PyResult<Bound<'py, PyAny>> {
    let is_full = parts.iter().all(|part| part.null_count() == 0);
    /// Values as they are; or, with some missing, as floating-point numbers.
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
        other => return Err(InputError::new_err(format!("a column of {other}: read it by Arrow"))),
    })
}

/// An array of objects.
fn objects<'py>(
    py: Python<'py>,
    values: impl Iterator<Item = Option<impl IntoPyObject<'py>>>,
) -> PyResult<Bound<'py, PyAny>> {
    let values = PyTuple::new(py, values.collect::<Vec<_>>())?;
    py.import("numpy")?.call_method1("array", (values, "O"))
}
