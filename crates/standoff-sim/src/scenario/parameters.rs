//! Values of the library's parameters in a scenario: their keys, defaults and ranges are those of [`TeamParams::table`].

use std::fmt::Display;

use serde::Serialize;
use standoff::{Allowed, ClimbParams, ParamInfo, ParamKind, ParamValue, SeparationParams, TeamParams};
use toml::{Table, Value};

use super::number::Number;
use super::parse::{MISTAKES_MAX, Mistake, WrongForm, deserialized, take_out, value_at, value_at_mut};
use super::sample::{Draw, Drawing};
use super::schema::KEYS;
use super::schema_types::resolved::ScenarioFile;

/// Keys whose defaults depend on other values ([`DerivedDefaults`](super::sample::DerivedDefaults)), and how.
pub(super) const DERIVED: [(&str, &str); 4] = [
    ("filter.correlation_rate_1_s", "If absent: that of `[targets]`, or 0.3 for traffic."),
    ("filter.acceleration_sd_m_s2", "If absent: that of `[targets]`, or 0.75 for traffic."),
    ("filter.range_sd_m", "If absent: that of the sensor, or 10 if the sensor has no noise."),
    ("filter.bearing_sd_deg", "If absent: that of the sensor, or 3 if the sensor has no noise."),
];

/// Returns the parameters that have a key in one of the tables. The period, whose key is at the top, belongs to the
/// simulator.
pub(super) fn declared() -> impl Iterator<Item = &'static ParamInfo> {
    TeamParams::table().iter().filter(|param| param.key.contains('.'))
}

/// Returns the table of a parameter's key, and the key in that table.
pub(super) fn split(param: &ParamInfo) -> (&'static str, &'static str) {
    param.key.rsplit_once('.').unwrap_or(("", param.key))
}

/// Returns the tables of the parameters' keys, each once.
pub(super) fn tables() -> Vec<&'static str> {
    let mut tables = Vec::new();
    for (table, _) in declared().map(split) {
        if !tables.contains(&table) {
            tables.push(table);
        }
    }
    tables
}

/// A value in the unit of its key.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum TypedValue {
    Number(Number),
    Word(&'static str),
    Flag(bool),
}

impl TypedValue {
    /// Reads a value of a parameter of this kind.
    fn read(kind: &ParamKind, value: &Value) -> Result<Self, WrongForm> {
        match kind {
            ParamKind::Number { .. } => deserialized(value.clone()).map(Self::Number),
            ParamKind::Flag => deserialized(value.clone()).map(Self::Flag),
            ParamKind::Word(words) => {
                let known = words.iter().find(|known| value.as_str() == Some(known.word));
                known.map(|known| Self::Word(known.word)).ok_or_else(WrongForm::default)
            }
        }
    }
}

/// Values of all parameters, in the order of [`declared`]; `None` is the default of a key in [`DERIVED`] until it is
/// drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters(Vec<Option<TypedValue>>);

impl Default for Parameters {
    fn default() -> Self {
        let team = with_parts(TeamParams::recommended(), true, true);
        let default = |param: &ParamInfo| {
            let is_derived = DERIVED.iter().any(|(key, _)| *key == param.key);
            param.value(&team).filter(|_| !is_derived).map(|value| match value {
                // The conversion adds rounding noise.
                ParamValue::Number(rad) if param.is_angle() => {
                    TypedValue::Number(((rad.to_degrees() * 1e9).round() / 1e9).into())
                }
                ParamValue::Number(number) => TypedValue::Number(number.into()),
                ParamValue::Word(word) => TypedValue::Word(word),
                ParamValue::Flag(flag) => TypedValue::Flag(flag),
            })
        };
        Self(declared().map(default).collect())
    }
}

impl Draw for Parameters {
    type Drawn = Self;

