//! Reads tracks from CSV tables.

mod clock;
mod data_set;
mod quotes;
mod table;
mod thousands;

use std::collections::BTreeSet;
use std::io::Read;

use standoff_io::display_text::{count, printable, quoted};
use standoff_io::geodesy::Unit;
use standoff_io::text_source::{Fault, Lines};

use super::build::Builder;
use super::model::{COORDINATES_HELP, Coordinates, Options, Persons, TRAFFIC, Traffic};
use super::validate::{self, Quantity};
use super::vehicle::Sample;
pub(super) use clock::Clock;
use clock::Numbers;
use data_set::DataSet;
use table::Table;
use thousands::Thousands;

const TIME: &[&str] = &[
    "t_s",
    "time_s",
    "t",
    "time",
    "timestep_time",
    "timestamp",
    "timestamp_s",
    "datetime",
    "t_ms",
    "time_ms",
    "timestamp_ms",
];
const VEHICLE: &[&str] =
    &["vehicle", "vehicle_id", "id", "track", "track_id", "target", "target_id", "person_id", "container_id"];
const X: &[&str] = &["x_m", "x_east_m", "x", "east_m", "vehicle_x", "person_x", "container_x"];
const Y: &[&str] = &["y_m", "y_north_m", "y", "north_m", "vehicle_y", "person_y", "container_y"];
/// Number of columns at the end of `X` and `Y` that only SUMO writes. It names all columns after the element of the first
/// row, which may be a person.
const OF_SUMO: usize = 3;
/// SUMO writes a parameter of the vehicles with `--fcd-output.params priority`.
const PRIORITY: &[&str] = &["priority", "vehicle_priority"];
const LAT: &[&str] = &["lat_deg", "lat", "latitude", "latitude_deg"];
const LON: &[&str] = &["lon_deg", "lon", "longitude", "longitude_deg", "lng", "long"];

/// Columns of SUMO that distinguish persons and containers from vehicles; the last one is that of plain headers
/// (`--output.column-header plain`).
const TYPE: &[&str] = &["vehicle_type", "person_type", "container_type", "type"];
const LANE: &[&str] = &["vehicle_lane", "person_lane", "container_lane", "lane"];
const EDGE: &[&str] = &["vehicle_edge", "person_edge", "container_edge", "edge"];
/// Columns of loggers with the hemisphere of a latitude and of a longitude.
const NORTH_SOUTH: &[&str] = &["n/s", "ns", "n_s", "lat_ref", "latitude_ref", "lat_dir", "latitude_direction"];
const EAST_WEST: &[&str] = &["e/w", "ew", "e_w", "lon_ref", "longitude_ref", "lon_dir", "longitude_direction"];
/// Values that stand for a missing one.
const NO_VALUES: [&str; 6] = ["", "nan", "null", "none", "na", "n/a"];

pub(super) fn read(lines: Lines<impl Read>, options: &Options) -> Result<Traffic, Fault> {
    let mut table = Table::new(lines)?;
    let mut builder = Builder::default();
    if !table.next_row()? {
        return Err(Fault::whole(format!("contains only comments; must be {}", TRAFFIC.formats)));
    }
    let columns = Columns::find(&table, options)?;
    let mut rows = Rows {
        clock: Clock::new(&columns.time.name),
        numbers: Numbers::new(table.separator),
        thousands: Thousands::default(),
        persons: BTreeSet::new(),
    };
    while table.next_row()? {
        rows.read(&table, &columns, options, &mut builder)?;
    }
    columns.check_vehicles(&builder)?;
    let unit = columns.unit(&builder, options)?;
    builder.thousands = rows.thousands.found();
    builder.ignores_persons = !rows.persons.is_empty();
    columns.notes(&rows.persons).into_iter().for_each(|note| builder.note(note));
    builder.finish(unit, options).map_err(Fault::whole)
}

/// Reader of rows, and what it has found in them.
struct Rows {
    clock: Clock,
    numbers: Numbers,
    thousands: Thousands,
    /// Names of persons and containers that are ignored.
    persons: BTreeSet<String>,
}

impl Rows {
    fn read(
        &mut self,
        table: &Table<impl Read>,
        columns: &Columns,
        options: &Options,
        builder: &mut Builder,
    ) -> Result<(), Fault> {
        if table.row.len() != columns.count {
            let message =
                format!("fields = {}; must be {}, as in the header; correct the row", table.row.len(), columns.count);
            return Err(table.fault(0, message));
        }
        let name = table.text(columns.vehicle.index)?;
        let is_missing = |column: &Column| {
            let text = table.text(column.index)?.trim();
            Ok::<_, Fault>(NO_VALUES.iter().any(|none| text.eq_ignore_ascii_case(none)))
        };
        let has_no_position = is_missing(&columns.x)? && is_missing(&columns.y)?;
        // SUMO writes the time alone while there are no vehicles.
        if has_no_position && name.trim().is_empty() {
            return Ok(());
        }
        if options.persons == Persons::Ignored && columns.is_person(table)? {
            self.persons.insert(name.to_owned());
            return Ok(());
        }
        let in_field = |column: &Column, message| table.fault(column.index, message);
        builder.check_name(&columns.vehicle.name, name).map_err(|message| in_field(&columns.vehicle, message))?;
        let of_vehicle = |column: &Column, message| in_field(column, format!("vehicle {}: {message}", quoted(name)));
        let time_text = table.text(columns.time.index)?;
        let time_us = match columns.set {
            Some(set) => set.time_us(&columns.time.name, time_text, &mut self.numbers, options),
            None => self.clock.time_us(&columns.time.name, time_text, &mut self.numbers),
        };
        let time_us = time_us.map_err(|message| of_vehicle(&columns.time, message))?;
        builder.times = self.clock.form();
        if let Some(column) = columns.priority.as_ref()
            && !is_missing(column)?
        {
            let (key, text) = (&column.name, table.text(column.index)?);
            let priority = self.numbers.value(key, text).and_then(|value| validate::PRIORITY.check(key, text, value));
            builder.set_priority(name, priority.map_err(|message| of_vehicle(column, message))?);
        }
        if has_no_position {
            builder.skip(name);
            return Ok(());
        }
        match self.position(table, columns, name)? {
            Some([x, y]) => {
                builder.add(name, Sample { time_us, x, y }).map_err(|message| in_field(&columns.time, message))
            }
            None => {
                builder.skip(name);
                Ok(())
            }
        }
    }

