//! Reads SUMO floating-car data from Parquet (`sumo --fcd-output FILE.parquet`).

use std::io::Read;
use std::path::Path;

use standoff_io::bounded_input;
use standoff_io::parquet_file::COMPRESSION;
use standoff_io::text_source::Fault;
use standoff_io::text_source::limits::MAX_TEXT;
use standoff_record::RecordError;
use standoff_record::column::{Columns, Declaration, Field, Part, Row};
use standoff_record::table::{TableReader, source};

use super::build::Builder;
use super::model::{Options, Persons, Traffic};
use super::validate;
use super::vehicle::Sample;

/// Elements after which SUMO names the columns; that of the first row counts.
const ELEMENTS: [Names; 3] = [
    Names {
        needed: ["vehicle_id", "vehicle_x", "vehicle_y"],
        optional: ["vehicle_type", "vehicle_lane", "vehicle_edge", "vehicle_priority"],
    },
    Names {
        needed: ["person_id", "person_x", "person_y"],
        optional: ["person_type", "person_lane", "person_edge", "person_priority"],
    },
    Names {
        needed: ["container_id", "container_x", "container_y"],
        optional: ["container_type", "container_lane", "container_edge", "container_priority"],
    },
];

/// Names of columns.
struct Names {
    /// Vehicle, x and y.
    needed: [&'static str; 3],
    /// Type, lane and edge, which distinguish persons and containers from vehicles; priority.
    optional: [&'static str; 4],
}

/// Sets of optional columns, by their indices: `sumo --fcd-output.attributes` can leave out columns.
const OPTIONAL: [&[usize]; 8] = [&[0, 1, 2, 3], &[0, 3], &[1, 2, 3], &[3], &[0, 1, 2], &[0], &[1, 2], &[]];

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
    lane: Option<String>,
    edge: Option<String>,
    priority: Option<f64>,
}

impl Row for FcdRow {
    const TABLE: &'static str = "traffic";
}

impl Field for FcdRow {
    fn declare<T: 'static>(_: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        declare(&ELEMENTS[0], columns, part);
    }
}

/// Adds the columns that every file has.
fn declare<T: 'static>(names: &Names, columns: &mut Columns<T>, part: impl Part<T, FcdRow>) {
    let [vehicle, x, y] = names.needed.map(|name| Declaration::new(name, ""));
    Option::declare(Declaration::new("timestep_time", ""), columns, move |row| &mut part(row).time_s);
    Option::declare(vehicle, columns, move |row| &mut part(row).vehicle);
    Option::declare(x, columns, move |row| &mut part(row).x);
    Option::declare(y, columns, move |row| &mut part(row).y);
}

pub(super) fn read(path: &Path, options: &Options) -> Result<Traffic, Fault> {
    let file = source(path).map_err(|error| fault(&error))?;
    let reader = |names: &Names, optional: &[usize]| {
        TableReader::of(path.to_owned(), FcdRow::default(), columns(names, optional), [file.clone()])
    };
    let readers = ELEMENTS.iter().flat_map(|names| OPTIONAL.iter().map(|optional| reader(names, optional)));
    let mut table = match readers.flatten().next() {
        Some(table) => table,
        None => reader(&ELEMENTS[0], &[]).map_err(|error| fault(&error))?,
    };
    let mut builder = Builder::default();
    let mut index = 0;
    while let Some(row) = table.next_row().map_err(|error| fault(&error))? {
        index += 1;
        let FcdRow { time_s: Some(time_s), vehicle: Some(vehicle), x, y, kind, lane, edge, priority } = row else {
            continue;
        };
        let is_person = Persons::is_person(kind.as_deref(), lane.as_deref(), edge.as_deref());
        if vehicle.is_empty() && x.is_none() && y.is_none() {
            continue;
        }
        if options.persons == Persons::Ignored && is_person {
            builder.ignores_persons = true;
            continue;
        }
        let in_row = |message| Fault::whole(format!("row {index}: {message}"));
        builder.check_name("vehicle_id", &vehicle).map_err(in_row)?;
        let time_us = validate::time_us("timestep_time", &time_s.to_string()).map_err(in_row)?;
        if let Some(priority) = priority {
            let checked = validate::PRIORITY.check("vehicle_priority", &priority.to_string(), Some(priority));
            builder.set_priority(&vehicle, checked.map_err(in_row)?);
        }
        let (Some(x), Some(y)) = (x, y) else {
            builder.skip(&vehicle);
            continue;
        };
        if validate::is_unknown(options.coordinates, [x, y]) {
            builder.skip(&vehicle);
            continue;
        }
        let [x_kind, y_kind] = validate::axes(options.coordinates);
        let x = x_kind.check("vehicle_x", &x.to_string(), Some(x)).map_err(in_row)?;
        let y = y_kind.check("vehicle_y", &y.to_string(), Some(y)).map_err(in_row)?;
        builder.add(&vehicle, Sample { time_us, x, y }).map_err(in_row)?;
    }
    let unit = builder.unit(options.coordinates);
    builder.finish(unit, options).map_err(Fault::whole)
}

