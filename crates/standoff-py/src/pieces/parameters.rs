//! The numbers that the pieces take by name.

#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
#[cfg(feature = "stubs")]
use pyo3::{PyTypeInfo, type_hint_identifier, type_hint_union};
use standoff::{Feedforward, GuidanceParams, Lead, Objective, Sense, SpeedReference, TeamParams};

use crate::asked_for::{Whole, count};
use crate::failure::InputError;
use crate::scenario;

/// One of several words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Word<T>(T);

/// What is chosen by a word; the words are those of scenario files.
pub(crate) trait Chosen: Copy + PartialEq + 'static {
    const NAME: &'static str;
    const WORDS: &'static [(&'static str, Self)];
}

/// [`Lead`] without its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LeadBy {
    Constant,
    Scheduled,
    Predicted,
}

impl Chosen for Sense {
    const NAME: &'static str = "sense";
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
    const WORDS: &'static [(&'static str, Self)] =
        &[("flown", Self::Flown), ("actual", Self::Actual), ("exact", Self::Exact), ("printed", Self::Printed)];
}

impl Chosen for Objective {
    const NAME: &'static str = "objective";
    const WORDS: &'static [(&'static str, Self)] = &[("log-det", Self::LogDet), ("printed", Self::Printed)];
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
        let typed = given.repr().map_or_else(|_| "that".to_owned(), |typed| typed.to_string());
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

/// Where parameters come from, not looked at yet.
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

/// The numbers of filter, sensor, orbits, guidance and assignment; checked once, here. Immutable.
///
/// ``Parameters()`` is the paper's Table I, ``Parameters("best/figure-9")`` a scenario's, and
/// ``Parameters(those, radial_gain=1.0)`` those with a change. Names are the keys of scenario files, in radians.
///
/// :param of: where what is not given comes from: other parameters, a :class:`standoff.Scenario`, a built-in scenario's
///     name or the path of a scenario file; Table I if left out.
/// :param seed: of a scenario that draws parameters, the seed; 1 if left out.
/// :param correlation_rate_1_s: filter: correlation rate alpha of the targets' acceleration (5, 6), 1/s.
/// :param acceleration_sd_m_s2: filter: standard deviation of their acceleration per axis, m/s2.
/// :param range_sd_m: filter: standard deviation of a range, sigma_r, m.
/// :param bearing_sd_rad: filter: standard deviation of a bearing, sigma_theta, rad.
/// :param start_velocity_sd_m_s: filter: standard deviation per axis of the velocity where only a measurement is known, m/s.
/// :param field_of_view_rad: sensor and orbit: field of view alpha_f, rad.
/// :param field_of_view_margin_rad: orbit: margin eps_m taken off the field of view (15), rad.
/// :param radius_min_m: orbit: smallest standoff distance flown, r_d,min, m.
/// :param radius_max_m: orbit: largest standoff distance flown, r_d,max, m.
/// :param speed_m_s: a UAV's nominal speed v_d over ground, m/s.
/// :param sense: guidance: which way round, ``"anticlockwise"`` or ``"clockwise"``, seen from above.
/// :param radial_gain: guidance: k_l of active measure 1 (20), above 0, at most 1; 1 switches it off.
/// :param lead: guidance: how far ahead active measure 2 (22) steers: ``"constant"`` (``lead_s``), ``"scheduled"`` or
///     ``"predicted"`` (the field's own lag k_l r_d / v).
/// :param lead_s: guidance: k_rd, s; given alone, it makes ``lead`` constant. 0 where that is not constant.
/// :param speed_reference: guidance: what speeds are relative to, ``"ground"`` or ``"centre"``.
/// :param heading_gain_1_s: guidance: k_omega (24), 1/s.
/// :param turn_rate_gain: guidance: gain on the turn rate's distance from the feedforward; 0, as in the paper: none.
/// :param feedforward: guidance: which derivative of the desired heading is fed forward (25): ``"flown"``, ``"actual"``,
///     ``"exact"`` or ``"printed"``.
/// :param objective: assignment: ``"log-det"``, or ``"printed"`` (32).
/// :param assignment_inertia: assignment: what staying counts for a UAV, in ln det per target.
/// :raises InputError: a number outside its range, named with the range.
/// :raises ScenarioError: a scenario that cannot be used.
#[pyclass(frozen, eq, module = "standoff.pieces")]
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
    start_velocity_sd_m_s: f64,
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
    sense: Word<Sense>,
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
    assignment_inertia: f64,
}

