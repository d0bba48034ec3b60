//! Reads traffic that was recorded elsewhere (real, or from a traffic simulator) as vehicles that move over time.
//!
//! The reader recognises the format by the content, never by the name. Text is plain or gzip, with lines that end with
//! LF, CRLF or CR.
//!
//! **SUMO floating-car data** (`sumo --fcd-output`): `<fcd-export>` contains `<timestep time>` (s, strictly
//! increasing), which contains `<vehicle id x y>`. `x`, `y` are metres east and north, or longitude and
//! latitude in degrees (`--fcd-output.geo`), of the middle of the FRONT bumper, and are used as the vehicle's position.
//! The velocity is the mean motion over a second, as in all files: SUMO's `speed` is the mean over the step before, half a
//! step ahead of the positions, and its `angle` may be from grid north. Persons and containers are targets on request. Other elements are ignored, unless they are traffic that is misspelt or out of place. SUMO's
//! CSV and Parquet are read, too (`timestep_time`, `vehicle_id`, `vehicle_x`, `vehicle_y`). If the first row is a person or a container, SUMO names the columns of all rows after it.
//!
//! **CSV tracks**: a header names the columns (upper or lower case, any order; other columns are ignored), followed by
//! one row per vehicle and time. Rows need not be sorted, but the times of each vehicle must increase; of samples at one
//! time, the first counts. Lines that begin
//! with `#` are skipped. Quotes enclose whole fields. Commas, semicolons, tabs or vertical bars separate the fields,
//! whichever the header has most of; without commas, numbers may have decimal commas, all of them or none. Times are numbers, or dates and times in ISO
//! 8601: all with an offset from UTC (or Z), or all without.
//!
//! | what | column |
//! |---|---|
//! | time, s | `t_s`, `time_s`, `t`, `time`, `timestep_time`, `timestamp`, `timestamp_s`, `datetime` |
//! | or ms | `t_ms`, `time_ms`, `timestamp_ms` |
//! | vehicle | `vehicle`, `vehicle_id`, `id`, `track`, `track_id`, `target`, `target_id` |
//! | metres east | `x_m`, `x_east_m`, `x`, `east_m` |
//! | metres north | `y_m`, `y_north_m`, `y`, `north_m` |
//! | latitude, degrees | `lat_deg`, `lat`, `latitude`, `latitude_deg` |
//! | longitude, degrees | `lon_deg`, `lon`, `longitude`, `longitude_deg`, `lng`, `long` |
//!
//! Columns of highD, of inD, rounD, exiD and uniD, and of NGSIM are recognised. Samples without a position are skipped.
//!
//! **GPX**: each `trk` is a vehicle, with its `name` or a number, but those of one name are one vehicle unless they overlap
//! in time; a `trkpt` needs `lat`, `lon` and `time`. Between segments (`trkseg`), a vehicle is absent.
//!
//! Degrees (WGS84) are converted to metres east and north in the plane that touches the ellipsoid at the file's first
//! sample. A vehicle without samples for longer than the gap limit is absent during the gap, unless it is parked. The reader rejects a
//! vehicle that is faster than 10 km/s between two samples, and files beyond [`MAX_SAMPLES`] and the other limits. It
//! checks everything while reading, one XML element or CSV row at a time, so that later use cannot fail.

mod build;
mod csv;
mod fcd;
mod gpx;
mod join;
mod limits;
mod model;
mod names;
mod notes;
mod parquet;
mod times;
mod unit_detection;
mod validate;
mod vehicle;
mod xml;

use std::io::{BufRead, Read};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use join::Joined;
pub(crate) use limits::MAX_AT_ONCE;
pub use limits::{MAX_SAMPLES, MAX_VEHICLES};
use model::TRAFFIC;
pub use model::{Coordinates, Options, Persons, Traffic};
pub(crate) use times::{DAY_US, is_rollover};
pub use vehicle::{Vehicle, VehicleState};

use standoff_io::display_text;
pub use standoff_io::text_source::Position;
use standoff_io::text_source::{self, Fault, Text};

/// File name that stands for standard input.
pub(crate) const STANDARD_INPUT: &str = "-";

