//! Parameters that all UAVs of a team share: limits, filters, groups and guidance law.
//!
//! `params/table.rs` declares each of them once, with name, unit, range, values of the presets, meaning and scenario
//! key. [`TeamParams::table`] lists them for programs: the scenario loader, its JSON schema and the Python package read
//! that list.

#[macro_use]
mod declare;
mod relations;
mod table;
mod words;

use crate::time::Duration;
use crate::validation::{Allowed, ParamError, errors_of};

pub use table::{
    ClimbParams, GroupingParams, GuidanceParams, LogParams, MotionParams, SensorParams, SeparationParams,
    StandoffParams, TargetParams, TeamParams, TrackParams, UavParams,
};
pub use words::{
    AltitudePolicy, CentreEstimate, CentreJump, Feedforward, GroupCount, Integrator, Lead, Margin, Objective,
    OrbitDirection, Pointing, RemovalRule, SpeedReference,
};

/// Minimum range of a usable measurement, m. At shorter ranges the Jacobian's 1/r diverges and the bearing is useless.
pub const RANGE_MIN_M: f64 = 1.0;

/// Link model: what a team expects of its radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkModel {
    /// Every message arrives. A briefly silent UAV is extrapolated straight ahead, each group has its own altitude, and
    /// the UAVs of one group keep their phase difference.
    Ideal,
    /// Messages get lost, so that safety does not depend on equal team states. A silent UAV is extrapolated along its
    /// last turn. Each UAV has its own altitude, given by its id, and keeps its phase difference from every UAV that it
    /// receives near its orbit.
    Lossy,
}

/// Declaration of a scalar parameter.
///
/// ```
/// use standoff::{ParamValue, TeamParams};
///
/// let gain = TeamParams::table().iter().find(|param| param.key == "guidance.heading_gain_1_s").expect("a parameter");
/// assert_eq!(gain.value(&TeamParams::paper()), Some(ParamValue::Number(2.0)));
/// assert_eq!(gain.value(&TeamParams::recommended()), Some(ParamValue::Number(1.0)));
///
/// let mut team = TeamParams::recommended();
/// assert!(gain.set(&mut team, ParamValue::Number(0.5)));
/// assert_eq!(team.guidance.heading_gain_1_s, 0.5);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ParamInfo {
    /// Path in [`TeamParams`]: field names joined by dots, as in [`ParamError::path`].
    pub path: &'static str,
    /// Key in scenario files, dotted. Angles are in degrees there. Two parameters may share a key.
    pub key: &'static str,
    /// Doc comment, as lines that begin with a space.
    doc: &'static str,
    /// Kind of its values.
    pub kind: ParamKind,
    get: fn(&TeamParams) -> Option<ParamValue>,
    set: fn(&mut TeamParams, ParamValue) -> bool,
}

/// Kind of a parameter.
#[derive(Debug, Clone, Copy)]
pub enum ParamKind {
    /// A number.
    Number {
        /// Unit in the library; `1` if the parameter is dimensionless.
        unit: &'static str,
        /// Range. Bounds that other parameters set are only in its [`Allowed::because`].
        allowed: Allowed,
    },
    /// One of these words.
    Word(&'static [Word]),
    /// True or false.
    Flag,
}

/// A word that selects an option.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    /// The word.
    pub word: &'static str,
    /// Doc comment, as lines that begin with a space.
    doc: &'static str,
}

/// Value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamValue {
    /// A number, in the unit of the library.
    Number(f64),
    /// A word.
    Word(&'static str),
    /// True or false.
    Flag(bool),
}

impl ParamInfo {
    /// Name of the field: the last part of the path.
    pub fn name(&self) -> &'static str {
        self.path.rsplit('.').next().unwrap_or(self.path)
    }

    /// Returns the meaning, as one line; without unit and range.
    pub fn doc(&self) -> String {
        one_line(self.doc)
    }

    /// True for an angle, which is in radians here and in degrees in scenario files.
    pub fn is_angle(&self) -> bool {
        matches!(self.kind, ParamKind::Number { unit: "rad", .. })
    }

    /// Returns the value in `team`; `None` if it belongs to an optional part that is absent.
    pub fn value(&self, team: &TeamParams) -> Option<ParamValue> {
        (self.get)(team)
    }

    /// Sets the value in `team`. Returns false if it belongs to an optional part that is absent, or if the value is of
    /// another kind or an unknown word.
    pub fn set(&self, team: &mut TeamParams, value: ParamValue) -> bool {
        (self.set)(team, value)
    }
}

impl Word {
    /// Returns the meaning, as one line.
    pub fn doc(&self) -> String {
        one_line(self.doc)
    }
}

/// Joins the lines of a doc comment.
fn one_line(doc: &str) -> String {
    doc.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

/// A struct of parameters, or an optional one.
trait Part {
    fn paper() -> Self;
    fn recommended() -> Self;
    fn errors(&self) -> Vec<ParamError>;
}

impl<T: Part> Part for Option<T> {
    fn paper() -> Self {
        None
    }

    fn recommended() -> Self {
        None
    }

    fn errors(&self) -> Vec<ParamError> {
        self.as_ref().map(Part::errors).unwrap_or_default()
    }
}

/// Access to a struct of parameters that may be optional.
trait Reach<T> {
    fn reach(&self) -> Option<&T>;
    fn reach_mut(&mut self) -> Option<&mut T>;
}

impl<T: Part> Reach<T> for T {
    fn reach(&self) -> Option<&T> {
        Some(self)
    }

    fn reach_mut(&mut self) -> Option<&mut T> {
        Some(self)
    }
}

impl<T: Part> Reach<T> for Option<T> {
    fn reach(&self) -> Option<&T> {
        self.as_ref()
    }

    fn reach_mut(&mut self) -> Option<&mut T> {
        self.as_mut()
    }
}

impl Default for ClimbParams {
    /// A small fixed-wing UAV.
    fn default() -> Self {
        Part::recommended()
    }
}

impl Default for SeparationParams {
    fn default() -> Self {
        Part::recommended()
    }
}

impl TeamParams {
    /// Returns the parameters of Table I of the paper, with both active measures.
    ///
    /// The table does not specify the target's acceleration (here 0.2 m/s2), the sensing range (1,200 m) and the
    /// conditions under which a track is lost. The feedforward and the margin are this project's own forms.
    pub fn paper() -> Self {
        Part::paper()
    }

    /// Returns the recommended parameters: those of [`Self::paper`] with this project's modified grouping and guidance,
    /// as used by scenarios that set no parameters. `docs/validation.md` lists the measured gain of each modification.
    ///
    /// ```
    /// # use standoff::{Agent, TeamParams, UavId};
    /// let mut params = TeamParams::recommended();
    /// params.uav.speed_m_s = 25.0;
    /// params.uav.speed_change_max_m_s = 8.0;
    /// let agent = Agent::new(UavId(0), params)?;
    /// # Ok::<(), Vec<standoff::ParamError>>(())
    /// ```
    pub fn recommended() -> Self {
        Part::recommended()
    }

    /// Every scalar parameter.
    pub fn table() -> &'static [ParamInfo] {
        table::TABLE
    }

    /// Duration that a silent UAV still counts as part of the team.
    pub fn teammate_timeout(&self) -> Duration {
        Duration::from_s(self.teammate_timeout_s)
    }

    /// Returns the UAV parameters that cannot be integrated over a period: [`UavParams::errors_for_period`].
    pub fn errors_for_period(&self, period: Duration) -> Vec<ParamError> {
        errors_of([("uav", self.uav.errors_for_period(period))])
    }
}
