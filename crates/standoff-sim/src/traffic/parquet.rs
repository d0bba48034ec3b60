//! Reads SUMO floating-car data from Parquet (`sumo --fcd-output FILE.parquet`).

use std::io::Read;
use std::path::Path;

use standoff_io::bounded_input;
use standoff_io::text_source::Fault;
use standoff_io::text_source::limits::MAX_TEXT;
use standoff_record::RecordError;
use standoff_record::column::{self, Columns, Declaration, Field, Part, Row};
use standoff_record::table::{TableReader, source};

use super::build::Builder;
use super::csv::NO_VEHICLES;
use super::model::{Options, Persons, Traffic};
use super::validate;
use super::vehicle::Sample;

/// First bytes of a Parquet file.
const MAGIC: [u8; 4] = *b"PAR1";

/// Returns whether the file is Parquet of an accepted size, by its first bytes.
pub(super) fn is_parquet(path: &Path) -> bool {
    let mut head = [0; 4];
    let read = bounded_input::open(path, MAX_TEXT).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == MAGIC
}

/// Row of the file; SUMO writes the time alone while there are no vehicles.
#[derive(Debug, Clone, Default)]
struct FcdRow {
    time_s: Option<f64>,
    vehicle: Option<String>,
    x: Option<f64>,
    y: Option<f64>,
    kind: Option<String>,
}

impl Row for FcdRow {
    const TABLE: &'static str = "traffic";
}

impl Field for FcdRow {
    fn declare<T: 'static>(_: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        Option::declare(Declaration::new("timestep_time", ""), columns, move |row| &mut part(row).time_s);
        Option::declare(Declaration::new("vehicle_id", ""), columns, move |row| &mut part(row).vehicle);
        Option::declare(Declaration::new("vehicle_x", ""), columns, move |row| &mut part(row).x);
        Option::declare(Declaration::new("vehicle_y", ""), columns, move |row| &mut part(row).y);
    }
}

pub(super) fn read(path: &Path, options: &Options) -> Result<Traffic, Fault> {
    let file = source(path).map_err(|error| fault(&error))?;
    let mut with_types: Columns<FcdRow> = column::columns();
    Option::declare(Declaration::new("vehicle_type", ""), &mut with_types, |row: &mut FcdRow| &mut row.kind);
    let reader = |columns| TableReader::of(path.to_owned(), FcdRow::default(), columns, [file.clone()]);
    // `sumo --fcd-output.attributes` can leave out the types.
    let mut table = reader(with_types).or_else(|_| reader(column::columns())).map_err(|error| fault(&error))?;
    let mut builder = Builder::default();
    let mut index = 0;
    while let Some(row) = table.next_row().map_err(|error| fault(&error))? {
        index += 1;
        let FcdRow { time_s: Some(time_s), vehicle: Some(vehicle), x, y, kind } = row else { continue };
        if options.persons == Persons::Ignored && kind.is_some_and(|kind| NO_VEHICLES.contains(&kind.as_str())) {
            continue;
        }
        let in_row = |message| Fault::whole(format!("row {index}: {message}"));
        builder.check_name("vehicle_id", &vehicle).map_err(in_row)?;
        let time_us = validate::time_us("timestep_time", &time_s.to_string()).map_err(in_row)?;
        let (Some(x), Some(y)) = (x, y) else {
            builder.skip(&vehicle);
            continue;
        };
        let [x_kind, y_kind] = validate::axes(options.coordinates);
        let x = x_kind.check("vehicle_x", &x.to_string(), Some(x)).map_err(in_row)?;
        let y = y_kind.check("vehicle_y", &y.to_string(), Some(y)).map_err(in_row)?;
        builder.add(&vehicle, Sample { time_us, x, y, velocity: [f32::NAN; 2] }).map_err(in_row)?;
    }
    let unit = builder.unit(options.coordinates);
    builder.finish(unit, options).map_err(Fault::whole)
}

/// Converts an error; the path is added elsewhere.
fn fault(error: &RecordError) -> Fault {
    let message = match error {
        RecordError::Read { reason, .. } => format!("cannot be read: {reason}"),
        RecordError::Damaged { what, .. } | RecordError::Foreign { what, .. } => {
            format!("{what}; must be SUMO FCD as Parquet, with timestep_time, vehicle_id, vehicle_x and vehicle_y")
        }
        other => other.to_string(),
    };
    Fault::whole(message)
}
