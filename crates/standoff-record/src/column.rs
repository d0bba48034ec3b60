//! Columns of tables: each is declared once, as a field of a row, and converts that field to Parquet and back.

use std::borrow::Cow;
use std::fmt;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::schema::types::Type;

/// Declaration of a column.
#[derive(Debug, Clone)]
pub struct Declaration {
    /// Name of the column.
    pub name: Cow<'static, str>,
    /// Meaning and unit.
    pub doc: &'static str,
    /// True if the replay page contains the column.
    pub is_on_page: bool,
}

impl Declaration {
    /// Declares a column that the replay page does not contain.
    pub fn new(name: impl Into<Cow<'static, str>>, doc: &'static str) -> Self {
        Self { name: name.into(), doc, is_on_page: false }
    }

    #[cold]
    fn fault(&self, what: ValueProblem) -> Fault {
        Fault { column: self.name.to_string(), what }
    }
}

/// Column of a table with rows of type `T`. Only what depends on the row type is here: each field of each row type has
/// its own implementation.
pub trait Column<T>: Send {
    /// Returns the declaration of the column.
    fn declaration(&self) -> &Declaration;
    /// Values of the buffered rows.
    fn buffer(&self) -> &dyn Buffer;
    /// Returns the same values, mutable.
    fn buffer_mut(&mut self) -> &mut dyn Buffer;
    /// Appends the values of rows to the buffer. The rows are mutable only because one function selects their parts for
    /// writing and reading.
    fn put(&mut self, rows: &mut [T]) -> Result<(), Fault>;
    /// Reads the values of the next rows of a row group; returns the number of rows read, and the first row whose value
    /// is invalid.
    fn read(&mut self, rows: &mut [T], reader: &mut ColumnReader) -> ParquetResult<(usize, Option<(usize, Fault)>)>;
    /// Value in a row as a number; `None` if it is null or not a number.
    fn number(&self, row: &mut T) -> Option<f64>;
}

/// Buffered values of a column.
pub trait Buffer {
    /// Returns the schema entry of the column.
    fn schema(&self, name: &str) -> ParquetResult<Type>;
    /// Returns the physical Parquet type.
    fn physical(&self) -> Physical;
    /// Writes the values as the next ones of a column chunk.
    fn write(&self, writer: &mut ColumnWriter<'_>) -> ParquetResult<()>;
    /// Empties the buffer.
    fn clear(&mut self);
}

/// Columns of a table, from left to right.
pub type Columns<T> = Vec<Box<dyn Column<T>>>;

/// Selects a part `V` of a row `T`.
pub trait Part<T, V>: Fn(&mut T) -> &mut V + Copy + Send + 'static {}

impl<T, V, F: Fn(&mut T) -> &mut V + Copy + Send + 'static> Part<T, V> for F {}

/// Field of a row, stored in one or more columns.
pub trait Field: Sized + 'static {
    /// Adds the columns of this field of rows of type `T`. A field with several columns names them itself.
    fn declare<T: 'static>(declaration: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>);

    /// Returns whether all floating-point numbers are finite.
    fn is_finite(&self) -> bool {
        true
    }
}

/// Returns the columns of a row type, empty.
pub fn columns<R: Field>() -> Columns<R> {
    let mut columns = Vec::new();
    R::declare(Declaration::new("", ""), &mut columns, |row| row);
    columns
}

/// Value stored in one column. Its `Option` is a field with nulls.
pub trait Scalar: Sized + 'static {
    /// Type of the stored value.
    type Cell: Cell;
    /// Converts the value to what is stored. Fails if the column cannot store it.
    fn encode(&self) -> Result<Self::Cell, ValueProblem>;
    /// Converts a stored value back. Fails if no row can have it.
    fn decode(cell: Self::Cell) -> Result<Self, ValueProblem>;
    /// The value as a number for the replay page; words are numbered from 0.
    fn number(&self) -> Option<f64> {
        None
    }
    /// Returns whether it is not a floating-point number, or finite.
    fn is_finite(&self) -> bool {
        true
    }
    /// Logical Parquet type of the column.
    fn logical_type() -> Option<LogicalType> {
        let physical = <Self::Cell as Cell>::Parquet::get_physical_type();
        (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String)
    }
}

/// Value that cannot be stored in its column or read from it.
#[derive(Debug, thiserror::Error)]
#[error("column {column} {what}")]
pub struct Fault {
    /// Name of the column.
    pub column: String,
    /// What is wrong with the value.
    pub what: ValueProblem,
}

/// Problem of a value.
#[derive(Debug, thiserror::Error)]
pub enum ValueProblem {
    /// Not a number, or infinite.
    #[error("is not finite")]
    NotFinite,
    /// An unsigned integer above the largest signed one.
    #[error("is too large: {0}")]
    TooLarge(u64),
    /// Any other problem, as text.
    #[error("{0}")]
    Bad(String),
}

