//! Options of the traffic reader, and the traffic that it returns.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use standoff_io::geodesy::{Origin, Unit};
use standoff_io::text_source::Expectation;

use super::times::{Epoch, TimeForm};
use super::vehicle::Vehicle;

/// Expected contents, for messages.
pub(super) static TRAFFIC: Expectation =
    Expectation { description: "traffic", formats: "SUMO FCD (XML, CSV or Parquet), CSV tracks or GPX", is_map: false };

/// Options of the traffic reader.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Options {
    /// Unit of the file's coordinates.
    pub coordinates: Coordinates,
    /// Gap limit, s, finite and above 0: a vehicle without samples for longer is absent during the gap, unless it is
    /// parked. `None`: 2.5 times the median step between samples of a vehicle, and at least 1 s.
    pub gap_s: Option<f64>,
    /// Whether persons and containers of SUMO are targets.
    pub persons: Persons,
    /// Frames per second of a data set whose times are numbers of frames. `None`: 25.
    pub frame_rate_hz: Option<f64>,
    /// Origin of the local frame of a file in degrees. `None`: its first sample.
    pub origin: Option<Origin>,
}

/// Unit of the coordinates of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Coordinates {
    /// Determined from the file. CSV: by the column names; metres if there are columns of both units. FCD: degrees if
    /// SUMO's header comment states so, otherwise by the motion of the vehicles, because a drive in degrees is no
    /// plausible motion in metres. The reader rejects an FCD file for which neither is conclusive, and a CSV file whose
    /// columns `x` and `y` are degrees.
    #[default]
    Auto,
    /// Metres east and north.
    Metres,
    /// Degrees of longitude and latitude (WGS84).
    Degrees,
}

/// Whether persons and containers of SUMO are targets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Persons {
    /// Only vehicles are targets.
    #[default]
    Ignored,
    /// Persons and containers are targets, too.
    Included,
}

impl Persons {
    /// Returns whether a row of SUMO's tables is that of a person or container: they have a default type, or an edge but
    /// no lane, whereas vehicles have a lane and no edge.
    pub(super) fn is_person(kind: Option<&str>, lane: Option<&str>, edge: Option<&str>) -> bool {
        let is_blank = |text: Option<&str>| text.is_none_or(str::is_empty);
        matches!(kind, Some("DEFAULT_PEDTYPE" | "DEFAULT_CONTAINERTYPE")) || is_blank(lane) && !is_blank(edge)
    }
}

/// Setting to recommend if the unit of the coordinates cannot be determined.
pub(super) const COORDINATES_HELP: &str =
    "traffic.coordinates = \"metres\" or \"degrees\" (--set traffic.coordinates=degrees)";

/// The vehicles of one file; at least one.
///
/// ```
/// use standoff_sim::traffic::{Options, read_from};
///
/// let csv = "t,id,x,y\n0,car,0,0\n1,car,10,0\n2,car,20,0\n";
/// let traffic = read_from(csv.as_bytes(), "mine.csv", &Options::default())?;
/// assert_eq!((traffic.vehicles.len(), traffic.span_s()), (1, 2.0));
///
/// let error = read_from("t,id,x,y\n0,car,here,0\n".as_bytes(), "mine.csv", &Options::default()).unwrap_err();
/// assert!(error.to_string().starts_with("mine.csv:2:"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Traffic {
    /// Vehicles by time of first appearance, then name.
    pub vehicles: Vec<Vehicle>,
    /// Time of the first sample, microseconds, as in the file (which need not begin at 0).
    pub begin_us: i64,
    /// Time of the last sample, microseconds.
    pub end_us: i64,
    /// Origin of the local frame; `None` if the file was in metres.
    pub origin: Option<Origin>,
    /// What is implausible or ambiguous in the file, for the user.
    pub notes: Vec<String>,
    /// How the file writes its times.
    pub(crate) times: TimeForm,
}

impl Traffic {
    /// Returns the unit that was used for the file's coordinates.
    pub fn unit(&self) -> Unit {
        if self.origin.is_some() { Unit::Degrees } else { Unit::Metres }
    }

    /// Returns what the times count from.
    pub(super) fn epoch(&self) -> Epoch {
        self.times.epoch(self.begin_us)
    }

    /// Time of the first sample in UTC, microseconds since 1970; `None` if the times have another or an unknown start.
    pub fn begin_unix_us(&self) -> Option<i64> {
        (self.epoch() == Epoch::Utc).then_some(self.begin_us)
    }

    /// Time from the first sample to the last, s.
    pub fn span_s(&self) -> f64 {
        self.end_us.saturating_sub(self.begin_us) as f64 / 1e6
    }

    /// Returns the longest time without a sample, microseconds, and the vehicle and time of the samples around it.
    pub(crate) fn longest_gap(&self) -> (i64, [(&str, i64); 2]) {
        let mut all: Vec<(i64, &str)> = Vec::new();
        for vehicle in &self.vehicles {
            all.extend(vehicle.times_us().map(|time_us| (time_us, vehicle.name())));
        }
        all.sort_unstable();
        let gaps = all.windows(2).map(|pair| (pair[1].0 - pair[0].0, [pair[0], pair[1]].map(|(at, name)| (name, at))));
        gaps.max_by_key(|(gap_us, _)| *gap_us).unwrap_or((0, [("", self.begin_us); 2]))
    }

    /// Positions of all samples, east and north, m.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        self.vehicles.iter().flat_map(Vehicle::places)
    }

    /// Checksum over all vehicles and samples; files with the same traffic have the same checksum.
    pub fn crc32(&self) -> u32 {
        let mut crc = crc32fast::Hasher::new();
        self.vehicles.iter().for_each(|vehicle| vehicle.check_in(&mut crc));
        crc.finalize()
    }
}
