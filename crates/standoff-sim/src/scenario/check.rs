//! What is allowed in a scenario, and how what is not is reported: where it was typed, in the unit it was typed in.

use standoff::{Allowed, ParamError, TeamParams};

use super::error::{Problem, ScenarioError};
use super::file::ScenarioFile;
use super::load::Typed;
use super::number::{of, value};
use super::team::KEYS;

/// Longer missions than this are refused: a record of them would fill the disk.
const TICKS_MAX: f64 = 10_000_000.0;

/// Checks how the mission is flown: the simulator's own ranges here, the rest in the library.
pub(super) fn check_settings(file: &ScenarioFile, team: &TeamParams, problems: &mut Problems) {
    let period_s = of(&file.period_s);
    problems.check("period_s", period_s, Allowed::at_least(0.01).at_most(10.0));
    let longest_s = period_s.max(0.01) * TICKS_MAX;
    let duration = Allowed::at_least(period_s).at_most(longest_s).because("one period_s to ten million of them");
    problems.check("duration_s", of(&file.duration_s), duration);
    problems.check("settle_s", of(&file.settle_s), Allowed::at_least(0.0).at_most(1e9));
    let (sensor, cue) = (&file.sensor, &file.cue);
    problems.check("sensor.range_sd_m", value(&sensor.range_sd_m), Allowed::at_least(0.0).at_most(1e5));
    problems.check("sensor.bearing_sd_deg", value(&sensor.bearing_sd_deg), Allowed::at_least(0.0).at_most(180.0));
    problems.check("cue.position_sd_m", value(&cue.position_sd_m), Allowed::above(0.0).at_most(1e5));
    problems.check("cue.velocity_sd_m_s", value(&cue.velocity_sd_m_s), Allowed::above(0.0).at_most(1e3));
    for error in team.errors() {
        problems.add_param(&error);
    }
}

/// Checks who takes part, and where they start.
pub(super) fn check_who(file: &ScenarioFile, problems: &mut Problems) {
    let place = Allowed::at_least(-1e7).at_most(1e7);
    let count = of(&file.uavs.count);
    problems.check_whole("uavs.count", count, Allowed::at_least(1.0).at_most(100.0));
    let listed = file.uavs.at.len() as f64;
    if listed > 0.0 {
        let as_listed = Allowed::at_least(listed).at_most(listed).because("as many as [[uavs.at]]");
        problems.check("uavs.count", count, as_listed);
    }
    if let Some(radius_m) = file.uavs.ring.as_ref().and_then(|ring| ring.radius_m.as_ref()) {
        problems.check("uavs.ring.radius_m", value(radius_m), Allowed::above(0.0).at_most(1e6));
    }
    for (index, at) in file.uavs.at.iter().enumerate() {
        let key = |name: &str| format!("uavs.at.{index}.{name}");
        problems.check(&key("x_m"), value(&at.x_m), place);
        problems.check(&key("y_m"), value(&at.y_m), place);
        problems.check(&key("speed_m_s"), value(&at.speed_m_s), Allowed::above(0.0).at_most(1e3));
    }
    let targets = file.targets.clone().unwrap_or_default();
    let rate = Allowed::at_least(0.0).at_most(100.0);
    problems.check("targets.correlation_rate_1_s", value(&targets.correlation_rate_1_s), rate);
    problems.check("targets.acceleration_sd_m_s2", value(&targets.acceleration_sd_m_s2), rate);
    if let Some(scatter) = &targets.scatter {
        let count = Allowed::at_least(1.0).at_most(10_000.0);
        problems.check_whole("targets.scatter.count", value(&scatter.count), count);
    }
    for (index, at) in targets.at.iter().enumerate() {
        let key = |name: &str| format!("targets.at.{index}.{name}");
        problems.check(&key("x_m"), value(&at.x_m), place);
        problems.check(&key("y_m"), value(&at.y_m), place);
    }
    if file.traffic.is_none() && targets.scatter.is_none() && targets.at.is_empty() {
        problems
            .add("targets".to_owned(), "no targets; give [targets.scatter], [[targets.at]] or [traffic]".to_owned());
    }
}

/// Problems found so far, by key.
#[derive(Default)]
pub(super) struct Problems {
    found: Vec<(String, String)>,
}

impl Problems {
    pub(super) fn add(&mut self, key: String, what: String) {
        self.found.push((key, what));
    }

    fn check(&mut self, key: &str, number: f64, allowed: Allowed) {
        if !allowed.contains(number) {
            self.add(key.to_owned(), format!("must be {allowed}"));
        }
    }

    /// A number that counts things.
    fn check_whole(&mut self, key: &str, number: f64, allowed: Allowed) {
        if allowed.contains(number) && number.fract().abs() > 0.0 {
            self.add(key.to_owned(), "must be a whole number".to_owned());
        }
        self.check(key, number, allowed);
    }

    /// A library parameter out of range, in the unit in which it was typed.
    fn add_param(&mut self, error: &ParamError) {
        let key = KEYS.iter().find(|(name, _)| *name == error.name).map_or(error.name, |(_, key)| key);
        let is_angle = error.name.ends_with("_rad");
        let allowed = if is_angle { error.allowed.map(f64::to_degrees) } else { error.allowed };
        self.add(key.to_owned(), format!("must be {allowed}"));
    }

    /// All of them, if there are any.
    pub(super) fn report(&mut self, typed: &Typed) -> Result<(), ScenarioError> {
        if self.found.is_empty() {
            return Ok(());
        }
        let values = toml::Value::try_from(&typed.file).ok();
        let problems = self.found.drain(..).map(|(key, what)| {
            let (file, place) = typed.place(&key);
            let value = values.as_ref().and_then(|values| lookup(values, &key));
            let message = match value {
                Some(value) if !value.is_table() => format!("{key} = {value}: {what}"),
                _ => format!("{key}: {what}"),
            };
            Problem { file, place, message }
        });
        Err(ScenarioError { problems: problems.collect() })
    }
}

fn lookup<'a>(values: &'a toml::Value, key: &str) -> Option<&'a toml::Value> {
    key.split('.').try_fold(values, |here, part| match here {
        toml::Value::Array(values) => values.get(part.parse::<usize>().ok()?),
        _ => here.get(part),
    })
}