impl<S: Scalar> Field for S {
    fn declare<T: 'static>(declaration: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        let set = move |row: &mut T, value| {
            if let Some(value) = value {
                *part(row) = value;
            }
        };
        columns.push(stored(declaration, false, move |row| Some(part(row)), set));
    }

    fn is_finite(&self) -> bool {
        Scalar::is_finite(self)
    }
}

impl<S: Scalar> Field for Option<S> {
    fn declare<T: 'static>(declaration: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        let set = move |row: &mut T, value| *part(row) = value;
        columns.push(stored(declaration, true, move |row| part(row).as_ref(), set));
    }

    fn is_finite(&self) -> bool {
        self.as_ref().is_none_or(Scalar::is_finite)
    }
}

/// Column of the field that `get` reads and `set` replaces; `None` is null.
struct Stored<S: Scalar, G, M> {
    declaration: Declaration,
    cells: Cells<S>,
    get: G,
    set: M,
}

fn stored<T, S: Scalar, G, M>(declaration: Declaration, is_optional: bool, get: G, set: M) -> Box<dyn Column<T>>
where
    G: Fn(&mut T) -> Option<&S> + Send + 'static,
    M: Fn(&mut T, Option<S>) + Send + 'static,
{
    let cells = Cells { is_optional, levels: Vec::new(), values: Vec::new() };
    Box::new(Stored { declaration, cells, get, set })
}

impl<T, S: Scalar, G, M> Column<T> for Stored<S, G, M>
where
    G: Fn(&mut T) -> Option<&S> + Send,
    M: Fn(&mut T, Option<S>) + Send,
{
    fn declaration(&self) -> &Declaration {
        &self.declaration
    }

    fn buffer(&self) -> &dyn Buffer {
        &self.cells
    }

    fn buffer_mut(&mut self) -> &mut dyn Buffer {
        &mut self.cells
    }

    fn put(&mut self, rows: &mut [T]) -> Result<(), Fault> {
        for row in rows {
            if let Err(what) = self.cells.put((self.get)(row)) {
                return Err(self.declaration.fault(what));
            }
        }
        Ok(())
    }

    fn read(&mut self, rows: &mut [T], reader: &mut ColumnReader) -> ParquetResult<(usize, Option<(usize, Fault)>)> {
        let (found, values, problem) = self.cells.read(rows.len(), reader)?;
        let valid = values.len();
        for (row, value) in rows.iter_mut().zip(values) {
            (self.set)(row, value);
        }
        Ok((found, problem.map(|what| (valid, self.declaration.fault(what)))))
    }

    fn number(&self, row: &mut T) -> Option<f64> {
        (self.get)(row)?.number()
    }
}

struct Cells<S: Scalar> {
    is_optional: bool,
    /// One level per row, 1 for a value and 0 for null; empty if no row can be null.
    levels: Vec<i16>,
    /// Values of the rows that are not null.
    values: Vec<S::Cell>,
}

impl<S: Scalar> Cells<S> {
    // Not inlined, because every field of every row type calls it.
    #[inline(never)]
    fn put(&mut self, value: Option<&S>) -> Result<(), ValueProblem> {
        if self.is_optional {
            self.levels.push(i16::from(value.is_some()));
        }
        self.values.extend(value.map(S::encode).transpose()?);
        Ok(())
    }

    /// Reads the values of at most `rows` rows; returns the number of rows read, their values up to the first invalid
    /// one, and its problem.
    #[inline(never)]
    fn read(
        &mut self,
        rows: usize,
        reader: &mut ColumnReader,
    ) -> ParquetResult<(usize, Vec<Option<S>>, Option<ValueProblem>)> {
        self.clear();
        let reader = S::Cell::reader(reader).ok_or_else(wrong_type)?;
        let (found, ..) = reader.read_records(rows, Some(&mut self.levels), None, &mut self.values)?;
        let bad = |what: &str| Err(ValueProblem::Bad(what.to_owned()));
        let (mut read, mut cells) = (Vec::with_capacity(found), self.values.drain(..));
        for row in 0..found {
            let is_null = self.levels.get(row) == Some(&0);
            let value = match if is_null { None } else { cells.next() } {
                Some(cell) => S::decode(cell).map(Some),
                None if !is_null => bad("has fewer values than its table has rows"),
                None if self.is_optional => Ok(None),
                None => bad("is null"),
            };
            match value {
                Ok(value) => read.push(value),
                Err(problem) => return Ok((found, read, Some(problem))),
            }
        }
        Ok((found, read, None))
    }
}

impl<S: Scalar> Buffer for Cells<S> {
    fn schema(&self, name: &str) -> ParquetResult<Type> {
        Type::primitive_type_builder(name, self.physical())
            .with_repetition(if self.is_optional { Repetition::OPTIONAL } else { Repetition::REQUIRED })
            .with_logical_type(S::logical_type())
            .build()
    }