    /// Position in the current row, in the units of the file; `None` if its values mean that it is unknown.
    fn position(&mut self, table: &Table<impl Read>, columns: &Columns, name: &str) -> Result<Option<[f64; 2]>, Fault> {
        let of_vehicle =
            |column: &Column, message| table.fault(column.index, format!("vehicle {}: {message}", quoted(name)));
        let mut value = |column: &Column| {
            let value = self.numbers.value(&column.name, table.text(column.index)?);
            value.map_err(|message| of_vehicle(column, message))
        };
        let check = |column: &Column, value: Option<f64>, quantity: &Quantity| {
            let checked = quantity.check(&column.name, table.text(column.index)?, value);
            checked.map_err(|message| of_vehicle(column, message))
        };
        let at = [value(&columns.x)?, value(&columns.y)?];
        if let [Some(x), Some(y)] = at
            && validate::is_unknown(columns.coordinates, [x, y])
        {
            return Ok(None);
        }
        let [x_kind, y_kind] = validate::axes(columns.coordinates);
        let (mut x, mut y) = (check(&columns.x, at[0], &x_kind)?, check(&columns.y, at[1], &y_kind)?);
        columns.check_hemispheres(table, [y, x])?;
        if table.separator != b',' && columns.coordinates == Coordinates::Metres {
            for column in [&columns.x, &columns.y] {
                self.thousands.add(&column.name, table.text(column.index)?);
            }
        }
        let mut number = |column: &Column, quantity: &Quantity| check(column, value(column)?, quantity);
        if let Some([width, length]) = &columns.box_size {
            x += 0.5 * number(width, &x_kind)?;
            y += 0.5 * number(length, &y_kind)?;
        }
        if let Some(set) = columns.set {
            (x, y) = set.metres(x, y);
        }
        Ok(Some([x, y]))
    }
}

/// Returns the columns that distinguish persons and containers.
fn of_sumo(column: impl Fn(&[&str]) -> Option<Column>) -> [Option<Column>; 3] {
    match [TYPE, LANE, EDGE].map(column) {
        // A plain column `edge` alone does not show that a row has no lane.
        [kind, None, Some(edge)] if edge.name.eq_ignore_ascii_case("edge") => [kind, None, None],
        columns => columns,
    }
}

/// Returns the columns that are read of several with accepted names, each with another one of them.
fn preferred(header: &[&str], read: [(&Column, &[&str]); 4]) -> Vec<[String; 2]> {
    let other = |(read, accepted): (&Column, &[&str])| {
        let is_other = |name: &&&str| accepted.contains(&name.to_ascii_lowercase().as_str()) && **name != read.name;
        header.iter().find(is_other).map(|name| [read.name.clone(), (*name).to_owned()])
    };
    read.into_iter().filter_map(other).collect()
}

struct Column {
    index: usize,
    name: String,
}

/// Columns of the table by their contents.
struct Columns {
    count: usize,
    time: Column,
    vehicle: Column,
    x: Column,
    y: Column,
    /// Width and height of the box whose corner `x` and `y` are, if they are not the centre.
    box_size: Option<[Column; 2]>,
    /// Unit of `x` and `y`; `Auto` if only the motion shows it.
    coordinates: Coordinates,
    /// Type, lane and edge, in tables of SUMO.
    of_sumo: [Option<Column>; 3],
    /// Hemispheres of latitude and longitude.
    hemispheres: [Option<Column>; 2],
    /// Columns that are read, each with another one of the same meaning.
    preferred: Vec<[String; 2]>,
    /// Priority of the vehicle.
    priority: Option<Column>,
    /// Published data set with these columns.
    set: Option<&'static DataSet>,
}

/// Header of a table.
struct Header<'a, R> {
    table: &'a Table<R>,
    names: Vec<&'a str>,
}

impl<'a, R: Read> Header<'a, R> {
    fn of(table: &'a Table<R>) -> Result<Self, Fault> {
        let names =
            (0..table.row.len()).map(|index| table.text(index).map(str::trim)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { table, names })
    }

    /// First of the accepted columns that the table has.
    fn column(&self, accepted: &[&str]) -> Option<Column> {
        let place = |name: &&str| self.names.iter().position(|found| found.eq_ignore_ascii_case(name));
        let index = accepted.iter().find_map(place)?;
        Some(Column { index, name: self.names[index].to_string() })
    }

    fn need(&self, what: &str, accepted: &[&str]) -> Result<Column, Fault> {
        self.column(accepted).ok_or_else(|| self.missing(what, accepted))
    }

    fn missing(&self, what: &str, accepted: &[&str]) -> Fault {
        let found: Vec<String> = self.names.iter().take(20).map(|name| quoted(name)).collect();
        let message = format!(
            "no column for {what}; found {}; accepted: {}; rename a column, and separate columns by commas, semicolons or tabs",
            printable(&found.join(", ")),
            accepted.join(", ")
        );
        self.table.fault(0, message)
    }

    /// Rejects columns that occur twice.
    fn check_once(&self, columns: [&Column; 4]) -> Result<(), Fault> {
        for column in columns {
            let mut later = column.index + 1..self.names.len();
            if let Some(again) = later.find(|&at| self.names[at].eq_ignore_ascii_case(&column.name)) {
                let message = format!("column {} occurs twice; rename or remove one", quoted(&column.name));
                return Err(self.table.fault(again, message));
            }
        }
        Ok(())
    }
}

impl Columns {
    fn find(table: &Table<impl Read>, options: &Options) -> Result<Self, Fault> {
        let header = Header::of(table)?;
        if let Some(set) = DataSet::with(&header.names) {
            return Self::of_data_set(set, &header);
        }
        let column = |accepted: &[&str]| header.column(accepted);
        let (time, vehicle) = (header.need("the time", TIME)?, header.need("the vehicle", VEHICLE)?);
        let metres = || Some((Coordinates::Metres, column(X)?, column(Y)?));
        let degrees = || Some((Coordinates::Degrees, column(LON)?, column(LAT)?));
        // SUMO writes degrees into the same columns.
        let sumo = |unit| Some((unit, column(&X[X.len() - OF_SUMO..])?, column(&Y[Y.len() - OF_SUMO..])?));
        let (found, accepted) = match options.coordinates {
            Coordinates::Auto => (sumo(Coordinates::Auto).or_else(metres).or_else(degrees), [X, Y, LAT, LON].concat()),
            Coordinates::Metres => (metres(), [X, Y].concat()),
            Coordinates::Degrees => (degrees().or_else(|| sumo(Coordinates::Degrees)), [LAT, LON].concat()),
        };
        let (coordinates, x, y) = found.ok_or_else(|| header.missing("both coordinates", &accepted))?;
        header.check_once([&time, &vehicle, &x, &y])?;
        let [x_names, y_names] = if coordinates == Coordinates::Degrees { [LON, LAT] } else { [X, Y] };
        let preferred = preferred(&header.names, [(&time, TIME), (&vehicle, VEHICLE), (&x, x_names), (&y, y_names)]);
        let hemispheres = match coordinates {
            Coordinates::Degrees => [NORTH_SOUTH, EAST_WEST].map(column),
            _ => [None, None],
        };
        let (box_size, set, priority) = (None, None, column(PRIORITY));
        let (count, of_sumo) = (header.names.len(), of_sumo(column));
        Ok(Self { count, time, vehicle, x, y, box_size, coordinates, of_sumo, hemispheres, preferred, priority, set })
    }

