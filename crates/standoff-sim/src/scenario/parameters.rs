//! Values of the library's parameters in a scenario: their keys, defaults and ranges are those of [`TeamParams::table`].

use std::sync::LazyLock;

use standoff::params::ParamKind;
use standoff::{BankParams, ClimbParams, Law, ParamInfo, ParamValue, SeparationParams, TeamParams, WindParams};
use toml::{Table, Value};

use super::dotted::{take_out, value_at};
use super::number::whole;
use super::schema_types::{Parameters, ScenarioFile};
use crate::wind::shear_factor;

/// A key whose default depends on other values: the key, what the default is, and its value in a drawn scenario.
type Derived = (&'static str, &'static str, fn(&ScenarioFile) -> f64);

const LOWEST_WIND: &str = "the speed of the wind at `groups.altitude_lowest_m`";

/// Keys whose defaults depend on other values. Measured cars: 0.2-0.5 1/s and 0.5-1 m/s2 per axis.
pub(super) const DERIVED: [Derived; 16] = [
    ("filter.correlation_rate_1_s", "that of `[targets]`, or 0.3 for traffic", |file| {
        file.targets.as_ref().map_or(0.3, |targets| targets.correlation_rate_1_s)
    }),
    ("filter.acceleration_sd_m_s2", "that of `[targets]`, or 0.75 for traffic", |file| {
        file.targets.as_ref().map_or(0.75, |targets| targets.acceleration_sd_m_s2)
    }),
    ("filter.range_sd_m", "that of the sensor, or 10 if the sensor has no noise", |file| {
        noise_or(file.sensor.range_sd_m, 10.0)
    }),
    ("filter.bearing_sd_deg", "that of the sensor, or 3 if the sensor has no noise", |file| {
        noise_or(file.sensor.bearing_sd_deg, 3.0)
    }),
    ("filter.detection_probability", "that of the sensor", |file| file.sensor.detection_probability),
    ("filter.mdv_m_s", "that of the sensor", |file| file.sensor.mdv_m_s),
    ("filter.range_rate_sd_m_s", "that of the sensor, or 0.5 if the range rate is not measured or exact", |file| {
        noise_or(file.sensor.range_rate_sd_m_s.unwrap_or(0.0), 0.5)
    }),
    ("filter.false_alarms_per_scan", "that of the sensor", |file| file.sensor.false_alarms_per_scan),
    ("filter.manoeuvre_rate_1_s", "0.03 for traffic and with `[[targets.manoeuvre]]`, otherwise 0", |file| {
        if file.targets.as_ref().is_none_or(|targets| !targets.manoeuvre.is_empty()) { 0.03 } else { 0.0 }
    }),
    ("filter.stop_rate_1_s", "0.05 for traffic, otherwise 0", |file| if file.targets.is_none() { 0.05 } else { 0.0 }),
    ("filter.own_position_sd_m", "`navigation.position_sd_m`", |file| file.navigation.position_sd_m),
    ("filter.own_position_correlation_s", "`navigation.correlation_s`", |file| file.navigation.correlation_s),
    ("filter.own_heading_sd_deg", "`navigation.heading_bias_deg`", |file| file.navigation.heading_bias_deg),
    ("wind.orbit_wind_m_s", LOWEST_WIND, lowest_wind_m_s),
    ("wind.believed_speed_m_s", LOWEST_WIND, lowest_wind_m_s),
    ("wind.believed_from_deg", "`wind.from_deg`", |file| file.wind.as_ref().map_or(0.0, |wind| wind.from_deg)),
];

fn noise_or(noise: f64, default: f64) -> f64 {
    if noise > 0.0 { noise } else { default }
}

/// Speed of the wind at the lowest altitude of the UAVs, m/s.
fn lowest_wind_m_s(file: &ScenarioFile) -> f64 {
    let lowest_m = number(&file.parameters, "groups.altitude_lowest_m").unwrap_or(0.0);
    file.wind
        .as_ref()
        .map_or(0.0, |wind| wind.speed_m_s * shear_factor(lowest_m, wind.reference_height_m, wind.shear_exponent))
}

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

/// Returns the defaults of a named law, except for those that are [`DERIVED`].
pub(super) fn defaults(law: Law) -> Parameters {
    let mut team = TeamParams { separation: Some(SeparationParams::default()), ..TeamParams::of_law(law) };
    (team.uav.climb, team.uav.bank) = (Some(ClimbParams::default()), Some(BankParams::default()));
    team.wind = Some(WindParams::default());
    let independent = declared().filter(|param| DERIVED.iter().all(|(key, ..)| *key != param.key));
    let default = |param: &ParamInfo| {
        Some((
            param.key,
            match param.value(&team)? {
                // The conversion adds rounding noise.
                ParamValue::Number(rad) if param.is_angle() => {
                    ParamValue::Number((rad.to_degrees() * 1e9).round() / 1e9)
                }
                value => value,
            },
        ))
    };
    independent.filter_map(default).collect()
}

/// Law that a scenario names, which determines the defaults; this project's law if it names none.
pub(super) fn law_of(table: &Table) -> Law {
    value_at(table, "guidance.law").and_then(Value::as_str).and_then(Law::named).unwrap_or(Law::Standoff)
}

/// Takes the parameters out of a drawn scenario whose form is right.
pub(super) fn take(table: &mut Table) -> Parameters {
    let mut parameters = defaults(law_of(table));
    for param in declared() {
        let value = match (take_out(table, param.key), param.kind) {
            (Some(Value::Float(number)), _) => Some(ParamValue::Number(number)),
            (Some(Value::Integer(number)), _) => Some(ParamValue::Number(number as f64)),
            (Some(Value::Boolean(flag)), _) => Some(ParamValue::Flag(flag)),
            (Some(Value::String(typed)), ParamKind::Word(words)) => {
                let known = words.iter().find(|known| known.word == typed);
                known.map(|known| ParamValue::Word(known.word))
            }
            _ => None,
        };
        parameters.extend(value.map(|value| (param.key, value)));
    }
    parameters
}

/// Converts a value to TOML.
pub(super) fn to_value(value: &ParamValue) -> Value {
    match *value {
        ParamValue::Number(number) => whole(number).map_or(Value::Float(number), Value::Integer),
        ParamValue::Word(word) => word.into(),
        ParamValue::Flag(flag) => flag.into(),
    }
}

/// Sets the values in `team`.
pub(super) fn apply(parameters: &Parameters, team: &mut TeamParams) {
    for param in declared() {
        let value = match parameters.get(param.key) {
            Some(ParamValue::Number(deg)) if param.is_angle() => ParamValue::Number(deg.to_radians()),
            Some(value) => *value,
            None => continue,
        };
        param.set(team, value);
    }
}

/// Returns the number at a key.
pub(super) fn number(parameters: &Parameters, key: &str) -> Option<f64> {
    match parameters.get(key) {
        Some(ParamValue::Number(number)) => Some(*number),
        _ => None,
    }
}
