//! Named parameters of the components.

#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
#[cfg(feature = "stubs")]
use pyo3::{PyTypeInfo, type_hint_identifier, type_hint_union};
use standoff::{Feedforward, GuidanceParams, Lead, Objective, OrbitDirection, SpeedReference, TeamParams};

use crate::common_args::{Whole, count};
use crate::exceptions::InputError;
use crate::scenario;

/// Option of a parameter, given by name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Word<T>(T);

/// A type whose values are chosen by name; the names are those of scenario files.
pub(crate) trait Chosen: Copy + PartialEq + 'static {
    const NAME: &'static str;
    const WORDS: &'static [(&'static str, Self)];
}

/// [`Lead`] without its value in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LeadBy {
    Constant,
    Scheduled,
    Predicted,
}

impl Chosen for OrbitDirection {
    const NAME: &'static str = "orbit_direction";
    const WORDS: &'static [(&'static str, Self)] =
        &[("anticlockwise", Self::Anticlockwise), ("clockwise", Self::Clockwise)];
}

impl Chosen for LeadBy {
    const NAME: &'static str = "lead";
    const WORDS: &'static [(&'static str, Self)] =
        &[("constant", Self::Constant), ("scheduled", Self::Scheduled), ("predicted", Self::Predicted)];
}

impl Chosen for SpeedReference {
    const NAME: &'static str = "speed_reference";
    const WORDS: &'static [(&'static str, Self)] = &[("ground", Self::Ground), ("centre", Self::Centre)];
}

impl Chosen for Feedforward {
    const NAME: &'static str = "feedforward";
    const WORDS: &'static [(&'static str, Self)] = &[
        ("field", Self::Field),
        ("trajectory", Self::Trajectory),
        ("static-centre", Self::StaticCentre),
        ("paper", Self::Paper),
    ];
}

impl Chosen for Objective {
    const NAME: &'static str = "objective";
    const WORDS: &'static [(&'static str, Self)] = &[("log-det", Self::LogDet), ("paper", Self::Paper)];
}

impl<T: Chosen> FromPyObject<'_, '_> for Word<T> {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("builtins", "str");

    fn extract(given: Borrowed<'_, '_, PyAny>) -> Result<Self, Self::Error> {
        let typed = given.extract::<&str>().ok();
        if let Some((_, chosen)) = T::WORDS.iter().find(|(word, _)| Some(*word) == typed) {
            return Ok(Self(*chosen));
        }
        let words: Vec<String> = T::WORDS.iter().map(|(word, _)| format!("{word:?}")).collect();
        let typed = given.repr().map_or_else(|_| "this value".to_owned(), |typed| typed.to_string());
        Err(InputError::new_err(format!("{} = {typed}: must be one of {}", T::NAME, words.join(", "))))
    }
}

impl<'py, T: Chosen> IntoPyObject<'py> for Word<T> {
    type Target = PyString;
    type Output = Bound<'py, PyString>;
    type Error = std::convert::Infallible;

    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: PyStaticExpr = type_hint_identifier!("builtins", "str");

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        let word = T::WORDS.iter().find(|(_, one)| *one == self.0).map_or("", |(word, _)| word);
        Ok(PyString::new(py, word))
    }
}

/// Source of default values before any check.
pub(crate) struct Source<'py>(Bound<'py, PyAny>);

impl<'py> FromPyObject<'_, 'py> for Source<'py> {
    type Error = std::convert::Infallible;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr =
        type_hint_union!(Parameters::TYPE_HINT, scenario::Scenario::TYPE_HINT, std::path::PathBuf::INPUT_TYPE);

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> Result<Self, Self::Error> {
        Ok(Self(given.to_owned()))
    }
}

