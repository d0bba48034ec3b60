//! What is flown: everything that determines a run.

use std::collections::BTreeSet;
use std::sync::Arc;

use standoff::{Duration, Geofence, TargetParams, TargetState, TeamParams, UavId, UavState};

use super::basemap::MapFile;
use super::number::Number;
use super::schema_types::AgentSetup;
use super::schema_types::resolved::ScenarioFile;
use crate::target_id::TargetId;
use crate::traffic::{Origin, Traffic, Unit};

/// Everything that determines a run.
///
/// ```
/// use standoff_sim::scenario::{Overrides, Scenario};
///
/// let edits = Overrides { set: vec!["duration_s=20".to_owned()], ..Overrides::default() };
/// let scenario = Scenario::load("paper/table-2-pair", &edits, 7)?;
/// assert_eq!((scenario.uavs.len(), scenario.settings.duration.s()), (2, 20.0));
///
/// let wrong = Overrides { set: vec!["guidance.lead_sec=3".to_owned()], ..Overrides::default() };
/// let error = Scenario::load("paper/table-2-pair", &wrong, 7).unwrap_err();
/// assert_eq!(error.to_string(), "command line: guidance.lead_sec: there is no such key; did you mean `lead_s`?");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scenario {
    /// Name of the built-in scenario or of the file, without its ending.
    pub name: String,
    /// What it shows.
    pub about: String,
    /// The seed of every draw.
    pub seed: u64,
    /// How the mission is flown.
    pub settings: Settings,
    /// Where the UAVs start.
    pub uavs: Vec<UavState>,
    /// The targets.
    pub targets: Targets,
    /// What lies under the vehicles, to be looked at only.
    pub map: Vec<MapFile>,
    /// Aircraft that are not of the team.
    pub intruders: Vec<Intruder>,
    /// UAVs that drop out.
    pub outages: Vec<Outage>,
    /// How what they say is carried; `None`: all hear everything, at once.
    pub radio: Option<Radio>,
    /// When each UAV's computer starts, s, by UAV.
    pub starts_s: Vec<f64>,
    /// Computers that start anew.
    pub restarts: Vec<Restart>,
    /// Clocks that are off, at most one of a UAV.
    pub clocks: Vec<Clock>,
    /// What to be careful about.
    pub warnings: Vec<String>,
    /// Every value spelt out.
    pub(super) file: ScenarioFile,
}

/// How a mission is flown: all of a scenario but who is in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Length of the mission.
    pub duration: Duration,
    /// Time between two scans, which is also the guidance period.
    pub period: Duration,
    /// From when on the settled metrics count.
    pub transient: Duration,
    /// What the UAVs agree on.
    pub team: TeamParams,
    /// Where they may fly.
    pub geofence: Geofence,
    /// Who keeps the team's picture.
    pub agents: AgentSetup,
    /// The sensors' real noise.
    pub noise: Noise,
    /// How well targets are handed over.
    pub cue: CueError,
    /// The model that the targets follow, manoeuvres aside; `None` where they come from a file.
    pub model: Option<TargetParams>,
    /// How many aircraft fly there that are not of the team.
    pub intruders: usize,
    /// The targets that manoeuvre, by id.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// When the last of those faults of the radio, and restarts, is over that are so within the mission, s. When a computer
    /// starts late, the record tells.
    pub faults_end_s: Option<f64>,
}

impl Settings {
    /// The model that all that targets do follows; `None` where they come from a file or manoeuvre.
    #[must_use]
    pub fn motion(&self) -> Option<TargetParams> {
        self.model.filter(|_| self.manoeuvring.is_empty())
    }
}

/// Noise of the sensors as they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the range, m.
    pub range_sd_m: f64,
    /// Standard deviation of the bearing, rad.
    pub bearing_sd_rad: f64,
}

/// Error of the cues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CueError {
    /// Standard deviation of the position per axis, m.
    pub position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    pub velocity_sd_m_s: f64,
}

