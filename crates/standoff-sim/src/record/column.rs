//! One column of a table in memory: conversion between fields of rows and Parquet.

use std::slice::IterMut;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::schema::types::Type;

/// Columns of a table, iterated from left to right to put or get one row.
pub(crate) type Cells<'a> = IterMut<'a, Column>;

/// Field of a row, stored in one or more columns.
pub(crate) trait Field: Sized {
    fn declare(name: &str, columns: &mut Vec<Column>);
    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault>;
    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault>;
}

/// Value stored in one column. Its `Option` is a field with nulls.
pub(crate) trait Scalar: Sized {
    type Cell: Cell;
    fn encode(&self) -> Result<Self::Cell, ValueProblem>;
    fn decode(cell: Self::Cell) -> Result<Self, ValueProblem>;
}

/// Value that cannot be stored in its column or read from it.
#[derive(Debug, thiserror::Error)]
#[error("column {column} {what}")]
pub(crate) struct Fault {
    pub(crate) column: String,
    pub(crate) what: ValueProblem,
}

/// Problem of a value.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ValueProblem {
    #[error("is not finite")]
    NotFinite,
    #[error("is too large: {0}")]
    TooLarge(u64),
    #[error("{0}")]
    Bad(String),
}

impl<T: Scalar> Field for T {
    fn declare(name: &str, columns: &mut Vec<Column>) {
        columns.push(Column::new::<T::Cell>(name, false));
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        let column = next(cells)?;
        let put = self.encode().and_then(|cell| column.push(Some(cell)));
        put.map_err(|what| column.fault(what))
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        let column = next(cells)?;
        let null = || ValueProblem::Bad("is null".to_owned());
        let got = column.pop().and_then(|cell| cell.ok_or_else(null));
        got.and_then(T::decode).map_err(|what| column.fault(what))
    }
}

impl<T: Scalar> Field for Option<T> {
    fn declare(name: &str, columns: &mut Vec<Column>) {
        columns.push(Column::new::<T::Cell>(name, true));
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        let column = next(cells)?;
        let cell = self.as_ref().map(T::encode).transpose();
        cell.and_then(|cell| column.push(cell)).map_err(|what| column.fault(what))
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        let column = next(cells)?;
        let got = column.pop().and_then(|cell| cell.map(T::decode).transpose());
        got.map_err(|what| column.fault(what))
    }
}

fn next<'a>(cells: &mut Cells<'a>) -> Result<&'a mut Column, Fault> {
    cells.next().ok_or_else(|| Fault {
        column: "the row".to_owned(),
        what: ValueProblem::Bad("has more fields than the table has columns".to_owned()),
    })
}

/// Column: its name and its values of the buffered rows.
pub(crate) struct Column {
    name: String,
    optional: bool,
    /// One level per row, 1 for a value and 0 for null; empty if no row is null.
    levels: Vec<i16>,
    values: Values,
    /// Number of rows that were read.
    rows_taken: usize,
    /// Number of values that were read: nulls have none.
    values_taken: usize,
}