/// Parameters of filter, sensor, orbits, guidance and assignment. They are immutable and checked when they are created.
///
/// ``Parameters()`` gives the recommended values, which are also the defaults of scenario files.
/// ``Parameters("improved/figure-9")`` gives the parameters of a scenario, :meth:`table_1` those of the paper, and
/// ``Parameters(other, radial_gain=1.0)`` a copy with one change. The names are those of the keys in scenario files,
/// but angles are in radians.
///
/// :param of: source of the parameters that are not given: other parameters, a :class:`standoff.Scenario`, the name of
///     a built-in scenario or the path of a scenario file; by default the recommended values.
/// :param seed: seed for a scenario with random parameters; 1 by default.
/// :param correlation_rate_1_s: filter: correlation rate alpha of the targets' acceleration (5, 6), 1/s.
/// :param acceleration_sd_m_s2: filter: standard deviation of the targets' acceleration per axis, m/s2.
/// :param range_sd_m: filter: standard deviation of the measured range, sigma_r, m.
/// :param bearing_sd_rad: filter: standard deviation of the measured bearing, sigma_theta, rad.
/// :param initial_velocity_sd_m_s: filter: initial standard deviation of the velocity per axis if a track starts from a
///     measurement, m/s.
/// :param field_of_view_rad: sensor and orbit: full angle of the field of view, alpha_f, rad.
/// :param field_of_view_margin_rad: orbit: margin eps_m subtracted from the field of view (15), rad.
/// :param radius_min_m: orbit: lower bound of the standoff distance, r_d,min, m.
/// :param radius_max_m: orbit: upper bound of the standoff distance, r_d,max, m.
/// :param speed_m_s: nominal ground speed v_d of a UAV, m/s.
/// :param orbit_direction: guidance: orbit direction seen from above, ``"anticlockwise"`` or ``"clockwise"``.
/// :param radial_gain: guidance: k_l of active measure 1 (20), above 0, at most 1; 1 switches it off.
/// :param lead: guidance: lead time of active measure 2 (22): ``"constant"`` (``lead_s``), ``"scheduled"`` or
///     ``"predicted"`` (the lag of the field, k_l r_d / v).
/// :param lead_s: guidance: constant lead time k_rd, s. If only ``lead_s`` is given, ``lead`` becomes ``"constant"``.
///     It is 0 for the other kinds of lead.
/// :param speed_reference: guidance: frame in which speeds are commanded, ``"ground"`` or ``"centre"``.
/// :param heading_gain_1_s: guidance: k_omega (24), 1/s.
/// :param turn_rate_gain: guidance: gain on the difference between turn rate and feedforward; 0 (none) in the paper.
/// :param feedforward: guidance: derivative of the desired heading used as feedforward (25): of the flown vector field
///     (``"field"``), the same along the actual motion (``"trajectory"``), (25) corrected (``"static-centre"``), or
///     (25) as published (``"paper"``).
/// :param objective: assignment: ``"log-det"``, or (32) as published (``"paper"``).
/// :param assignment_switching_cost: assignment: bonus for a UAV that keeps its group, in ln det per target.
/// :raises InputError: if a value is out of range; the message gives the range.
/// :raises ScenarioError: if the scenario is invalid.
#[pyclass(frozen, eq, module = "standoff.components")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameters {
    #[pyo3(get)]
    correlation_rate_1_s: f64,
    #[pyo3(get)]
    acceleration_sd_m_s2: f64,
    #[pyo3(get)]
    range_sd_m: f64,
    #[pyo3(get)]
    bearing_sd_rad: f64,
    #[pyo3(get)]
    initial_velocity_sd_m_s: f64,
    #[pyo3(get)]
    field_of_view_rad: f64,
    #[pyo3(get)]
    field_of_view_margin_rad: f64,
    #[pyo3(get)]
    radius_min_m: f64,
    #[pyo3(get)]
    radius_max_m: f64,
    #[pyo3(get)]
    speed_m_s: f64,
    #[pyo3(get)]
    orbit_direction: Word<OrbitDirection>,
    #[pyo3(get)]
    radial_gain: f64,
    #[pyo3(get)]
    lead: Word<LeadBy>,
    #[pyo3(get)]
    lead_s: f64,
    #[pyo3(get)]
    speed_reference: Word<SpeedReference>,
    #[pyo3(get)]
    heading_gain_1_s: f64,
    #[pyo3(get)]
    turn_rate_gain: f64,
    #[pyo3(get)]
    feedforward: Word<Feedforward>,
    #[pyo3(get)]
    objective: Word<Objective>,
    #[pyo3(get)]
    assignment_switching_cost: f64,
}

impl Parameters {
    /// The library's parameters for `given`, or the recommended ones.
    pub(super) fn or_recommended(given: Option<&Bound<'_, Self>>) -> TeamParams {
        given.map_or_else(TeamParams::recommended, |given| given.get().team())
    }