/// Where targets come from.
#[derive(Debug, Clone)]
pub enum Targets {
    /// Drawn from the target model.
    Random {
        /// The model.
        model: TargetParams,
        /// Their first states.
        start: Vec<TargetState>,
        /// What some of them do on purpose.
        manoeuvres: Vec<Manoeuvre>,
    },
    /// Read from a file.
    Traffic(Arc<Traffic>),
}

/// A time in which a UAV sees nothing and is not heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outage {
    /// Which UAV.
    pub uav: UavId,
    /// From when, s.
    pub from_s: f64,
    /// Until when, s; not before `from_s`.
    pub until_s: f64,
}

/// An aircraft that is not of the team.
#[derive(Debug, Clone, PartialEq)]
pub struct Intruder {
    /// Where it starts, and how fast.
    pub start: UavState,
    /// The UAV at which it turns.
    pub pursued_uav: Option<UavId>,
    /// Its turn rate where it pursues none, rad/s, positive anticlockwise.
    pub turn_rate_rad_s: f64,
    /// Altitude that it flies at, m; `None`: that of the UAV that it pursues.
    pub altitude_m: Option<f64>,
    /// When it does not tell where it is: from and until, s.
    pub transponder_off_s: Vec<[f64; 2]>,
}

/// How what UAVs say is carried from one to another. Cues come from outside: they are lost, late and double alike, but
/// come from everywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Radio {
    /// Probability that a message is lost, 0 to 1, drawn for each message and receiver.
    pub packet_loss: Number,
    /// How late a message is, s, not negative, drawn for each message and receiver.
    pub latency_s: Number,
    /// Probability that a message that is heard is heard twice, 0 to 1.
    pub duplication: f64,
    /// Further away nobody is heard, m, above 0.
    pub range_m: Option<f64>,
    /// What a UAV can send, bytes/s, above 0.
    pub bandwidth_bytes_per_s: Option<f64>,
    /// From when on it is perfect, partitions aside, s.
    pub fault_until_s: Option<f64>,
    /// Who hears whom otherwise, at most one of a pair.
    pub links: Vec<Link>,
    /// When only parts of the team hear each other.
    pub partitions: Vec<Partition>,
}

/// The way from one UAV to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Who speaks.
    pub from: UavId,
    /// Who hears.
    pub to: UavId,
    /// See [`LinkModel::packet_loss`].
    pub packet_loss: Number,
    /// See [`LinkModel::latency_s`].
    pub latency_s: Number,
}

/// A time in which only those of one side hear each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Partition {
    /// From when, s.
    pub from_s: f64,
    /// Until when, s; not before `from_s`.
    pub until_s: f64,
    /// The sides, no UAV in two. Who is in none hears nobody and is not heard.
    pub sides: Vec<Vec<UavId>>,
}

/// A computer that is switched off, and starts with an empty picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restart {
    /// Whose.
    pub uav: UavId,
    /// From when, s.
    pub at_s: f64,
    /// For how long, s, not negative.
    pub down_s: f64,
}

/// A clock that is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Whose.
    pub uav: UavId,
    /// How far it is ahead at the start, s.
    pub offset_s: f64,
    /// How much too fast it is, parts per million, above -1e6.
    pub drift_ppm: f64,
}

/// An acceleration beside the random one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manoeuvre {
    /// Who manoeuvres.
    pub target: TargetId,
    /// From when, s.
    pub from_s: f64,
    /// Until when, s; not before `from_s`.
    pub until_s: f64,
    /// East and north, m/s2.
    pub acceleration_m_s2: [f64; 2],
}

impl Scenario {
    /// Where its local plane touches the Earth, if its traffic file says.
    pub fn origin(&self) -> Option<Origin> {
        self.traffic()?.origin
    }

    /// What the coordinates of its traffic file were taken for, if it has one.
    pub fn traffic_unit(&self) -> Option<Unit> {
        self.traffic().map(Traffic::unit)
    }

    fn traffic(&self) -> Option<&Traffic> {
        match &self.targets {
            Targets::Random { .. } => None,
            Targets::Traffic(traffic) => Some(traffic),
        }
    }
}