    /// Columns of a published data set, which was recognised by them.
    fn of_data_set(set: &'static DataSet, header: &Header<impl Read>) -> Result<Self, Fault> {
        let named = |name| header.column(&[name]).ok_or_else(|| header.missing(name, &set.columns));
        let [time, vehicle, x, y] = set.columns.map(named);
        let (time, vehicle, x, y) = (time?, vehicle?, x?, y?);
        header.check_once([&time, &vehicle, &x, &y])?;
        let box_size = set.box_size.map(|names| names.map(named));
        let box_size = box_size.map(|[width, length]| Ok::<_, Fault>([width?, length?])).transpose()?;
        Ok(Self {
            count: header.names.len(),
            time,
            vehicle,
            x,
            y,
            box_size,
            coordinates: Coordinates::Metres,
            of_sumo: of_sumo(|accepted| header.column(accepted)),
            hemispheres: [None, None],
            preferred: Vec::new(),
            priority: header.column(PRIORITY),
            set: Some(set),
        })
    }

    /// Rejects a latitude or longitude in the south or west whose sign is in a column of its own.
    fn check_hemispheres(&self, table: &Table<impl Read>, lat_lon_deg: [f64; 2]) -> Result<(), Fault> {
        for (column, value_deg) in self.hemispheres.iter().zip(lat_lon_deg) {
            let Some(column) = column else { continue };
            let text = table.text(column.index)?;
            if value_deg > 0.0 && text.trim().starts_with(['S', 's', 'W', 'w']) {
                let message = format!(
                    "{} = {}: this column is not read; give latitudes in the south and longitudes in the west as \
                     negative numbers",
                    column.name,
                    quoted(text)
                );
                return Err(table.fault(column.index, message));
            }
        }
        Ok(())
    }

    /// Returns what the user should know about the columns that are read, and about the persons that are not.
    fn notes(&self, persons: &BTreeSet<String>) -> Vec<String> {
        let preferred = self.preferred.iter().map(|[read, other]| {
            let [read, other] = [read, other].map(|name| quoted(name));
            format!("reads column {read}, not {other}, which may mean the same; remove or rename the wrong one")
        });
        let mut notes: Vec<String> = preferred.collect();
        // The names of plain headers are not only SUMO's.
        let is_plain = self.of_sumo.iter().flatten().any(|column| !column.name.contains('_'));
        if let Some(first) = persons.first().filter(|_| is_plain) {
            notes.push(format!(
                "ignores {} of SUMO (default type, or edge without lane): {}{}; traffic.persons = \"included\" reads them",
                count(persons.len(), "person"),
                quoted(first),
                if persons.len() > 1 { ", ..." } else { "" }
            ));
        }
        notes
    }

    /// Returns whether the current row is that of a person or container.
    fn is_person(&self, table: &Table<impl Read>) -> Result<bool, Fault> {
        let text = |column: &Option<Column>| column.as_ref().map(|column| table.text(column.index)).transpose();
        let [kind, lane, edge] = &self.of_sumo;
        Ok(Persons::is_person(text(kind)?, text(lane)?, text(edge)?))
    }

    /// Rejects names of vehicles that probably number the rows.
    fn check_vehicles(&self, builder: &Builder) -> Result<(), Fault> {
        if !builder.has_single_samples() {
            return Ok(());
        }
        let name = quoted(&self.vehicle.name);
        Err(Fault::whole(format!(
            "each vehicle has a single sample: column {name} probably numbers the rows; call the column of the vehicles \
             vehicle, and {name} otherwise"
        )))
    }