    fn of_team(team: &TeamParams) -> Self {
        let (lead, lead_s) = match team.guidance.lead {
            Lead::Constant(lead_s) => (LeadBy::Constant, lead_s),
            Lead::Scheduled => (LeadBy::Scheduled, 0.0),
            Lead::Predicted => (LeadBy::Predicted, 0.0),
        };
        Self {
            correlation_rate_1_s: team.track.target.correlation_rate_1_s,
            acceleration_sd_m_s2: team.track.target.acceleration_sd_m_s2,
            range_sd_m: team.track.sensor.range_sd_m,
            bearing_sd_rad: team.track.sensor.bearing_sd_rad,
            initial_velocity_sd_m_s: team.track.initial_velocity_sd_m_s,
            field_of_view_rad: team.track.sensor.field_of_view_rad,
            field_of_view_margin_rad: team.group.standoff.field_of_view_margin_rad,
            radius_min_m: team.group.standoff.radius_min_m,
            radius_max_m: team.group.standoff.radius_max_m,
            speed_m_s: team.uav.speed_m_s,
            orbit_direction: Word(team.guidance.orbit_direction),
            radial_gain: team.guidance.radial_gain,
            lead: Word(lead),
            lead_s,
            speed_reference: Word(team.guidance.speed_reference),
            heading_gain_1_s: team.guidance.heading_gain_1_s,
            turn_rate_gain: team.guidance.turn_rate_gain,
            feedforward: Word(team.guidance.feedforward),
            objective: Word(team.group.objective),
            assignment_switching_cost: team.group.assignment_switching_cost,
        }
    }

    /// Parameters in the library's form. Those that no component uses have the recommended values.
    fn team(&self) -> TeamParams {
        let mut team = TeamParams::recommended();
        team.uav.speed_m_s = self.speed_m_s;
        team.track.target.correlation_rate_1_s = self.correlation_rate_1_s;
        team.track.target.acceleration_sd_m_s2 = self.acceleration_sd_m_s2;
        team.track.sensor.range_sd_m = self.range_sd_m;
        team.track.sensor.bearing_sd_rad = self.bearing_sd_rad;
        team.track.sensor.field_of_view_rad = self.field_of_view_rad;
        team.track.initial_velocity_sd_m_s = self.initial_velocity_sd_m_s;
        team.group.standoff.field_of_view_margin_rad = self.field_of_view_margin_rad;
        team.group.standoff.radius_min_m = self.radius_min_m;
        team.group.standoff.radius_max_m = self.radius_max_m;
        team.group.objective = self.objective.0;
        team.group.assignment_switching_cost = self.assignment_switching_cost;
        team.guidance = GuidanceParams {
            orbit_direction: self.orbit_direction.0,
            radial_gain: self.radial_gain,
            lead: match self.lead.0 {
                LeadBy::Constant => Lead::Constant(self.lead_s),
                LeadBy::Scheduled => Lead::Scheduled,
                LeadBy::Predicted => Lead::Predicted,
            },
            speed_reference: self.speed_reference.0,
            heading_gain_1_s: self.heading_gain_1_s,
            turn_rate_gain: self.turn_rate_gain,
            feedforward: self.feedforward.0,
            ..team.guidance
        };
        team
    }

    /// Checks the values with the library's ranges. Ignores errors in parameters that this class does not have.
    fn check(&self) -> PyResult<()> {
        let errors = self.team().errors();
        let own = errors.iter().filter_map(|error| {
            let name = error.path.rsplit('.').next().unwrap_or_default();
            let is_own = !matches!(name, "speed_change_max_m_s" | "sensing_range_m");
            is_own.then(|| format!("{name} = {}: must be {}", error.value, error.allowed))
        });
        let mut own: Vec<String> = own.collect();
        own.dedup();
        if own.is_empty() { Ok(()) } else { Err(InputError::new_err(own.join("; "))) }
    }
}

/// Overwrites the parameters that are given.
macro_rules! change {
    ($parameters:ident: $($name:ident)*) => {
        $(if let Some(given) = $name { $parameters.$name = given; })*
    };
}

/// Adds each parameter to a dict.
macro_rules! add {
    ($parameters:ident to $dict:ident: $($name:ident)*) => {
        $($dict.set_item(stringify!($name), $parameters.$name)?;)*
    };
}

