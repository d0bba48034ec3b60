//! The resolved scenario: all inputs of one run.

use std::collections::BTreeSet;
use std::sync::Arc;

use standoff::{Duration, Geofence, SensorParams, TargetParams, TargetState, TeamParams, UavId, UavState};
use standoff_io::geodesy::{Origin, Unit};
use standoff_score::{Buildings, CueError, Noise, Priorities, ScoreConfig};

use super::basemap::MapFile;
use super::schema_types::{AgentSetup, Clock, Manoeuvre, Outage, Radio, Restart, ScenarioFile};
use crate::navigation::NavigationModel;
use crate::traffic::Traffic;
use crate::wind::WindModel;

/// A resolved scenario: all inputs of one run.
///
/// ```
/// use standoff_sim::scenario::{Overrides, Scenario};
///
/// let overrides = Overrides { set: vec!["duration_s=20".to_owned()], ..Overrides::default() };
/// let scenario = Scenario::load("paper/table-2-pair", &overrides, 7)?;
/// assert_eq!((scenario.uavs.len(), scenario.settings.duration.s()), (2, 20.0));
///
/// let wrong = Overrides { set: vec!["guidance.lead_sec=3".to_owned()], ..Overrides::default() };
/// let error = Scenario::load("paper/table-2-pair", &wrong, 7).unwrap_err();
/// assert_eq!(error.to_string(), "command line: guidance.lead_sec: there is no such key; did you mean `lead_s`?");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scenario {
    /// Name of the built-in scenario, or of the file without its extension.
    pub name: String,
    /// Seed of all random draws.
    pub seed: u64,
    /// Settings of the team, sensors and targets.
    pub settings: Settings,
    /// Initial states of the UAVs.
    pub uavs: Vec<UavState>,
    /// The targets.
    pub targets: Targets,
    /// Background map files; they do not affect the mission.
    pub map: Vec<MapFile>,
    /// Aircraft outside the team.
    pub intruders: Vec<Intruder>,
    /// Outages of UAVs.
    pub outages: Vec<Outage>,
    /// Radio faults; `None`: every message is received immediately.
    pub radio: Option<Radio>,
    /// Start time of the computer of each UAV, s.
    pub starts_s: Vec<f64>,
    /// Restarts of computers.
    pub restarts: Vec<Restart>,
    /// Clock errors, at most one per UAV.
    pub clocks: Vec<Clock>,
    /// Warnings about the scenario.
    pub warnings: Vec<String>,
    /// The scenario file with every value.
    pub(super) file: ScenarioFile,
}

/// Settings of a mission: a scenario without the states of UAVs, targets and intruders.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Description of the scenario in one line.
    pub about: String,
    /// Length of the mission.
    pub duration: Duration,
    /// Time between two scans, which is also the guidance period.
    pub period: Duration,
    /// End of the transient: start of the interval of the `..._settled` metrics.
    pub transient: Duration,
    /// Cut-off distance of GOSPA, m.
    pub gospa_cutoff_m: f64,
    /// Parameters that all UAVs share.
    pub team: TeamParams,
    /// Keep-out and keep-in zones.
    pub geofence: Geofence,
    /// Buildings that hide targets from the sensors.
    pub buildings: Buildings,
    /// Priorities of targets, and areas of interest.
    pub priorities: Arc<Priorities>,
    /// One agent for the team, or one per UAV.
    pub agents: AgentSetup,
    /// What the sensors detect and report.
    pub sensor: SensorModel,
    /// Errors of the states that the UAVs assume.
    pub navigation: NavigationModel,
    /// True wind; `None`: calm air.
    pub wind: Option<WindModel>,
    /// True if banking aircraft fly a commanded speed as equivalent instead of true airspeed.
    pub flies_equivalent_airspeed: bool,
    /// Errors of cues.
    pub cue: CueError,
    /// Motion model of the targets without manoeuvres; `None` if they come from a file.
    pub model: Option<TargetParams>,
    /// Number of intruders.
    pub intruders: usize,
    /// Ids of the targets that manoeuvre.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// End of the last radio fault or restart that ends within the mission, s. The record contains late starts of
    /// computers.
    pub faults_end_s: Option<f64>,
}