    /// Returns the unit of the coordinates. Fails if the motion of the vehicles contradicts the columns.
    fn unit(&self, builder: &Builder, options: &Options) -> Result<Unit, Fault> {
        let is_named = options.coordinates != Coordinates::Auto || self.x.name.to_ascii_lowercase().ends_with("_m");
        match self.coordinates {
            Coordinates::Metres if self.set.is_none() && !is_named && builder.shows() == Some(Unit::Degrees) => {
                Err(Fault::whole(format!(
                    "the vehicles move as if column {} were degrees; its name means metres; rename the columns to lon \
                     and lat, or set {COORDINATES_HELP}",
                    quoted(&self.x.name)
                )))
            }
            coordinates => Ok(builder.unit(coordinates)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{TrafficError, read_from};
    use super::*;

    fn read_as(text: &str, coordinates: Coordinates) -> Result<Traffic, TrafficError> {
        read_from(text.as_bytes(), "f.csv", &Options { coordinates, ..Options::default() })
    }

    fn read(text: &str) -> Result<Traffic, TrafficError> {
        read_as(text, Coordinates::Auto)
    }

    fn error(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    /// Of several values, the highest counts, wherever it is; a blank one has no effect.
    #[test]
    fn a_column_gives_priorities() {
        let traffic = read("t,id,x,y,Priority\n0,a,0,0,\n0,b,9,9,2\n1,a,1,0,0.5\n1,b,9,9,7.5\n1,c,5,5,nan\n").unwrap();
        let of: Vec<_> = traffic.vehicles.iter().map(|vehicle| (vehicle.name(), vehicle.priority)).collect();
        assert_eq!(of, [("a", Some(0.5)), ("b", Some(7.5)), ("c", None)]);
        let without = read("t,id,x,y\n0,a,0,0\n0,b,9,9\n1,a,1,0\n1,b,9,9\n1,c,5,5\n").unwrap();
        assert_ne!(without.crc32(), traffic.crc32());
        assert_eq!(
            error("t,id,x,y,priority\n0,a,0,0,101\n"),
            "f.csv:2:9: vehicle \"a\": priority = \"101\" is out of range; 0.01 to 100; leave it blank for 1"
        );
        assert!(
            error("t,id,x,y,priority\n0,a,0,0,high\n").starts_with("f.csv:2:9: vehicle \"a\": priority = \"high\" is")
        );
    }

    #[test]
    fn a_table_is_read() {
        let traffic = read(
            "# a comment, with \"quotes\r\n\r\nT_S,kind,Vehicle,X_east_m,y_m\r\n1.0,car,a,0,0\r\n# more\r\n\
             2.0,car,a,2,-4\r\n0.5,car,\"b,\"\"1\"\"\",7,7\r\n3.0,car,a,8,-4",
        )
        .unwrap();
        assert_eq!((traffic.begin_us, traffic.end_us, traffic.origin), (500_000, 3_000_000, None));
        assert_eq!(traffic.vehicles[0].name(), "b,\"1\"");
        let state = traffic.vehicles[1].at(2_000_000).unwrap();
        assert_eq!((state.x_m, state.y_m, state.vx_m_s, state.vy_m_s), (2.0, -4.0, 4.0, -2.0));
    }

    #[test]
    fn every_column_name_is_known_in_any_case() {
        for (time, vehicle, x, y) in [
            ("t_s", "vehicle", "x_m", "y_m"),
            ("time_s", "vehicle_id", "x_east_m", "y_north_m"),
            ("T", "ID", "X", "Y"),
            ("time", "track", "east_m", "north_m"),
            ("timestep_time", "target", " x ", "y"),
            ("timestamp", "track_id", "x", "y"),
            ("Timestamp_s", "target_id", "x", "y"),
            ("datetime", "id", "x", "y"),
        ] {
            let traffic = read(&format!("{vehicle},{time},{y},{x}\nv,1,20,10")).unwrap();
            let state = traffic.vehicles[0].at(1_000_000).unwrap();
            assert_eq!((state.x_m, state.y_m, traffic.origin), (10.0, 20.0, None));
        }
        for (latitude, longitude) in [("lat_deg", "lon_deg"), ("lat", "lon"), ("Latitude", "Longitude"), ("lat", "lng")]
        {
            let origin = read(&format!("{latitude},{longitude},t,id\n20,10,1,v")).unwrap().origin.unwrap();
            assert_eq!((origin.latitude_deg, origin.longitude_deg), (20.0, 10.0));
        }
    }

    /// What `sumo --fcd-output FILE.csv` writes: rows with the time alone, persons among the vehicles, and degrees in the
    /// same columns.
    #[test]
    fn tables_of_sumo_are_read_like_its_xml() {
        let header = "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_type;vehicle_lane;vehicle_edge\n";
        let rows = "0.00;;;;;;\n1.00;car;20;0;car;e_0;\n1.00;p0;0;5;DEFAULT_PEDTYPE;;e\n1.00;p1;0;6;tourist;;e\n\
                    2.00;car;30;0;car;e_0;\n2.00;p0;1;5;DEFAULT_PEDTYPE;;e\n2.00;p1;1;6;tourist;;e\n";
        let names = |options: &Options| {
            let traffic = read_from(format!("{header}{rows}").as_bytes(), "f.csv", options).unwrap();
            assert_eq!((traffic.begin_us, traffic.origin), (1_000_000, None));
            traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(&Options::default()), ["car"]);
        assert_eq!(names(&Options { persons: Persons::Included, ..Options::default() }), ["car", "p0", "p1"]);
        let degrees =
            "timestep_time;vehicle_id;vehicle_x;vehicle_y\n0;a;11.3;44.5\n1;a;11.30012;44.5\n2;a;11.30024;44.5\n";
        for coordinates in [Coordinates::Auto, Coordinates::Degrees] {
            let origin = read_as(degrees, coordinates).unwrap().origin.unwrap();
            assert_eq!((origin.latitude_deg, origin.longitude_deg), (44.5, 11.3));
        }
        assert!(read_as(degrees, Coordinates::Metres).unwrap().origin.is_none());
    }

    #[test]
    fn a_line_that_names_the_separator_is_skipped() {
        for (line, separator) in [
            ("sep=;", ";"),
            ("SEP=,\r", ","),
            ("sep=\t", "\t"),
            ("sep=|", "|"),
            ("\"sep=;\"", ";"),
            ("# no", "\t"),
            ("#", "|"),
        ] {
            let rows = "t,id,x,y\n0,a,1,2\n1,a,3,2\n".replace(',', separator);
            let traffic = read(&format!("{line}\n{rows}")).unwrap();
            assert_eq!(traffic.vehicles[0].at(0).unwrap().x_m, 1.0);
        }
        assert!(error("sep=;\nt;id;x;y\n0;a;here;2\n").starts_with("f.csv:3:5: vehicle \"a\": x = \"here\""));
    }

    #[test]
    fn samples_without_a_fix_are_skipped_and_reported() {
        let traffic = read("t,id,lat,lon\n0,a,44.5,11.3\n1,a,,\n2,a,0,0\n3,a,44.5001,11.3\n3,b,44.5,11.3\n").unwrap();
        assert_eq!(traffic.notes, ["skipped 2 samples without a position or time: \"a\" (2)"]);
        assert_eq!((traffic.vehicles.len(), traffic.span_s()), (2, 3.0));
        let missing = read("t,id,lat,lon\n0,a,44.5,11.3\n1,a,NaN,nan\n2,a,null,NULL\n3,a,44.5001,11.3\n").unwrap();
        assert!(missing.notes[0].ends_with("position or time: \"a\" (2)"), "{:?}", missing.notes);
        assert!(error("t,id,lat,lon\n0,a,,\n1,a,,\n").starts_with("f.csv: contains no vehicles"));
        assert!(error("t,id,x,y\n0,a,,3\n").starts_with("f.csv:2:5: vehicle \"a\": x = \"\" is not a number"));
        assert!(read("t,id,x,y\n0,a,0,0\n").unwrap().notes.is_empty(), "0, 0 is a position in metres");
    }

    #[test]
    fn positions_that_a_receiver_marks_as_unknown_are_skipped() {
        let rows = |lat: &str, lon: &str| format!("t,id,lat,lon\n0,a,44.5,11.3\n1,a,{lat},{lon}\n2,a,44.5001,11.3\n");
        for (lat, lon) in [("91", "181"), ("214.7483647", "214.7483647"), ("-999", "-999"), ("inf", "NaN")] {
            let traffic = read(&rows(lat, lon)).unwrap();
            assert_eq!(traffic.notes, ["skipped 1 sample without a position or time: \"a\" (1)"]);
        }
        let wrong = error(&rows("91", "11.3"));
        assert!(
            wrong.contains("lat = \"91\" is out of range; -90 to 90 degrees north; correct the sample or"),
            "{wrong}"
        );
        let none = error("t,id,lat,lon\n0,a,91,181\n1,a,91,181\n");
        assert_eq!(none, "f.csv: contains no vehicles with a position: 2 samples without one");
        // The unit of SUMO's columns is known only at the end.
        let sumo = "timestep_time;vehicle_id;vehicle_x;vehicle_y\n0;a;0;0\n1;a;11.3;44.5\n2;a;11.3001;44.5\n3;a;11.3002;44.5\n";
        let traffic = read_as(sumo, Coordinates::Degrees).unwrap();
        assert_eq!(traffic.origin.map(|origin| origin.longitude_deg), Some(11.3));
    }

    #[test]
    fn longitudes_may_be_0_to_360() {
        let read = |rows: &str| read(&format!("t,id,lat,lon\n{rows}")).unwrap();
        let unsigned = read("0,a,50,179.9999\n1,a,50,180.0\n2,a,50,180.0001\n");
        let signed = read("0,a,50,179.9999\n1,a,50,180.0\n2,a,50,-179.9999\n");
        for time_us in [0, 1_000_000, 2_000_000] {
            let [one, other] = [&unsigned, &signed].map(|traffic| traffic.vehicles[0].at(time_us).unwrap());
            assert!((one.x_m - other.x_m).abs() < 1e-6 && (one.y_m - other.y_m).abs() < 1e-6, "{one:?} {other:?}");
        }
        let west = read("0,a,50,190.5\n1,a,50,190.5001\n");
        assert_eq!(west.origin.map(|origin| origin.longitude_deg), Some(-169.5));
    }

    #[test]
    fn samples_whose_times_are_cut_to_seconds_are_kept_once() {
        let rows: String = (0..40).map(|n| format!("{},van,{},0\n", n * 3 / 4, 6 * n)).collect();
        let traffic = read(&format!("t,id,x,y\n{rows}30,van,240,0\n30,van,240,0\n")).unwrap();
        let expected = "skipped 11 samples at the time of an earlier one of the same vehicle: \"van\" (11)";
        assert_eq!((traffic.vehicles[0].samples(), traffic.notes), (31, vec![expected.to_owned()]));
    }

    #[test]
    fn repeated_times_of_other_causes_are_refused_with_the_cause() {
        let of = |rows: String| error(&format!("timestamp,id,x,y\n{rows}"));
        let again = of((0..200).map(|n| format!("{:.1},car,{},0\n", (1_777_885_200 + n) as f32, 8 * n)).collect());
        assert!(again.contains("were stored in single precision"), "{again}");
        let single = of((0..200).map(|n| format!("{},car,{},0\n", (1_777_885_200 + n) as f32, 8 * n)).collect());
        let expected = "f.csv: vehicle \"car\": 200 samples at 3 different times: the times were stored in single precision, in \
                        which they differ by 128 s at least; write them again in double precision";
        assert!(single.starts_with(expected), "{single}");
        let coarse = of((0..50).map(|n| format!("{},car,{},0\n", n / 10 * 10, 8 * n)).collect());
        assert!(coarse.contains("50 samples at 5 different times, the first at time = 0 s;"), "{coarse}");
        assert!(coarse.ends_with("the times are rounded: write more digits"), "{coarse}");
        let two = of((0..50).map(|n| format!("{},car,{},{}\n", n / 2, 8 * n / 2, n % 2 * 60)).collect());
        assert!(two.contains("two samples at time = 0 s are 60 m apart, with 24 more such pairs; if two"), "{two}");
        assert!(two.contains("if two vehicles have one name, give each its own"), "{two}");
        let one = error("t,id,x,y\n0,car,0,0\n0,car,60,0\n1,car,8,0\n");
        assert!(one.contains("two samples at time = 0 s are 60 m apart; if two vehicles"), "{one}");
    }

    #[test]
    fn times_that_go_back_are_refused_with_the_cause() {
        let drive = |from: i64| (0..12).map(|n| format!("{},car,{n},0\n", from + n)).collect::<String>();
        for (rows, expected) in [
            (
                "2,car,0,0\n1,car,1,0\n".to_owned(),
                "sort them; if two vehicles have one name, give each its own; if a clock was put back, correct",
            ),
            (drive(0) + "0,car,5,5\n", "the vehicle starts again: if two vehicles have one name, give each its own;"),
            (drive(86_380) + "3,car,13,0\n", "the seconds of a day start again: add 86400 s to these times"),
            (drive(1_777_885_200) + "1158570013,car,1,0\n", "the week number of GPS starts again after 1024 weeks"),
        ] {
            let error = error(&format!("t,id,x,y\n{rows}"));
            assert!(error.contains(expected), "{error}");
        }
        let clock = "t,id,x,y\n2026-10-25T02:59:59,a,0,0\n2026-10-25T02:00:00,a,1,0\n";
        let expected = "f.csv:3:1: vehicle \"a\": time = 2026-10-25T02:00:00 comes after 2026-10-25T02:59:59; the times of a \
                        vehicle must increase; if the local clock was put back, write the times in UTC";
        assert_eq!(error(clock), expected);
        // Some programs write earlier samples again.
        assert_eq!(read(&format!("t,id,x,y\n{}{}12,car,12,0\n", drive(0), drive(0))).unwrap().span_s(), 12.0);
    }

    /// The rows are our own; the columns are those of the data sets.
    #[test]
    fn published_data_sets_are_recognised_by_their_columns() {
        let high_d = "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration\n\
                      0,1,100,8,4,2,30,0,0\n25,1,130,8,4,2,30,0,0\n50,1,160,8,4,2,30,0,0\n";
        let in_d = "recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,xVelocity\n\
                    0,1,0,0,102,-9,0,2,4,30\n0,1,25,1,132,-9,0,2,4,30\n0,1,50,2,162,-9,0,2,4,30\n";
        let ngsim = "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_Length\n\
                     1,12,3,1118846980000,16,48,6451137.5,1873344.5,14\n1,22,3,1118846981000,16,98,6451137.5,1873394.5,14\n";
        for text in [high_d, in_d] {
            let traffic = read(text).unwrap();
            let state = traffic.vehicles[0].at(1_000_000).unwrap();
            assert_eq!((state.x_m, state.y_m, state.vx_m_s, traffic.span_s()), (132.0, -9.0, 30.0, 2.0));
        }
        let slower = Options { frame_rate_hz: Some(10.0), ..Options::default() };
        assert_eq!(read_from(in_d.as_bytes(), "f.csv", &slower).unwrap().span_s(), 5.0);
        let traffic = read(ngsim).unwrap();
        let state = traffic.vehicles[0].at(traffic.begin_us).unwrap();
        assert!((state.vy_m_s - 15.24).abs() < 1e-4 && (state.x_m - 1_966_310.6).abs() < 0.1, "{state:?}");
        let wrong = error("frame,id,x,y,width,height,xVelocity,yVelocity\nx,1,100,8,4,2,30,0\n");
        assert!(
            wrong.starts_with("f.csv:2:1: vehicle \"1\": frame = \"x\" is not a number; 0 to 1000000000"),
            "{wrong}"
        );
    }

    #[test]
    fn row_numbers_are_no_vehicles() {
        let rows: String = (0..6).map(|row| format!("{row},{},v,44.5,11.3\n", row / 2)).collect();
        let refused = error(&format!("id,timestamp,device,latitude,longitude\n{rows}"));
        let expected =
            "f.csv: each vehicle has a single sample: column \"id\" probably numbers the rows; call the column";
        assert!(refused.starts_with(expected), "{refused}");
        assert!(read("id,t,x,y\n0,0,1,2\n1,0,1,2\n").is_ok(), "two vehicles may have one sample each");
    }

    #[test]
    fn implausible_traffic_is_reported() {
        let of = |rows: String| read(&format!("time_s,vehicle,x_m,y_m\n{rows}")).unwrap();
        let spike = of((0..20).map(|t| format!("{t},van,{},0\n", if t == 7 { 1800 } else { 8 * t })).collect());
        let expected = "1 vehicle above 100 m/s between two samples: \"van\" with 1752 m/s before time = 7 s; is a position \
                        wrong? correct it or remove the sample";
        assert_eq!(spike.notes, [expected]);
        let slow = of((0..300).map(|t| format!("{},car,{},0\n", 100 * t, 1.5 * f64::from(t))).collect());
        assert!(slow.notes[0].starts_with("no vehicle is faster than 0.015 m/s, although one moves 448 m; are the"));
        let fast = of((0..30).map(|t| format!("{},car,{},0\n", f64::from(t) / 1e3, 8 * t)).collect());
        assert!(
            fast.notes[0]
                .ends_with("are the times in another unit? then correct the name or the values of their column")
        );
        let lanes = of((0..40)
            .map(|t| format!("{},car,{},{}\n", f64::from(t) / 40.0, t / 2, if t < 20 { 0.0 } else { 3.2 }))
            .collect());
        assert_eq!(lanes.notes, [""; 0], "a lane change within a time step of 0.025 s");
        let parked = of((0..300).map(|t| format!("{},car,{},0\n", 100 * t, f64::from(t % 2))).collect());
        assert_eq!(parked.notes, [""; 0]);
    }

    /// Plain headers are not only SUMO's, so the persons are noted.
    #[test]
    fn persons_of_sumo_are_recognised_under_every_header() {
        let rows = "0;p0;0;5;DEFAULT_PEDTYPE;1.3;;e\n0;car;0;0;car;10;e_0;\n1;p0;1;5;DEFAULT_PEDTYPE;1.3;;e\n\
                    1;car;10;0;car;10;e_0;\n";
        let names = |header: &str, persons| {
            let options = Options { persons, ..Options::default() };
            let traffic = read_from(format!("{header}\n{rows}").as_bytes(), "f.csv", &options).unwrap();
            let names: Vec<_> = traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect();
            (names.join(" "), traffic.notes)
        };
        let plain = "time;id;x;y;type;speed;lane;edge";
        let [vehicle, person] =
            ["vehicle", "person"].map(|of| format!("timestep_{}", plain.replace(';', &format!(";{of}_"))));
        for header in [&vehicle, &person] {
            assert_eq!(names(header, Persons::Ignored), ("car".to_owned(), vec![]));
            assert_eq!(names(header, Persons::Included), ("car p0".to_owned(), vec![]));
        }
        let note = "ignores 1 person of SUMO (default type, or edge without lane): \"p0\"; traffic.persons = \"included\" \
                    reads them";
        assert_eq!(names(plain, Persons::Ignored), ("car".to_owned(), vec![note.to_owned()]));
        assert_eq!(names(plain, Persons::Included), ("car p0".to_owned(), vec![]));
        for header in [plain, &person] {
            let only = error(&format!("{header}\n0;p0;1;2;DEFAULT_PEDTYPE;1;;e\n"));
            assert!(only.ends_with("which are ignored; traffic.persons = \"included\" reads them"), "{only}");
        }
        assert_eq!(names(&plain.replace("lane", "road").replace("type", "kind"), Persons::Ignored).0, "car p0");
    }

    #[test]
    fn a_logger_that_sleeps_while_parked_keeps_its_vehicle() {
        let drive = |from: u32, x: u32| (0..60).map(move |t| format!("{},van,{},0\n", from + t, x + 8 * t));
        let rows: String = drive(0, 0).chain(drive(240, 472)).collect();
        let traffic = read(&format!("t,id,x,y\n{rows}")).unwrap();
        assert_eq!((traffic.vehicles[0].at(150_000_000).map(|state| state.x_m), traffic.notes), (Some(472.0), vec![]));
        let rows: String = drive(0, 0).chain(drive(240, 600)).collect();
        let traffic = read(&format!("t,id,x,y\n{rows}")).unwrap();
        let note = "1 vehicle absent between samples for at least a tenth of the time: \"van\" (61 %, 1 gap); a longer \
                    traffic.gap_s keeps them";
        assert_eq!((traffic.vehicles[0].at(150_000_000), traffic.notes), (None, vec![note.to_owned()]));
    }

    #[test]
    fn ambiguous_values_are_noted() {
        let notes = |separator: char, values: &[&str]| {
            let rows: String = (0..).zip(values).map(|(t, x)| format!("{t};car;{x};0\n")).collect();
            read(&format!("t;id;x;y\n{rows}").replace(';', &separator.to_string())).unwrap().notes
        };
        let creeping = ["1.000", "1.010", "1.020", "1.030", "1.040"];
        let thousands = "x = \"1.000\" is read as a decimal number, but may mean thousands, because every decimal sign has three \
                         digits after it; if so, write the positions without it";
        assert_eq!(notes(';', &creeping), [thousands]);
        assert_eq!(
            notes('\t', &creeping.map(|x| x.replace('.', ",")).each_ref().map(String::as_str)),
            [thousands.replace("1.000", "1,000")]
        );
        assert!(notes(';', &["980", "990", "1.000", "1.010"]).contains(&thousands.to_owned()));
        assert_eq!(notes(';', &["1.000", "1.000"]), [thousands], "parked");
        assert_eq!(notes(';', &["1.000", "11.000", "21.000", "31.000", "41.000"]), [""; 0], "a drive in metres");
        let kilometres = "no vehicle is faster than 0.010 m/s, although one moves steadily; are the positions kilometres? then \
                          convert them to metres";
        assert_eq!(notes(';', &["1.0", "1.01", "1.02", "1.03", "1.04", "1.05"]), [kilometres]);
        assert_eq!(notes(';', &["1.0", "1.02", "0.99", "1.01", "1.0", "1.02"]), [""; 0], "noise");
        assert_eq!(
            read("id,t,vehicle,time,x,y\n1,0,a,0,0,0\n2,1,a,1,9,0\n").unwrap().notes,
            [["t", "time"], ["vehicle", "id"]].map(|[read, other]| format!(
                "reads column \"{read}\", not \"{other}\", which may mean the same; remove or rename the wrong one"
            ))
        );
        assert!(read("t,id,latitude,n/s,longitude\n0,a,0.1,N,9\n1,b,-0.1,S,9\n").is_ok());
        let south = error("t,id,latitude,n/s,longitude\n0,a,33.5,N,9\n1,a,33.5,S,9\n");
        assert!(
            south.starts_with("f.csv:3:10: n/s = \"S\": this column is not read; give latitudes in the"),
            "{south}"
        );
    }

    /// A lorry that is sampled every ten seconds next to a van that is sampled every second exists all the time.
    #[test]
    fn the_gap_limit_follows_the_sampling_interval_of_each_vehicle() {
        let van: String = (0..=60).map(|t| format!("{t},van,{},0\n", 8 * t)).collect();
        let lorry: String = (0..=6).map(|t| format!("{},lorry,{},9\n", 10 * t, 80 * t)).collect();
        let text = format!("time_s,vehicle,x_m,y_m\n{van}{lorry}");
        let exists = |traffic: &Traffic| traffic.vehicles.iter().all(|vehicle| vehicle.at(35_000_000).is_some());
        assert!(exists(&read(&text).unwrap()));
        let limited = Options { gap_s: Some(2.5), ..Options::default() };
        let traffic = read_from(text.as_bytes(), "f.csv", &limited).unwrap();
        assert!(!exists(&traffic));
        assert_eq!(
            traffic.notes,
            ["1 vehicle absent between samples for at least a tenth of the time: \"lorry\" (100 %, 6 gaps); a longer \
              traffic.gap_s keeps them"]
        );
    }

    #[test]
    fn tables_of_gps_loggers_are_read() {
        let plain = read("time_s,vehicle,lat,lon\n0,v,44.5,11.3\n1.5,v,44.5001,11.3\n").unwrap();
        for text in [
            "Timestamp,ID,Latitude,Longitude\n2026-03-01T12:00:00.25Z,v,44.5,11.3\n2026-03-01T12:00:01.75Z,v,44.5001,11.3\n",
            "timestamp;track_id;lat;lng;speed\n2026-03-01 12:00:00+01:00;v;44,5;11,3;7,4\n2026-03-01 12:00:01,5+01:00;v;\
             44,5001;11,3;7,4\n",
            "# logger\nid;time_ms;latitude_deg;longitude_deg\n\"v\";1772366400000;44.5;11.3\nv;1772366401500;44.5001;11.3\n",
            "datetime;id;lat;lon\r2026-03-01T23:59:59;v;44,5;11,3\r2026-03-02T00:00:00,5;v;44,5001;11,3",
        ] {
            let traffic = read(text).unwrap_or_else(|error| panic!("{error}"));
            let (one, other) = (&traffic.vehicles[0], &plain.vehicles[0]);
            assert_eq!((one.name(), traffic.origin), ("v", plain.origin), "{text}");
            for part_us in [0, 400_000, 1_500_000] {
                assert_eq!(one.at(one.first_us() + part_us), other.at(part_us), "{text}");
            }
            assert_eq!(traffic.span_s(), 1.5, "{text}");
        }
    }

    #[test]
    fn wrong_values_of_gps_loggers_are_shown_with_their_place() {
        let header = "timestamp;id;x_m;y_m\n2026-03-01T12:00:00Z;a;1,5;0\n";
        for (row, expected) in [
            (
                "2026-03-01T12:00:01;a;2;0",
                "f.csv:3:1: vehicle \"a\": timestamp = \"2026-03-01T12:00:01\" is a date-time w",
            ),
            ("5;a;2;0", "f.csv:3:1: vehicle \"a\": timestamp = \"5\" is a number, the time before it a date-time"),
            (
                "2026-03-01T12:61:01Z;a;2;0",
                "f.csv:3:1: vehicle \"a\": timestamp = \"2026-03-01T12:61:01Z\" is not a nu",
            ),
            ("2026-03-01T12:00:01Z;a;2.5;0", "f.csv:3:24: vehicle \"a\": x_m = \"2.5\" has a decimal point, others"),
            ("2026-03-01T12:00:01Z;a;1.234,5;0", "f.csv:3:24: vehicle \"a\": x_m = \"1.234,5\" is not a number"),
            ("2026-03-01T12:00:01Z;a;2,5,0", "f.csv:3:1: fields = 3; must be 4, as in the header"),
            ("2026-03-01T12:00:01Z;\"a;2;0", "f.csv:3:22: a quote opens here and is not closed"),
            ("#2026-03-01T12:00:01Z;a;2;0", "f.csv:3:1: begins with # like a comment, but has 4 fields like a row"),
            (
                "2026-03-01T12:00:01Z;a ;2;0",
                "f.csv:3:22: id = \"a \" differs only in whitespace from the earlier \"a\"",
            ),
        ] {
            let error = error(&format!("{header}{row}\n"));
            assert!(error.starts_with(expected) && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn metres_are_preferred_unless_degrees_are_selected() {
        let both = "t,id,lat,lon,x,y\n0,v,1,2,3,4";
        assert!(read(both).unwrap().origin.is_none());
        assert!(read_as(both, Coordinates::Metres).unwrap().origin.is_none());
        assert!(read_as(both, Coordinates::Degrees).unwrap().origin.is_some());
        assert!(read("t,id,lat,lon,x\n0,v,1,2,3").unwrap().origin.is_some(), "x alone is no position");
    }

    #[test]
    fn a_missing_column_is_reported_with_the_columns_found() {
        let header = error("# c\ntime,car,x,y\n0,v,1,2");
        let expected = "f.csv:2:1: no column for the vehicle; found \"time\", \"car\", \"x\", \"y\"; \
                        accepted: vehicle, vehicle_id, id, track, track_id, target, target_id, person_id, container_id; \
                        rename a column, and separate \
                        columns by commas, semicolons or tabs";
        assert_eq!(header, expected);
        assert!(error("id,x,y\n").contains("no column for the time;"));
        assert!(error("id,t,x,lat\n").contains("no column for both coordinates;"));
        let degrees = read_as("id,t,x,y\n", Coordinates::Degrees).unwrap_err();
        assert!(degrees.message.ends_with(
            "accepted: lat_deg, lat, latitude, latitude_deg, lon_deg, lon, longitude, longitude_deg, lng, long; rename a \
             column, and separate columns by commas, semicolons or tabs"
        ));
        let metres = read_as("id,t,lat,lon\n", Coordinates::Metres).unwrap_err();
        assert!(
            metres.message.contains("accepted: x_m, x_east_m, x, east_m, vehicle_x, person_x, container_x, y_m,"),
            "{metres}"
        );
    }

    #[test]
    fn a_header_is_not_repeated_at_length() {
        for header in ["\u{1b}".repeat(60) + ",", "a,".to_string(), "x".repeat(5000) + ","] {
            let error = error(&header.repeat(200));
            assert!(error.starts_with("f.csv:1:1: no column for the time; found \"") && error.len() < 500, "{error}");
        }
    }

    #[test]
    fn a_duplicate_column_is_rejected() {
        let expected = "f.csv:1:8: column \"x\" occurs twice";
        assert!(error("t,id,x,X,y\n0,v,1,2,3").starts_with(expected), "{}", error("t,id,x,X,y\n0,v,1,2,3"));
        assert!(read("t,id,x,y,speed,speed\n0,v,1,2,3,4").is_ok(), "unused columns may be duplicate");
    }

    #[test]
    fn wrong_values_are_shown_with_their_place() {
        for (row, expected) in [
            ("0,v,x,0", "f.csv:3:5: vehicle \"v\": x = \"x\" is not a number; -100000000 to 100000000 m;"),
            ("0,\"a,\n\u{1b}b\",NaN,0", "f.csv:4:5: vehicle \"a,\\n\\u{1b}b\": x = \"NaN\" is not finite"),
            ("0,\u{e9},0,1e9", "f.csv:3:7: vehicle \"\u{e9}\": y = \"1e9\" is out of range"),
            ("noon,v,0,0", "f.csv:3:1: vehicle \"v\": time = \"noon\" is not a number"),
            ("0,,0,0", "f.csv:3:3: id = \"\" has 0 characters; 1 to 200"),
            ("0,v,0", "f.csv:3:1: fields = 3; must be 4, as in the header"),
            ("0,v,0,0,0", "f.csv:3:1: fields = 5; must be 4, as in the header"),
        ] {
            let error = error(&format!("time,id,x,y\n# c\n{row}\n"));
            assert!(error.starts_with(expected) && !error.contains('\n'), "{error}");
        }
        assert!(
            error("t,id,lat,lon\n0,v,91,0").starts_with("f.csv:2:5: vehicle \"v\": lat = \"91\" is out of range; -90")
        );
        assert!(
            error("t,id,lat,lon\n0,v,9,361").starts_with("f.csv:2:7: vehicle \"v\": lon = \"361\" is out of range")
        );
        let long = error(&format!("t,id,x,y\n0,{},0,0", "n".repeat(201)));
        assert!(long.starts_with("f.csv:2:3: id = ") && long.contains("has 201 characters"), "{long}");
    }

    #[test]
    fn the_times_of_each_vehicle_must_increase_but_rows_may_be_unsorted() {
        assert!(read("t,id,x,y\n5,a,0,0\n6,a,0,0\n1,b,0,0\n2,b,0,0").is_ok());
        let twice = error("t,id,x,y\r\n1,b,0,0\r\n1,a,0,0\r\n1,b,9,9\r\n");
        let expected = "f.csv: vehicle \"b\": 2 samples at one time, the first at time = 1 s; a vehicle has one";
        assert!(twice.starts_with(expected), "{twice}");
        let back = error("t,id,x,y\n2,b,0,0\n1,b,0,0");
        assert!(back.starts_with("f.csv:3:1: vehicle \"b\": time = 1 s comes after 2 s"), "{back}");
    }

    #[test]
    fn a_file_without_rows_is_refused() {
        assert!(error("t,id,x,y\n").starts_with("f.csv: contains no vehicles"));
        assert!(error("# nothing\n#").starts_with("f.csv: contains only comments"));
    }

    #[test]
    fn a_row_may_not_be_too_long() {
        let long = error(&format!("t,id,x,y\n0,{},0,0\n", "v".repeat(1 << 20)));
        assert!(long.starts_with("f.csv:2:1: one XML element or CSV row is too long; at most 1 MiB"), "{long}");
        let blank = error(&format!("t,id,x,y\n# c\n{}0,v,0,0\n", "\n".repeat(2 << 20)));
        assert!(blank.starts_with("f.csv:3:1: more than 1 MiB of blanks"), "{blank}");
        let comments = format!("{}t,id,x,y\n0,v,0,0", "# long header comment\n".repeat(100_000));
        assert!(read(&comments).is_ok(), "comments are not part of a row");
    }

    #[test]
    fn an_unclosed_quote_is_reported_where_it_opens() {
        let open = "f.csv:3:3: a quote opens here and is not closed; quotes must enclose a whole field; close it";
        for rest in ["2,v,0,0\n".to_string(), String::new(), "2,w,0,0\n".repeat(200_000)] {
            let error = error(&format!("t,id,x,y\n0,v,0,0\n1,\"v,0,0\n{rest}"));
            assert!(error.starts_with(open), "{error}");
        }
        let other = error("t,id,x,y\n0,v,0,0\n1,\"v,0,0\n2,\"v\",0,0\n3,v,0,0\n");
        assert!(
            other.starts_with("f.csv:3:3: a quote opens here and is closed at 4:3, in the middle of a field;"),
            "{other}"
        );
        assert!(error("t,\"id,x,y\n0,v,0,0\n").starts_with("f.csv:1:3: a quote opens here and is not closed"));
        assert!(
            read("t,id,x,y,size\n0,\"v\" ,0,0,5\" long\n").is_ok(),
            "a quote within a field is an ordinary character"
        );
    }

    #[test]
    fn a_data_row_is_not_parsed_as_a_comment() {
        assert!(read("# a,b,c,d\nt,id,x,y\n# c\n0,v,0,0\n#\n# one, two\n").is_ok());
        let error = error("id,t,x,y\nv,0,0,0\n#1,0,0,0\n");
        assert!(error.starts_with("f.csv:3:1: begins with # like a comment, but has 4 fields like a row"), "{error}");
        assert!(read("id,t,x,y\n\"#1\",0,0,0\n").is_ok());
    }

    #[test]
    fn lines_may_end_with_cr_alone() {
        let rows: String = (0..50_000).map(|n| format!("{n},v,{n},0\r")).collect();
        let traffic = read(&format!("# c\rt,id,x,y\r\r{rows}")).unwrap();
        assert_eq!((traffic.vehicles.len(), traffic.end_us), (1, 49_999_000_000));
        let wrong = error("t,id,x,y\r0,v,0,0\r\r# c\r1,v,here,0\r");
        assert!(wrong.starts_with("f.csv:5:5: vehicle \"v\": x = \"here\" is not a number"), "{wrong}");
        let mixed = error("t,id,x,y\r\n0,v,0,0\r1,v,here,0\n");
        assert!(mixed.starts_with("f.csv:3:5: "), "{mixed}");
    }

    #[test]
    fn bytes_that_are_not_text_are_rejected() {
        let bytes = b"t,id,x,y\n0,\xff,0,0";
        let error = read_from(&bytes[..], "f.csv", &Options::default()).unwrap_err();
        assert!(error.to_string().starts_with("f.csv:2:3: not text; must be UTF-8"), "{error}");
        assert!(read_from(&[0; 2_000_000][..], "f.csv", &Options::default()).is_err());
    }
}