/// Error of a traffic file; prints as one line, `FILE:LINE:COLUMN: what is wrong; what is allowed; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {message}", display_text::escaped(file), position.map(|at| format!(":{at}")).unwrap_or_default())]
pub struct TrafficError {
    /// File name as given by the caller.
    pub file: String,
    /// Position in the (unpacked) text; `None` if the error concerns the file as a whole.
    pub position: Option<Position>,
    /// What is wrong, without the position.
    pub message: String,
    /// True if the machine failed to read the file, rather than the file being wrong.
    pub is_io_error: bool,
}

/// Reads the traffic file at `path`. Fails if it is not a file (but a pipe, for example) or is too large, before
/// anything is read; if it cannot be read; or as [`read_from`] does.
pub fn read(path: &Path, options: &Options) -> Result<Traffic, TrafficError> {
    let name = path.display().to_string();
    let read = match parquet::is_parquet(path) {
        true => check_options(options).and_then(|()| parquet::read(path, options)),
        false => parse(|| text_source::open(path, &TRAFFIC), options),
    };
    read.map_err(named(&name))
}

/// Reads traffic from standard input, which must be text, plain or gzip. Fails if it was read before, or as
/// [`read_from`] does.
pub(crate) fn read_standard_input(options: &Options) -> Result<Traffic, TrafficError> {
    static IS_READ: AtomicBool = AtomicBool::new(false);
    let name = "standard input";
    if IS_READ.swap(true, Ordering::Relaxed) {
        let message = "has already been read; can be read once; write it to a file, and name that";
        return Err(named(name)(Fault::whole(message.to_owned())));
    }
    read_from(std::io::stdin().lock(), name, options)
}

/// Reads traffic from bytes; errors use `name` as the file name. Fails with a position if any part of it breaks the
/// rules above.
pub fn read_from(reader: impl Read, name: &str, options: &Options) -> Result<Traffic, TrafficError> {
    parse(|| text_source::text(reader, &TRAFFIC), options).map_err(named(name))
}

fn named(file: &str) -> impl FnOnce(Fault) -> TrafficError {
    move |fault| {
        let Fault { position, message, is_io_error } = fault;
        TrafficError { file: file.to_string(), position, message, is_io_error }
    }
}

/// Formats that are not read: the first bytes, the name of the format, and how to get one that is read.
const OTHERS: [(&[u8], &str, &str); 3] = [
    (b"PAR1", "Parquet that is compressed or from standard input", "an uncompressed file on disk"),
    (b"QGC WPL", "a mission of QGroundControl, which has no vehicles", "CSV tracks"),
    (b"HFDTE", "an IGC flight log", "GPX, for example with gpsbabel -i igc -o gpx"),
];

fn check_options(options: &Options) -> Result<(), Fault> {
    if let Some(gap_s) = options.gap_s
        && !(gap_s.is_finite() && gap_s > 0.0)
    {
        return Err(Fault::whole(format!(
            "gap limit = {gap_s} s; must be finite and above 0 s; leave it out for the default"
        )));
    }
    Ok(())
}

fn parse<'a>(text: impl FnOnce() -> Result<Text<'a>, Fault>, options: &Options) -> Result<Traffic, Fault> {
    check_options(options)?;
    let mut lines = text()?;
    match lines.first_byte()? {
        None => Err(Fault::whole(format!("contains no text; must be {}", TRAFFIC.formats))),
        Some(b'<') => xml::read(lines, options),
        Some(b'{' | b'[') => Err(foreign(
            "JSON, such as GeoJSON or a plan of QGroundControl",
            "CSV with the columns time, vehicle, latitude and longitude",
        )),
        Some(b'$' | b'!') => Err(foreign("NMEA sentences", "GPX or CSV, for example with gpsbabel -i nmea -o gpx")),
        Some(_) => {
            let head = lines.fill_buf().map_err(|error| text_source::input_fault(None, &error))?;
            match OTHERS.into_iter().find(|(start, ..)| head.starts_with(start)) {
                Some((_, found, nearest)) => Err(foreign(found, nearest)),
                None => csv::read(lines, options),
            }
        }
    }
}