impl Settings {
    /// Motion model of the targets; `None` if they come from a file or some manoeuvre.
    #[must_use]
    pub fn motion(&self) -> Option<TargetParams> {
        self.model.filter(|_| self.manoeuvring.is_empty())
    }

    /// Returns the scoring configuration of a mission whose controller reports all tables.
    #[must_use]
    pub fn score_config(&self) -> ScoreConfig {
        ScoreConfig {
            motion: self.motion(),
            manoeuvring: Arc::clone(&self.manoeuvring),
            noise: self.sensor.noise(),
            cue: self.cue,
            transient_s: self.transient.s(),
            gospa_cutoff_m: self.gospa_cutoff_m,
            geofence: self.geofence.clone(),
            buildings: self.buildings.clone(),
            priorities: Arc::clone(&self.priorities),
            faults_end_s: self.faults_end_s,
            ..ScoreConfig::new(&self.team, self.period.s())
        }
    }
}

/// What the sensors of a mission detect and report. The team's own assumptions are `TeamParams::track`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorModel {
    /// True if detections and cues have the identity of their target.
    pub has_labels: bool,
    /// Field of view and range, and the true noise, detection probability, MDV and number of false alarms.
    pub truth: SensorParams,
    /// True standard deviation of the range rate, m/s; `None` if it is not measured.
    pub range_rate_sd_m_s: Option<f64>,
}

impl SensorModel {
    /// True if every scan detects all targets in view.
    #[must_use]
    pub fn always_detects(&self) -> bool {
        self.truth.detection_probability >= 1.0 && self.truth.mdv_m_s <= 0.0
    }

    /// Returns the true noise of range and bearing.
    #[must_use]
    pub fn noise(&self) -> Noise {
        Noise { range_sd_m: self.truth.range_sd_m, bearing_sd_rad: self.truth.bearing_sd_rad }
    }
}

/// Source of the targets.
#[derive(Debug, Clone)]
pub enum Targets {
    /// Drawn from the target model.
    Random {
        /// The model.
        model: TargetParams,
        /// Their initial states.
        start: Vec<TargetState>,
        /// Manoeuvres of some targets.
        manoeuvres: Vec<Manoeuvre>,
    },
    /// Read from a file.
    Traffic(Arc<Traffic>),
}

/// An aircraft outside the team.
#[derive(Debug, Clone, PartialEq)]
pub struct Intruder {
    /// Initial state.
    pub start: UavState,
    /// UAV that it turns towards, if any.
    pub pursued_uav: Option<UavId>,
    /// Turn rate if it pursues no UAV, rad/s, positive anticlockwise.
    pub turn_rate_rad_s: f64,
    /// Altitude, m; `None`: that of the pursued UAV.
    pub altitude_m: Option<f64>,
    /// Intervals without position reports: start and end, s.
    pub transponder_off_s: Vec<[f64; 2]>,
}

impl Scenario {
    /// Origin of the local plane on the Earth, if the traffic file is in degrees.
    pub fn origin(&self) -> Option<Origin> {
        self.traffic()?.origin
    }

    /// Unit of the coordinates in the traffic file, if there is one.
    pub fn traffic_unit(&self) -> Option<Unit> {
        self.traffic().map(Traffic::unit)
    }

    /// Start of the mission in UTC, microseconds since 1970, if the traffic file has it.
    pub fn begin_unix_us(&self) -> Option<i64> {
        self.traffic()?.begin_unix_us()
    }

    pub(super) fn traffic(&self) -> Option<&Traffic> {
        match &self.targets {
            Targets::Random { .. } => None,
            Targets::Traffic(traffic) => Some(traffic),
        }
    }
}