impl Parameters {
    /// Those given, or Table I.
    pub(super) fn or_table_1(given: Option<&Bound<'_, Self>>) -> TeamParams {
        given.map_or_else(TeamParams::table_1, |given| given.get().team())
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
            start_velocity_sd_m_s: team.track.start_velocity_sd_m_s,
            field_of_view_rad: team.track.sensor.field_of_view_rad,
            field_of_view_margin_rad: team.group.standoff.field_of_view_margin_rad,
            radius_min_m: team.group.standoff.radius_min_m,
            radius_max_m: team.group.standoff.radius_max_m,
            speed_m_s: team.uav.speed_m_s,
            sense: Word(team.guidance.sense),
            radial_gain: team.guidance.radial_gain,
            lead: Word(lead),
            lead_s,
            speed_reference: Word(team.guidance.speed_reference),
            heading_gain_1_s: team.guidance.heading_gain_1_s,
            turn_rate_gain: team.guidance.turn_rate_gain,
            feedforward: Word(team.guidance.feedforward),
            objective: Word(team.group.objective),
            assignment_inertia: team.group.assignment_inertia,
        }
    }

    /// As the library takes them; what no piece looks at is Table I's.
    fn team(&self) -> TeamParams {
        let mut team = TeamParams::table_1();
        team.uav.speed_m_s = self.speed_m_s;
        team.track.target.correlation_rate_1_s = self.correlation_rate_1_s;
        team.track.target.acceleration_sd_m_s2 = self.acceleration_sd_m_s2;
        team.track.sensor.range_sd_m = self.range_sd_m;
        team.track.sensor.bearing_sd_rad = self.bearing_sd_rad;
        team.track.sensor.field_of_view_rad = self.field_of_view_rad;
        team.track.start_velocity_sd_m_s = self.start_velocity_sd_m_s;
        team.group.standoff.field_of_view_rad = self.field_of_view_rad;
        team.group.standoff.field_of_view_margin_rad = self.field_of_view_margin_rad;
        team.group.standoff.radius_min_m = self.radius_min_m;
        team.group.standoff.radius_max_m = self.radius_max_m;
        team.group.objective = self.objective.0;
        team.group.assignment_inertia = self.assignment_inertia;
        team.guidance = GuidanceParams {
            sense: self.sense.0,
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

    /// By the library's own ranges, but for what is not among these.
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

/// Takes what is given.
macro_rules! change {
    ($parameters:ident: $($name:ident)*) => {
        $(if let Some(given) = $name { $parameters.$name = given; })*
    };
}

/// Tells each by its name.
macro_rules! tell {
    ($parameters:ident to $dict:ident: $($name:ident)*) => {
        $($dict.set_item(stringify!($name), $parameters.$name)?;)*
    };
}

#[pymethods]
impl Parameters {
    #[new]
    #[pyo3(signature = (of=None, *, seed=Whole(1), correlation_rate_1_s=None, acceleration_sd_m_s2=None, range_sd_m=None,
        bearing_sd_rad=None, start_velocity_sd_m_s=None, field_of_view_rad=None, field_of_view_margin_rad=None,
        radius_min_m=None, radius_max_m=None, speed_m_s=None, sense=None, radial_gain=None, lead=None, lead_s=None,
        speed_reference=None, heading_gain_1_s=None, turn_rate_gain=None, feedforward=None, objective=None,
        assignment_inertia=None))]
    #[expect(clippy::too_many_arguments, reason = "they are given by name")]
    fn new(
        of: Option<Source<'_>>,
        seed: Whole,
        correlation_rate_1_s: Option<f64>,
        acceleration_sd_m_s2: Option<f64>,
        range_sd_m: Option<f64>,
        bearing_sd_rad: Option<f64>,
        start_velocity_sd_m_s: Option<f64>,
        field_of_view_rad: Option<f64>,
        field_of_view_margin_rad: Option<f64>,
        radius_min_m: Option<f64>,
        radius_max_m: Option<f64>,
        speed_m_s: Option<f64>,
        sense: Option<Word<Sense>>,
        radial_gain: Option<f64>,
        lead: Option<Word<LeadBy>>,
        lead_s: Option<f64>,
        speed_reference: Option<Word<SpeedReference>>,
        heading_gain_1_s: Option<f64>,
        turn_rate_gain: Option<f64>,
        feedforward: Option<Word<Feedforward>>,
        objective: Option<Word<Objective>>,
        assignment_inertia: Option<f64>,
    ) -> PyResult<Self> {
        let mut parameters = match of {
            None => Self::of_team(&TeamParams::table_1()),
            Some(Source(of)) => match of.cast::<Self>() {
                Ok(parameters) => parameters.get().clone(),
                Err(_) => {
                    let scenario = scenario::asked_for(&of)?;
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
            // Nothing is left of a constant one.
            (_, None | Some(0.0)) => Some(0.0),
            (_, Some(lead_s)) => {
                return Err(InputError::new_err(format!("lead_s = {lead_s}: goes with lead = \"constant\" only")));
            }
        };
        change! { parameters:
            correlation_rate_1_s acceleration_sd_m_s2 range_sd_m bearing_sd_rad start_velocity_sd_m_s
            field_of_view_rad field_of_view_margin_rad radius_min_m radius_max_m speed_m_s sense radial_gain
            lead lead_s speed_reference heading_gain_1_s turn_rate_gain feedforward objective assignment_inertia
        }
        parameters.check()?;
        Ok(parameters)
    }

    /// All of them by name.
    #[pyo3(signature = () -> "dict[str, float | str]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        tell! { self to dict:
            correlation_rate_1_s acceleration_sd_m_s2 range_sd_m bearing_sd_rad start_velocity_sd_m_s
            field_of_view_rad field_of_view_margin_rad radius_min_m radius_max_m speed_m_s sense radial_gain
            lead lead_s speed_reference heading_gain_1_s turn_rate_gain feedforward objective assignment_inertia
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
