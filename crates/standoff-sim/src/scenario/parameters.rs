//! Values of the library's parameters in a scenario: their keys, defaults and ranges are those of [`TeamParams::table`].

use std::fmt::Display;
use std::sync::LazyLock;

use serde::Serialize;
use standoff::validation::Allowed;
use standoff::{BankParams, ClimbParams, Law, ParamInfo, ParamValue, SeparationParams, TeamParams, WindParams};

use super::number::Number;
use super::sample::{Draw, Drawing};

/// Keys whose defaults depend on other values ([`DerivedDefaults`](super::sample::DerivedDefaults)), and how.
pub(super) const DERIVED: [(&str, &str); 16] = [
    ("filter.correlation_rate_1_s", "If absent: that of `[targets]`, or 0.3 for traffic."),
    ("filter.acceleration_sd_m_s2", "If absent: that of `[targets]`, or 0.75 for traffic."),
    ("filter.range_sd_m", "If absent: that of the sensor, or 10 if the sensor has no noise."),
    ("filter.bearing_sd_deg", "If absent: that of the sensor, or 3 if the sensor has no noise."),
    ("filter.detection_probability", "If absent: that of the sensor."),
    ("filter.mdv_m_s", "If absent: that of the sensor."),
    ("filter.range_rate_sd_m_s", "If absent: that of the sensor, or 0.5 if the range rate is not measured or exact."),
    ("filter.false_alarms_per_scan", "If absent: that of the sensor."),
    ("filter.manoeuvre_rate_1_s", "If absent: 0.03 for traffic and with `[[targets.manoeuvre]]`, otherwise 0."),
    ("filter.stop_rate_1_s", "If absent: 0.05 for traffic, otherwise 0."),
    ("filter.own_position_sd_m", "If absent: `navigation.position_sd_m`."),
    ("filter.own_position_correlation_s", "If absent: `navigation.correlation_s`."),
    ("filter.own_heading_sd_deg", "If absent: `navigation.heading_bias_deg`."),
    ("wind.orbit_wind_m_s", "If absent: the speed of the wind at `groups.altitude_lowest_m`."),
    ("wind.believed_speed_m_s", "If absent: the speed of the wind at `groups.altitude_lowest_m`."),
    ("wind.believed_from_deg", "If absent: `wind.from_deg`."),
];

/// Returns the parameters that have a key in one of the tables. The period, whose key is at the top, belongs to the
/// simulator.
pub(super) fn declared() -> impl Iterator<Item = &'static ParamInfo> {
    static DECLARED: LazyLock<Vec<&ParamInfo>> =
        LazyLock::new(|| TeamParams::table().iter().filter(|param| param.key.contains('.')).collect());
    DECLARED.iter().copied()
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

/// Values of all parameters, in the order of [`declared`]; `None` is the default of a key in [`DERIVED`] until it is
/// drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters(Vec<Option<TypedValue>>);

impl Default for Parameters {
    fn default() -> Self {
        Self::of_law(Law::Standoff)
    }
}

impl Parameters {
    /// Defaults of a named law.
    pub(super) fn of_law(law: Law) -> Self {
        let mut team = TeamParams { separation: Some(SeparationParams::default()), ..TeamParams::of_law(law) };
        (team.uav.climb, team.uav.bank) = (Some(ClimbParams::default()), Some(BankParams::default()));
        team.wind = Some(WindParams::default());
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
        let drawn = |(param, typed): (&ParamInfo, Option<TypedValue>)| {
            let number = match typed {
                Some(TypedValue::Number(number)) => number,
                Some(_) => return typed,
                None => drawing.absent.parameters[DERIVED.iter().position(|(key, _)| *key == param.key)?].into(),
            };
            // The library checks the range.
            Some(TypedValue::Number(drawing.number(&"", param.key, &number, Allowed::FINITE).into()))
        };
        Self(self.iter().map(drawn).collect())
    }
}

impl Parameters {
    /// Parameters with their values.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&'static ParamInfo, Option<TypedValue>)> {
        declared().zip(self.0.iter().copied())
    }

    /// Parameters with their values, which can be changed.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (&'static ParamInfo, &mut Option<TypedValue>)> {
        declared().zip(&mut self.0)
    }

    /// Sets drawn values in `team`. Those of absent parts have no effect.
    pub(super) fn apply_to(&self, team: &mut TeamParams) {
        for (param, typed) in self.iter() {
            let value = match typed {
                Some(TypedValue::Number(Number::Constant(deg))) if param.is_angle() => {
                    ParamValue::Number(deg.to_radians())
                }
                Some(TypedValue::Number(Number::Constant(number))) => ParamValue::Number(number),
                Some(TypedValue::Word(word)) => ParamValue::Word(word),
                Some(TypedValue::Flag(flag)) => ParamValue::Flag(flag),
                Some(TypedValue::Number(Number::Drawn(_))) | None => continue,
            };
            param.set(team, value);
        }
    }

    /// Returns the value at a key.
    pub(super) fn value(&self, key: &str) -> Option<TypedValue> {
        self.iter().find(|(param, _)| param.key == key)?.1
    }

    /// Returns the number at a key, if it is drawn or constant.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.value(key) {
            Some(TypedValue::Number(Number::Constant(value))) => Some(value),
            _ => None,
        }
    }
}