/// Creates the error of a file in a known format that is not read, with the nearest one that is.
fn foreign(found: &str, nearest: &str) -> Fault {
    Fault::whole(format!("contains {found}; must be {}; convert it to {nearest}", TRAFFIC.formats))
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::{self, Write};

    const XML: &str = "<fcd-export><timestep time=\"1\"><vehicle id=\"v\" x=\"300\" y=\"4\"/></timestep></fcd-export>";
    const CSV: &str = "t,id,x,y\n1,v,3,4\n";

    fn packed(text: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    }

    fn read_bytes(bytes: &[u8]) -> Result<Traffic, TrafficError> {
        read_from(bytes, "f", &Options::default())
    }

    /// Yields one byte at a time.
    struct Drops<'a>(&'a [u8]);

    impl Read for Drops<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let count = out.len().min(1);
            self.0.read(&mut out[..count])
        }
    }

    #[test]
    fn the_format_is_recognised_by_the_content() {
        for text in [XML, CSV] {
            let expected = read_bytes(text.as_bytes()).unwrap();
            let marked = [b"\xEF\xBB\xBF", text.as_bytes()].concat();
            let indented = [b" \r\n\t", text.as_bytes()].concat();
            for bytes in [text.as_bytes(), &marked, &indented] {
                assert_eq!(read_bytes(bytes).unwrap(), expected);
                assert_eq!(read_bytes(&packed(bytes)).unwrap(), expected);
                assert_eq!(read_from(Drops(&packed(bytes)), "f", &Options::default()).unwrap(), expected);
                assert_eq!(read_from(Drops(bytes), "f", &Options::default()).unwrap(), expected);
            }
        }
        let (head, tail) = CSV.as_bytes().split_at(10);
        let members = [packed(head), packed(tail)].concat();
        assert!(read_bytes(&members).is_ok(), "gzip files may be concatenated");
    }

    #[test]
    fn a_byte_order_mark_is_not_counted_as_a_column() {
        let error = read_bytes(b"\xEF\xBB\xBF<routes/>").unwrap_err();
        assert_eq!(error.position, Some(Position { line: 1, column: 1 }));
    }

    #[test]
    fn empty_files_are_refused() {
        for (bytes, expected) in [
            (Vec::new(), "f: is empty; must be SUMO FCD (XML, CSV or Parquet), CSV tracks or GPX"),
            (b" \r\n ".to_vec(), "f: contains no text; must be SUMO FCD (XML, CSV or Parquet), CSV tracks or GPX"),
            (packed(b""), "f: contains no text; must be SUMO FCD (XML, CSV or Parquet), CSV tracks or GPX"),
        ] {
            assert_eq!(read_bytes(&bytes).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn formats_that_are_not_read_are_named() {
        for (bytes, expected) in [
            (
                &b"{\"fileType\": \"Plan\"}"[..],
                "f: contains JSON, such as GeoJSON or a plan of QGroundControl; must be",
            ),
            (b"[1]", "f: contains JSON, such as"),
            (b"PAR1\x15\0", "f: contains Parquet that is compressed or from standard input; must be"),
            (b"QGC WPL 110\n", "f: contains a mission of QGroundControl, which has no vehicles; must be"),
            (b"HFDTE010326\n", "f: contains an IGC flight log; must be"),
            (
                b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47",
                "f: contains NMEA sentences; must be",
            ),
        ] {
            let error = read_bytes(bytes).unwrap_err().to_string();
            assert!(error.starts_with(expected) && error.contains("; convert it to "), "{error}");
        }
        for (root, nearest) in
            [("kml", "this is KML: make GPX"), ("net", "this is a SUMO net"), ("TrainingCenterDatabase", "TCX")]
        {
            let error = read_bytes(format!("<?xml version=\"1.0\"?>\n<{root}/>").as_bytes()).unwrap_err().to_string();
            let expected =
                format!("f:2:1: element = \"{root}\"; the only root element must be fcd-export or gpx; this is ");
            assert!(error.starts_with(&expected) && error.contains(nearest), "{error}");
        }
    }

    /// The same run of SUMO in all of its formats that are text.
    #[test]
    fn csv_of_sumo_is_the_same_traffic_as_its_xml() {
        let (mut xml, mut csv) = (
            "<fcd-export><timestep time=\"0.00\"/>".to_owned(),
            "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_type;vehicle_speed\n0.00;;;;;;\n"
                .to_owned(),
        );
        for second in 1..5 {
            let x_m = 12.5 * f64::from(second);
            let angle_deg = 80 + second;
            xml += &format!(
                "<timestep time=\"{second}.00\"><vehicle id=\"a\" x=\"{x_m}\" y=\"3\" angle=\"{angle_deg}\" speed=\"12.4\"/>\
                 <person id=\"p\" x=\"{second}\" y=\"0\" angle=\"0\" speed=\"1\"/></timestep>"
            );
            csv +=
                &format!("{second}.00;a;{x_m};3;{angle_deg};car;12.4\n{second}.00;p;{second};0;0;DEFAULT_PEDTYPE;1\n");
        }
        for persons in [Persons::Ignored, Persons::Included] {
            let options = Options { persons, ..Options::default() };
            let [of_xml, of_csv] = [xml.clone() + "</fcd-export>", csv.clone()]
                .map(|text| read_from(text.as_bytes(), "f", &options).unwrap());
            assert_eq!(of_xml, of_csv);
            assert_eq!(of_csv.vehicles.len(), if persons == Persons::Ignored { 1 } else { 2 });
        }
    }

    #[test]
    fn gzip_cut_off_anywhere_is_refused() {
        for text in [XML, CSV] {
            let whole = packed(text.as_bytes());
            for length in 2..whole.len() {
                let error = read_bytes(&whole[..length]).unwrap_err();
                assert!(error.message.starts_with("the gzip data end too early"), "{length}: {error}");
            }
        }
    }

    #[test]
    fn damaged_gzip_is_refused() {
        let mut bytes = packed(XML.as_bytes());
        let checksum = bytes.len() - 8;
        bytes[checksum] ^= 1;
        let error = read_bytes(&bytes).unwrap_err();
        assert!(error.message.starts_with("the gzip data are damaged"), "{error}");
        assert!(read_bytes(b"\x1f\x8bnot gzip at all").is_err());
    }

    #[test]
    fn a_file_that_cannot_be_opened_is_named_with_the_reason() {
        let missing = read(Path::new("/nowhere/a\n.csv"), &Options::default()).unwrap_err();
        assert_eq!(missing.file, "/nowhere/a\n.csv");
        let text = missing.to_string();
        assert!(text.starts_with("/nowhere/a\\n.csv: cannot be read: No such file"), "{text}");
        let folder = read(&std::env::temp_dir(), &Options::default()).unwrap_err();
        assert!(folder.to_string().contains(": cannot be read: "), "{folder}");
    }

    #[test]
    fn the_gap_limit_must_be_a_positive_duration() {
        for gap_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let options = Options { gap_s: Some(gap_s), ..Options::default() };
            let error = read_from(XML.as_bytes(), "f", &options).unwrap_err();
            assert!(error.message.starts_with("gap limit = "), "{error}");
        }
    }

    #[test]
    fn reading_twice_gives_the_same_traffic() {
        assert_eq!(read_bytes(XML.as_bytes()), read_bytes(XML.as_bytes()));
    }

    /// A disk that fails in the middle of a file is not an error of the file or of the scenario that names it.
    #[test]
    fn machine_failures_and_wrong_files_are_distinguished() {
        struct Failing;
        impl Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::from_raw_os_error(5))
            }
        }
        let error = read_from(CSV.as_bytes().chain(Failing), "f", &Options::default()).unwrap_err();
        assert!(error.is_io_error && error.message.ends_with("check the disk"), "{error}");
        assert!(crate::scenario::ScenarioError::from(error).is_io_error);
        let error = read(Path::new("no/such/file.csv"), &Options::default()).unwrap_err();
        assert!(!error.is_io_error && !crate::scenario::ScenarioError::from(error).is_io_error);
    }
}
