//! Scenarios: one file in, everything a run needs out: typed, drawn, checked, with no option left open.
//!
//! A scenario is TOML (see [`mod@file`] for the keys). [`Scenario::load`] reads it, applies what the command line changes,
//! draws what is given as a distribution, fills in the defaults and checks every range. The result can spell every
//! value out as text, which the record keeps.

mod builtin;
mod check;
mod error;
pub mod file;
mod form;
mod load;
mod locate;
mod number;
mod resolve;
mod schema;
mod start;
mod team;
mod traffic;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use standoff::{Duration, TargetId, TargetParams, TargetState, TeamParams, UavId, UavState};

pub use builtin::{BUILT_IN, BuiltIn, built_in, built_in_like};
pub use error::{Excerpt, Problem, ScenarioError};
pub use file::Minds;
pub use form::MISTAKES_MAX;
pub use load::{Edits, name_of};
pub(crate) use load::{LENGTH_MAX, SPELT_OUT};
pub use locate::Place;
pub use number::Number;
pub use schema::schema;

use crate::traffic::{Origin, Traffic, Unit};

/// Everything that determines a run.
///
/// ```
/// use standoff_sim::scenario::{Edits, Scenario};
///
/// let edits = Edits { set: vec!["duration_s=20".to_owned()], ..Edits::default() };
/// let scenario = Scenario::load("paper/table-2-pair", &edits, 7)?;
/// assert_eq!((scenario.uavs.len(), scenario.settings.duration.s()), (2, 20.0));
///
/// let wrong = Edits { set: vec!["guidance.lead_sec=3".to_owned()], ..Edits::default() };
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
    /// UAVs that drop out.
    pub outages: Vec<Outage>,
    /// What to be careful about.
    pub warnings: Vec<String>,
    /// Every value spelt out.
    file: file::ScenarioFile,
}

/// How a mission is flown: all of a scenario but who is in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Length of the mission.
    pub duration: Duration,
    /// Time between two scans, which is also the guidance period.
    pub period: Duration,
    /// From when on the settled metrics count.
    pub settle: Duration,
    /// What the UAVs agree on.
    pub team: TeamParams,
    /// Who keeps the team's picture.
    pub minds: Minds,
    /// The sensors' real noise.
    pub noise: Noise,
    /// How well targets are handed over.
    pub cue: CueError,
    /// The model that the targets follow, manoeuvres aside; `None` where they come from a file.
    pub model: Option<TargetParams>,
    /// The targets that manoeuvre, by id.
    pub manoeuvring: Arc<BTreeSet<u32>>,
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
    /// Loads a built-in scenario by name, or a file.
    pub fn load(name_or_file: &str, edits: &Edits, seed: u64) -> Result<Self, ScenarioError> {
        Template::load(name_or_file, edits)?.draw(seed)
    }

    /// Where its local plane touches the Earth, if its traffic file says.
    pub fn origin(&self) -> Option<Origin> {
        match &self.targets {
            Targets::Random { .. } => None,
            Targets::Traffic(traffic) => traffic.origin,
        }
    }

    /// What the coordinates of its traffic file were taken for, if it has one.
    pub fn traffic_unit(&self) -> Option<Unit> {
        match &self.targets {
            Targets::Random { .. } => None,
            Targets::Traffic(traffic) => Some(traffic.unit()),
        }
    }

    /// The scenario as text with every value spelt out; loading it gives the same run.
    pub fn resolved(&self) -> Result<String, ScenarioError> {
        resolve::text(&self.name, &self.file)
    }
}

/// A scenario before anything is drawn: one scenario for every seed.
///
/// ```
/// use standoff_sim::scenario::{Edits, Template};
///
/// // Read once, drawn for as many seeds as are wanted.
/// let template = Template::load("paper/table-2-pair", &Edits::default())?;
/// let (one, two) = (template.draw(1)?, template.draw(2)?);
/// assert_eq!(one.settings, two.settings);
/// assert_ne!(one.resolved()?, two.resolved()?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Template {
    typed: load::Typed,
    traffic: Option<Arc<Traffic>>,
}

impl Template {
    /// Loads a built-in scenario by name, or a file, and the traffic file it names.
    pub fn load(name_or_file: &str, edits: &Edits) -> Result<Self, ScenarioError> {
        Self::with_traffic(load::Typed::load(name_or_file, edits)?)
    }

    /// The scenario that a text of [`Self::text`] tells of, with the traffic file it names: built in, or looked for from
    /// the current folder; or with `traffic` in its place.
    pub fn of_text(name: &str, text: &str, traffic: Option<&Path>) -> Result<Self, ScenarioError> {
        let mut typed = load::Typed::of_text(name, text)?;
        if let (Some(table), Some(file)) = (&mut typed.file.traffic, traffic) {
            table.file = file.to_string_lossy().into_owned();
        }
        Self::with_traffic(typed)
    }

    /// With the traffic file read. What is wrong in the scenario's form, in its ranges and in that file is told at once.
    fn with_traffic(typed: load::Typed) -> Result<Self, ScenarioError> {
        let (traffic, mut problems) = match traffic::read(&typed) {
            Ok(traffic) if typed.problems.is_empty() => return Ok(Self { typed, traffic: traffic.map(Arc::new) }),
            Ok(traffic) => (traffic, Vec::new()),
            Err(error) if error.is_machine_s => return Err(error),
            Err(error) => (None, error.problems),
        };
        if let Err(error) = resolve::checked(&typed, traffic.as_ref(), 0) {
            problems.splice(..0, error.problems);
        }
        Err(problems.into())
    }

    /// The scenario's name.
    pub fn name(&self) -> &str {
        &self.typed.name
    }

    /// The scenario before anything is drawn, as TOML in one spelling: with what the command line changed, and with
    /// defaults spelt out. Of a traffic file only the name is in it: see [`Self::traffic_crc32`].
    pub fn text(&self) -> Result<String, ScenarioError> {
        resolve::text(&self.typed.origin.label, &self.typed.file)
    }

    /// A checksum of what was read from the traffic file, whatever its name and form.
    pub fn traffic_crc32(&self) -> Option<u32> {
        self.traffic.as_ref().map(|traffic| traffic.crc32())
    }

    /// The scenario of a seed.
    pub fn draw(&self, seed: u64) -> Result<Scenario, ScenarioError> {
        resolve::resolve(&self.typed, self.traffic.as_ref(), seed)
    }
}

impl Settings {
    /// The settings of a resolved scenario, as a record keeps it; `label` names it in messages. No traffic file is
    /// needed.
    pub fn of_record(label: &str, resolved: &str) -> Result<Self, ScenarioError> {
        resolve::settings_of_record(load::Typed::of_text(label, resolved)?)
    }
}