    fn drawn(&self, _: &dyn Display, drawing: &mut Drawing) -> Self {
        let drawn = |(param, typed): (&ParamInfo, &Option<TypedValue>)| {
            let number = match *typed {
                Some(TypedValue::Number(number)) => number,
                Some(_) => return *typed,
                None => drawing.absent.parameters[DERIVED.iter().position(|(key, _)| *key == param.key)?].into(),
            };
            // The library checks the range.
            Some(TypedValue::Number(drawing.number(&"", param.key, &number, Allowed::FINITE).into()))
        };
        Self(declared().zip(&self.0).map(drawn).collect())
    }
}

impl Parameters {
    /// Takes the values of all parameters out of a scenario.
    pub(super) fn take(table: &mut Table, mistakes: &mut Vec<Mistake>) -> Self {
        let mut parameters = Self::default();
        for (param, slot) in declared().zip(&mut parameters.0) {
            let Some(value) = value_at(table, param.key) else { continue };
            match TypedValue::read(&param.kind, value) {
                Ok(typed) => *slot = Some(typed),
                // Two parameters may share a key.
                Err(wrong)
                    if mistakes.len() < MISTAKES_MAX
                        && mistakes.iter().all(|mistake| mistake.left_out != param.key) =>
                {
                    mistakes.push(Mistake::new(table, param.key, wrong));
                }
                Err(_) => {}
            }
        }
        declared().for_each(|param| drop(take_out(table, param.key)));
        parameters
    }

    /// Inserts the values into the tables of a scenario, in the order of the schema. Optional tables may be absent.
    pub(super) fn insert_into(&self, scenario: &mut Table) -> Result<(), toml::ser::Error> {
        for name in tables() {
            let Some(Value::Table(table)) = value_at_mut(scenario, name) else { continue };
            let mut own = std::mem::take(table);
            for key in KEYS.of(name).unwrap_or_default() {
                let typed = declared().zip(&self.0).find(|(param, _)| split(param) == (name, key));
                let value = match typed.and_then(|(_, typed)| *typed) {
                    Some(typed) => Some(Value::try_from(typed)?),
                    None => own.remove(key),
                };
                table.extend(value.map(|value| (key.to_owned(), value)));
            }
        }
        Ok(())
    }

    /// Returns the value at a key.
    pub(super) fn value(&self, key: &str) -> Option<TypedValue> {
        declared().zip(&self.0).find(|(param, _)| param.key == key).and_then(|(_, typed)| *typed)
    }

    /// Returns the number at a key, if it is drawn or constant.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.value(key) {
            Some(TypedValue::Number(Number::Constant(value))) => Some(value),
            _ => None,
        }
    }
}

/// Returns the team parameters of a resolved scenario. The library checks their ranges.
pub(super) fn team(file: &ScenarioFile) -> TeamParams {
    // Vertical separation needs simulated altitudes.
    let has_climb = file.uavs.climb.is_some() || file.separation.is_some();
    let mut team = with_parts(TeamParams::recommended(), has_climb, file.separation.is_some());
    team.log.period_s = file.period_s;
    for (param, typed) in declared().zip(&file.parameters.0) {
        let value = match *typed {
            Some(TypedValue::Number(Number::Constant(deg))) if param.is_angle() => ParamValue::Number(deg.to_radians()),
            Some(TypedValue::Number(Number::Constant(number))) => ParamValue::Number(number),
            Some(TypedValue::Word(word)) => ParamValue::Word(word),
            Some(TypedValue::Flag(flag)) => ParamValue::Flag(flag),
            _ => continue,
        };
        // Parameters of absent parts have no effect.
        param.set(&mut team, value);
    }
    team
}

/// Adds optional parts with their default values.
fn with_parts(team: TeamParams, has_climb: bool, has_separation: bool) -> TeamParams {
    TeamParams {
        uav: standoff::UavParams { climb: has_climb.then(ClimbParams::default), ..team.uav },
        separation: has_separation.then(SeparationParams::default),
        ..team
    }
}