/// Returns the columns of a file, with some of the optional ones.
fn columns(names: &Names, optional: &[usize]) -> Columns<FcdRow> {
    let mut columns = Columns::new();
    declare(names, &mut columns, |row| row);
    for &index in optional {
        let fields: [fn(&mut FcdRow) -> &mut Option<String>; 3] =
            [|row| &mut row.kind, |row| &mut row.lane, |row| &mut row.edge];
        let declaration = Declaration::new(names.optional[index], "");
        match fields.get(index) {
            Some(field) => Option::declare(declaration, &mut columns, *field),
            None => Option::declare(declaration, &mut columns, |row: &mut FcdRow| &mut row.priority),
        }
    }
    columns
}

/// Converts an error; the path is added elsewhere.
fn fault(error: &RecordError) -> Fault {
    let message = match error {
        RecordError::Read { reason, .. } => format!("cannot be read: {reason}"),
        RecordError::Foreign { what, .. } if what.starts_with(COMPRESSION) => format!(
            "{what}; must be Snappy, or none; write it again, for example in polars with compression=\"snappy\", in SUMO with \
             --output.compression snappy"
        ),
        RecordError::Damaged { what, .. } | RecordError::Foreign { what, .. } => {
            format!("{what}; must be SUMO FCD as Parquet, with timestep_time, vehicle_id, vehicle_x and vehicle_y")
        }
        other => other.to_string(),
    };
    Fault::whole(message)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use standoff_record::table::TableWriter;

    use super::super::read as read_traffic;
    use super::*;

    /// Writes rows of time, vehicle, x, y, type, lane and edge, with some of the optional columns.
    fn write(path: &Path, names: &Names, optional: &[usize], rows: &[(f64, &str, f64, f64, &str, &str, &str)]) {
        let text = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        let mut table = TableWriter::with_columns(path.to_owned(), columns(names, optional)).unwrap();
        let mut rows: Vec<FcdRow> = rows
            .iter()
            .map(|&(time_s, vehicle, x, y, kind, lane, edge)| FcdRow {
                time_s: Some(time_s),
                vehicle: text(vehicle),
                x: text(vehicle).map(|_| x),
                y: text(vehicle).map(|_| y),
                kind: text(kind),
                lane: text(lane),
                edge: text(edge),
                priority: (vehicle == "car").then_some(5.0),
            })
            .collect();
        table.push(&mut rows).unwrap();
        table.finish().unwrap();
    }

    #[test]
    fn tables_of_sumo_are_read_like_its_csv() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fcd.parquet");
        let rows = [
            (0.0, "", 0.0, 0.0, "", "", ""),
            (1.0, "car", 20.0, 0.0, "car", "e_0", ""),
            (1.0, "p0", 0.0, 5.0, "DEFAULT_PEDTYPE", "", "e"),
            (1.0, "p1", 0.0, 6.0, "tourist", "", "e"),
            (2.0, "car", 30.0, 0.0, "car", "e_0", ""),
        ];
        let names_of = |names, optional: &[usize], persons| {
            write(&path, names, optional, &rows);
            let traffic = read_traffic(&path, &Options { persons, ..Options::default() }).unwrap();
            assert_eq!((traffic.begin_us, traffic.end_us, traffic.origin), (1_000_000, 2_000_000, None));
            traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect::<Vec<_>>()
        };
        for element in &ELEMENTS {
            let names = |optional: &[usize], persons| names_of(element, optional, persons);
            assert_eq!(names(&[0, 1, 2], Persons::Ignored), ["car"]);
            assert_eq!(names(&[1, 2], Persons::Ignored), ["car"]);
            assert_eq!(names(&[0], Persons::Ignored), ["car", "p1"]);
            assert_eq!(names(&[0, 1, 2], Persons::Included), ["car", "p0", "p1"]);
            assert_eq!(names(&[], Persons::Ignored), ["car", "p0", "p1"]);
        }
        for optional in OPTIONAL {
            write(&path, &ELEMENTS[0], optional, &rows);
            let car = &read_traffic(&path, &Options::default()).unwrap().vehicles[0];
            assert_eq!(car.priority, optional.contains(&3).then_some(5.0), "{optional:?}");
        }
    }

    #[test]
    fn damaged_and_other_tables_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fcd.parquet");
        write(&path, &ELEMENTS[1], &[0], &[(0.0, "p0", 0.0, 0.0, "DEFAULT_PEDTYPE", "", "")]);
        let only = read_traffic(&path, &Options::default()).unwrap_err().message;
        assert!(only.contains("only persons or containers of SUMO"), "{only}");
        write(&path, &ELEMENTS[0], &[], &[(0.0, "a", 0.0, 0.0, "", "", ""), (1.0, "a", 1e9, 0.0, "", "", "")]);
        let refused = || read_traffic(&path, &Options::default()).unwrap_err().message;
        assert!(refused().starts_with("row 2: vehicle_x = \"1000000000\" is out of range"), "{}", refused());
        let whole = fs::read(&path).unwrap();
        for length in [4, 8, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(refused().contains("must be SUMO FCD as Parquet, with timestep_time"), "{}", refused());
        }
        let column = |name: &'static str| {
            let mut columns: Columns<FcdRow> = Vec::new();
            Option::declare(Declaration::new(name, ""), &mut columns, |row: &mut FcdRow| &mut row.x);
            columns
        };
        let mut other = TableWriter::with_columns(path.clone(), column("speed")).unwrap();
        other.push(&mut [FcdRow::default()]).unwrap();
        other.finish().unwrap();
        assert!(refused().contains("must be SUMO FCD as Parquet"), "{}", refused());
    }
}