#[pymethods]
impl Parameters {
    #[new]
    #[pyo3(signature = (of=None, *, seed=Whole(1), correlation_rate_1_s=None, acceleration_sd_m_s2=None, range_sd_m=None,
        bearing_sd_rad=None, initial_velocity_sd_m_s=None, field_of_view_rad=None, field_of_view_margin_rad=None,
        radius_min_m=None, radius_max_m=None, speed_m_s=None, orbit_direction=None, radial_gain=None, lead=None, lead_s=None,
        speed_reference=None, heading_gain_1_s=None, turn_rate_gain=None, feedforward=None, objective=None,
        assignment_switching_cost=None))]
    #[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
    fn new(
        of: Option<Source<'_>>,
        seed: Whole,
        correlation_rate_1_s: Option<f64>,
        acceleration_sd_m_s2: Option<f64>,
        range_sd_m: Option<f64>,
        bearing_sd_rad: Option<f64>,
        initial_velocity_sd_m_s: Option<f64>,
        field_of_view_rad: Option<f64>,
        field_of_view_margin_rad: Option<f64>,
        radius_min_m: Option<f64>,
        radius_max_m: Option<f64>,
        speed_m_s: Option<f64>,
        orbit_direction: Option<Word<OrbitDirection>>,
        radial_gain: Option<f64>,
        lead: Option<Word<LeadBy>>,
        lead_s: Option<f64>,
        speed_reference: Option<Word<SpeedReference>>,
        heading_gain_1_s: Option<f64>,
        turn_rate_gain: Option<f64>,
        feedforward: Option<Word<Feedforward>>,
        objective: Option<Word<Objective>>,
        assignment_switching_cost: Option<f64>,
    ) -> PyResult<Self> {
        let mut parameters = match of {
            None => Self::of_team(&TeamParams::recommended()),
            Some(Source(of)) => match of.cast::<Self>() {
                Ok(parameters) => parameters.get().clone(),
                Err(_) => {
                    let scenario = scenario::scenario_of(&of)?;
                    let seed = count("seed", seed, 0)?;
                    Self::of_team(&of.py().detach(|| scenario.drawn(seed))?.settings.team)
                }
            },
        };
        let lead = lead.or(lead_s.map(|_| Word(LeadBy::Constant)));
        let was_constant = parameters.lead.0 == LeadBy::Constant;
        let lead_s = match (lead.unwrap_or(parameters.lead).0, lead_s) {
            (LeadBy::Constant, None) if !was_constant => {
                return Err(InputError::new_err("lead = \"constant\": needs lead_s, in seconds"));
            }
            (LeadBy::Constant, lead_s) => lead_s,
            // The value of an earlier constant lead is dropped.
            (_, None | Some(0.0)) => Some(0.0),
            (_, Some(lead_s)) => {
                return Err(InputError::new_err(format!("lead_s = {lead_s}: allowed only with lead = \"constant\"")));
            }
        };
        change! { parameters:
            correlation_rate_1_s acceleration_sd_m_s2 range_sd_m bearing_sd_rad initial_velocity_sd_m_s
            field_of_view_rad field_of_view_margin_rad radius_min_m radius_max_m speed_m_s orbit_direction radial_gain
            lead lead_s speed_reference heading_gain_1_s turn_rate_gain feedforward objective assignment_switching_cost
        }
        parameters.check()?;
        Ok(parameters)
    }

    /// Returns the parameters of the paper's Table I.
    #[staticmethod]
    fn table_1() -> Self {
        Self::of_team(&TeamParams::table_1())
    }

    /// All parameters as a dict.
    #[pyo3(signature = () -> "dict[str, float | str]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        add! { self to dict:
            correlation_rate_1_s acceleration_sd_m_s2 range_sd_m bearing_sd_rad initial_velocity_sd_m_s
            field_of_view_rad field_of_view_margin_rad radius_min_m radius_max_m speed_m_s orbit_direction radial_gain
            lead lead_s speed_reference heading_gain_1_s turn_rate_gain feedforward objective assignment_switching_cost
        }
        Ok(dict)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let named = self.to_dict(py)?.into_iter().map(|(name, value)| Ok(format!("{name}={}", value.repr()?)));
        Ok(format!("Parameters({})", named.collect::<PyResult<Vec<_>>>()?.join(", ")))
    }

    #[pyo3(signature = () -> "tuple[tuple[()], dict[str, float | str]]")]
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        Ok(((), self.to_dict(py)?))
    }
}