    fn physical(&self) -> Physical {
        <S::Cell as Cell>::Parquet::get_physical_type()
    }

    fn write(&self, writer: &mut ColumnWriter<'_>) -> ParquetResult<()> {
        let writer = <S::Cell as Cell>::Parquet::get_column_writer_mut(writer).ok_or_else(wrong_type)?;
        writer.write_batch(&self.values, self.is_optional.then_some(&self.levels), None).map(drop)
    }

    fn clear(&mut self) {
        self.levels.clear();
        self.values.clear();
    }
}

/// Unreachable: the schema has the type of the column, and the reader checks it.
fn wrong_type() -> ParquetError {
    ParquetError::General("a column has another type".to_owned())
}

/// Type of the values in a column.
pub trait Cell: Send + 'static {
    /// Parquet type.
    type Parquet: DataType<T = Self>;
    /// Returns the reader of a column of this type; `None` for one of another type.
    fn reader(reader: &mut ColumnReader) -> Option<&mut ColumnReaderImpl<Self::Parquet>>;
}

macro_rules! cells {
    ($($cell:ty, $parquet:ty, $reader:ident;)+) => {
        $(impl Cell for $cell {
            type Parquet = $parquet;

            fn reader(reader: &mut ColumnReader) -> Option<&mut ColumnReaderImpl<$parquet>> {
                if let ColumnReader::$reader(reader) = reader { Some(reader) } else { None }
            }
        })+
    };
}

cells! {
    i64, Int64Type, Int64ColumnReader;
    i32, Int32Type, Int32ColumnReader;
    f64, DoubleType, DoubleColumnReader;
    bool, BoolType, BoolColumnReader;
    ByteArray, ByteArrayType, ByteArrayColumnReader;
}

/// Columns of a row type that the replay page contains.
pub struct PageColumns<R>(Columns<R>);

impl<R: Clone> PageColumns<R> {
    /// Names of the columns.
    pub fn names(&self) -> impl Iterator<Item = Cow<'static, str>> {
        self.0.iter().map(|column| column.declaration().name.clone())
    }

    /// Values of a row, in the order of the names: numbers in the unit of the column, 0 or 1 for false and true, and
    /// the index of a word in the order of its type. `None` for null and without a row.
    pub fn values(&self, row: Option<&R>) -> impl Iterator<Item = Option<f64>> {
        let mut row = row.cloned();
        self.0.iter().map(move |column| column.number(row.as_mut()?))
    }
}

impl<R: Field> Default for PageColumns<R> {
    fn default() -> Self {
        Self(columns().into_iter().filter(|column| column.declaration().is_on_page).collect())
    }
}

impl<R: Clone> fmt::Debug for PageColumns<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

/// Row of a table. The same columns are used for writing and reading.
pub trait Row: Field + Clone + Default + Send + 'static {
    /// Name of the table; the file is `<name>.parquet`.
    const TABLE: &'static str;
    /// Name of the table of these rows of all agents; empty if there is none.
    const OF_AGENTS: &'static str = "";
    /// Time of the row for error messages, s.
    fn time_s(&self) -> f64 {
        0.0
    }
}

/// Defines row types and their tables (that of the team, and that of each agent if there is one): one column per field,
/// with the same name, in this order. A comment before a field gives the meaning and unit of its column;
/// `docs/user/record.md` repeats it. `#[on(page)]` adds the column to the data of the replay page.
macro_rules! rows {
    ($(
        $(#[doc = $about:literal])+
        $(#[derive($($derive:ident),+)])?
        $vis:vis struct $row:ident in $table:literal $(and $of_agents:literal)? {
            $($(#[doc = $doc:literal])+ $(#[on($page:ident)])? pub $field:ident: $type:ty,)+
        }
    )+) => {$(
        $(#[doc = $about])+
        #[derive(Debug, Clone, Default, PartialEq, $($($derive),+)?)]
        $vis struct $row {
            $($(#[doc = $doc])+ pub $field: $type,)+
        }

        impl $crate::column::Field for $row {
            fn declare<T: 'static>(
                _: $crate::column::Declaration,
                columns: &mut $crate::column::Columns<T>,
                part: impl $crate::column::Part<T, Self>,
            ) {
                use $crate::column::{Declaration, Field};
                $(
                    let declaration = Declaration::new(stringify!($field), concat!($($doc),+).trim_ascii());
                    let is_on_page = !concat!($(stringify!($page))?).is_empty();
                    <$type as Field>::declare(
                        Declaration { is_on_page, ..declaration }, columns, move |row| &mut part(row).$field);
                )+
            }

            fn is_finite(&self) -> bool {
                $($crate::column::Field::is_finite(&self.$field))&&+
            }
        }

        impl $crate::column::Row for $row {
            const TABLE: &'static str = $table;
            $(const OF_AGENTS: &'static str = $of_agents;)?
        }
    )+};
}
pub(crate) use rows;
