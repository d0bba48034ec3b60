//! What is allowed in a scenario, and how what is not is reported: where it was typed, in the unit it was typed in.

use standoff::{Allowed, ParamError, TeamParams};

use super::error::{Problem, ScenarioError};
use super::file::ScenarioFile;
use super::load::Typed;
use super::number::{of, value};
use super::team::KEYS;
use crate::traffic::Traffic;

/// Longer missions than this are refused: a record of them would fill the disk.
const TICKS_MAX: f64 = 10_000_000.0;

/// Checks every range: the simulator's own here, the rest in the library.
pub(super) fn check(file: &ScenarioFile, team: &TeamParams, traffic: Option<&Traffic>, problems: &mut Problems) {
    let mut check = |key: &str, number: f64, allowed: Allowed| {
        if !allowed.contains(number) {
            problems.add(key.to_owned(), format!("must be {allowed}"));
        }
    };
    let period_s = of(&file.period_s);
    check("period_s", period_s, Allowed::at_least(0.01).at_most(10.0));
    let longest_s = period_s.max(0.01) * TICKS_MAX;
    let duration = Allowed::at_least(period_s).at_most(longest_s).because("one period_s to ten million of them");
    check("duration_s", of(&file.duration_s), duration);
    check("settle_s", of(&file.settle_s), Allowed::at_least(0.0));
    check("sensor.range_sd_m", value(&file.sensor.range_sd_m), Allowed::at_least(0.0).at_most(1e5));
    check("sensor.bearing_sd_deg", value(&file.sensor.bearing_sd_deg), Allowed::at_least(0.0).at_most(180.0));
    check("cue.position_sd_m", value(&file.cue.position_sd_m), Allowed::above(0.0).at_most(1e5));
    check("cue.velocity_sd_m_s", value(&file.cue.velocity_sd_m_s), Allowed::above(0.0).at_most(1e3));
    let count = f64::from(file.uavs.count.unwrap_or_default());
    check("uavs.count", count, Allowed::at_least(1.0).at_most(100.0));
    let listed = file.uavs.at.len() as f64;
    if listed > 0.0 {
        check("uavs.count", count, Allowed::at_least(listed).at_most(listed).because("as many as [[uavs.at]]"));
    }
    if let Some(ring) = &file.uavs.ring {
        if let Some(radius_m) = &ring.radius_m {
            check("uavs.ring.radius_m", value(radius_m), Allowed::above(0.0).at_most(1e6));
        }
    }
    let place = Allowed::at_least(-1e7).at_most(1e7);
    for (index, at) in file.uavs.at.iter().enumerate() {
        check(&format!("uavs.at.{index}.x_m"), value(&at.x_m), place);
        check(&format!("uavs.at.{index}.y_m"), value(&at.y_m), place);
        check(&format!("uavs.at.{index}.speed_m_s"), value(&at.speed_m_s), Allowed::above(0.0).at_most(1e3));
    }
    if let Some(targets) = &file.targets {
        check(
            "targets.correlation_rate_1_s",
            value(&targets.correlation_rate_1_s),
            Allowed::at_least(0.0).at_most(100.0),
        );
        check(
            "targets.acceleration_sd_m_s2",
            value(&targets.acceleration_sd_m_s2),
            Allowed::at_least(0.0).at_most(100.0),
        );
        if let Some(scatter) = &targets.scatter {
            check("targets.scatter.count", f64::from(scatter.count), Allowed::at_least(1.0).at_most(10_000.0));
        }
        for (index, at) in targets.at.iter().enumerate() {
            check(&format!("targets.at.{index}.x_m"), value(&at.x_m), place);
            check(&format!("targets.at.{index}.y_m"), value(&at.y_m), place);
        }
    }
    let has_targets = file.targets.as_ref().is_some_and(|targets| targets.scatter.is_some() || !targets.at.is_empty());
    if traffic.is_none() && !has_targets {
        let what = "no targets; give [targets.scatter], [[targets.at]] or [traffic]".to_owned();
        problems.add("targets".to_owned(), what);
    }
    for error in team.errors() {
        problems.add_param(&error);
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