impl Column {
    fn new<T: Cell>(name: &str, optional: bool) -> Self {
        Self { name: name.to_owned(), optional, levels: Vec::new(), values: T::empty(), rows_taken: 0, values_taken: 0 }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the schema entry of the column.
    pub(crate) fn schema(&self) -> ParquetResult<Type> {
        let repetition = if self.optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        let text = matches!(self.values, Values::Text(_));
        let logical = text.then_some(LogicalType::String);
        Type::primitive_type_builder(&self.name, self.values.physical())
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()
    }

    /// Returns the physical Parquet type.
    pub(crate) fn physical(&self) -> Physical {
        self.values.physical()
    }

    pub(crate) fn clear(&mut self) {
        self.levels.clear();
        self.values.clear();
        (self.rows_taken, self.values_taken) = (0, 0);
    }

    pub(crate) fn write(&self, writer: &mut ColumnWriter<'_>) -> ParquetResult<()> {
        let levels = self.optional.then_some(self.levels.as_slice());
        self.values.write(writer, levels)
    }

    /// Replaces the buffered values by those of the next rows of a row group; returns the number of rows read.
    pub(crate) fn read(&mut self, reader: &mut ColumnReader, rows: usize) -> ParquetResult<usize> {
        self.clear();
        self.values.read(reader, rows, &mut self.levels)
    }

    fn push<T: Cell>(&mut self, cell: Option<T>) -> Result<(), ValueProblem> {
        if self.optional {
            self.levels.push(i16::from(cell.is_some()));
        }
        T::of(&mut self.values).ok_or_else(wrong_cell)?.extend(cell);
        Ok(())
    }

    fn pop<T: Cell>(&mut self) -> Result<Option<T>, ValueProblem> {
        let level = self.levels.get(self.rows_taken).copied().unwrap_or(1);
        self.rows_taken += 1;
        if level == 0 {
            return Ok(None);
        }
        let cell = T::of(&mut self.values).ok_or_else(wrong_cell)?.get(self.values_taken);
        self.values_taken += 1;
        match cell {
            Some(cell) => Ok(Some(cell.clone())),
            None => Err(ValueProblem::Bad("has fewer values than its table has rows".to_owned())),
        }
    }

    fn fault(&self, what: ValueProblem) -> Fault {
        let column = self.name.clone();
        Fault { column, what }
    }
}

/// Unreachable: a field always declares its own column.
fn wrong_cell() -> ValueProblem {
    ValueProblem::Bad("contains values of another type".to_owned())
}

/// Type that a column can store.
pub(crate) trait Cell: Clone {
    fn empty() -> Values;
    fn of(values: &mut Values) -> Option<&mut Vec<Self>>;
}

/// Defines the column types: for each, the variant, the type in memory, that of Parquet, and its reader.
macro_rules! kinds {
    ($($kind:ident, $cell:ty, $parquet:ty, $reader:ident;)+) => {
        /// The values of a column, by type.
        pub(crate) enum Values {
            $($kind(Vec<$cell>),)+
        }

        impl Values {
            fn physical(&self) -> Physical {
                match self {
                    $(Self::$kind(_) => <$parquet>::get_physical_type(),)+
                }
            }

            fn clear(&mut self) {
                match self {
                    $(Self::$kind(values) => values.clear(),)+
                }
            }

            fn write(&self, to: &mut ColumnWriter<'_>, levels: Option<&[i16]>) -> ParquetResult<()> {
                match self {
                    $(Self::$kind(values) => <$parquet>::get_column_writer_mut(to)
                        .ok_or_else(wrong_kind)?
                        .write_batch(values, levels, None)
                        .map(drop),)+
                }
            }

            /// Reads at most `rows` rows and returns their number.
            fn read(&mut self, from: &mut ColumnReader, rows: usize, levels: &mut Vec<i16>) -> ParquetResult<usize> {
                match (self, from) {
                    $((Self::$kind(values), ColumnReader::$reader(from)) => from
                        .read_records(rows, Some(levels), None, values)
                        .map(|(rows, ..)| rows),)+
                    _ => Err(wrong_kind()),
                }
            }
        }

        $(impl Cell for $cell {
            fn empty() -> Values {
                Values::$kind(Vec::new())
            }

            fn of(values: &mut Values) -> Option<&mut Vec<Self>> {
                match values {
                    Values::$kind(values) => Some(values),
                    _ => None,
                }
            }
        })+
    };
}

kinds! {
    Int64, i64, Int64Type, Int64ColumnReader;
    Int32, i32, Int32Type, Int32ColumnReader;
    Double, f64, DoubleType, DoubleColumnReader;
    Bool, bool, BoolType, BoolColumnReader;
    Text, ByteArray, ByteArrayType, ByteArrayColumnReader;
}

fn wrong_kind() -> ParquetError {
    ParquetError::General("a column has another type".to_owned())
}
