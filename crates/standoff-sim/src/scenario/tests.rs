//! Tests that typed values and the library's checks fit together.

use standoff::{Lead, Margin, TeamParams};

use super::diagnostics::Problems;
use super::load::Typed;
use super::schema::KEYS;
use super::to_params::team;
use super::validate::{check_settings, report};
use super::*;

/// A numeric parameter of the library, by its path.
type Parameter = (&'static str, fn(&mut TeamParams) -> &mut f64);

macro_rules! parameters {
    ($($($field:ident).+,)*) => {
        [$((stringify!($($field).+), |team: &mut TeamParams| &mut team.$($field).+),)*]
    };
}

const PARAMETERS: [Parameter; 44] = parameters![
    teammate_timeout_s,
    log.period_s,
    log.message_retention_s,
    log.decision_lag_s,
    log.retransmit_bytes_per_s,
    uav.speed_m_s,
    uav.speed_change_max_m_s,
    uav.turn_rate_max_rad_s,
    uav.speed_lag_s,
    uav.turn_rate_lag_s,
    track.target.correlation_rate_1_s,
    track.target.acceleration_sd_m_s2,
    track.sensor.range_sd_m,
    track.sensor.bearing_sd_rad,
    track.sensor.field_of_view_rad,
    track.sensor.sensing_range_m,
    track.deletion_position_sd_m,
    track.deletion_unseen_in_view_s,
    track.initial_velocity_sd_m_s,
    track.lost_track_retention_s,
    group.standoff.field_of_view_margin_rad,
    group.standoff.radius_min_m,
    group.standoff.radius_max_m,
    group.radius_time_constant_s,
    group.motion.time_constant_s,
    group.motion.acceleration_max_m_s2,
    group.motion.closing_speed_max_m_s,
    group.readmission_radius_fraction,
    group.divergence_limit_m2_s,
    group.divergence_time_s,
    group.handoff_margin_m,
    group.dwell_min_s,
    group.dwell_max_s,
    group.regrouping_period_s,
    group.assignment_reach_s,
    group.assignment_switching_cost,
    group.altitude_lowest_m,
    group.altitude_step_m,
    group.proximity_alert_m,
    guidance.radial_gain,
    guidance.heading_gain_1_s,
    guidance.turn_rate_gain,
    guidance.phase_gain_1_s,
    guidance.desired_phase_rad,
];

const IN_WORDS: [Parameter; 2] = [
    ("group.margin_sds", |team| match &mut team.group.margin {
        Margin::StandardDeviations(sds) => sds,
        Margin::Mahalanobis => panic!("not the default"),
    }),
    ("guidance.lead_s", |team| match &mut team.guidance.lead {
        Lead::Constant(lead_s) => lead_s,
        Lead::Scheduled | Lead::Predicted => panic!("not the default"),
    }),
];

#[test]
fn every_parameter_error_of_the_library_points_to_its_key() {
    let printed = format!("{:?}", TeamParams::table_1());
    let numbers = printed.split([' ', ',', '(', ')']).filter(|word| word.parse::<f64>().is_ok()).count();
    assert_eq!(numbers, PARAMETERS.len() + IN_WORDS.len(), "list a new parameter above");
    let scenario = ScenarioTemplate::of_text("mine", "[[targets.start]]\n", None).unwrap().draw(1).unwrap();
    let text = scenario.resolved().unwrap();
    let typed = Typed::of_text("mine", &text).unwrap();
    for (path, parameter) in PARAMETERS.into_iter().chain(IN_WORDS) {
        let (mut params, passed) = team(&scenario.file);
        assert_eq!(params, scenario.settings.team);
        *parameter(&mut params) = f64::NAN;
        let error = params.errors().into_iter().find(|error| error.path == path);
        let key = passed.iter().find(|passed| passed.path == path).unwrap_or_else(|| panic!("{path}: no key")).key;
        assert_eq!(KEYS.number(key), Some(key), "{path}");
        let mut problems = Problems::default();
        check_settings(&scenario.file, error.into_iter().collect(), &passed, &mut problems);
        let error = report(problems, &typed, 1).expect_err(path);
        assert!(error.problems[0].message.starts_with(&format!("{key} = ")), "{path}: {error}");
        let line = error.problems[0].place.unwrap().line;
        let lines: Vec<&str> = text.lines().take(line).collect();
        // The period is above all tables.
        let (table, name) = key.split_once('.').map_or((None, key), |(table, name)| (Some(table), name));
        assert!(lines[line - 1].starts_with(&format!("{name} = ")), "{path}: {}", lines[line - 1]);
        let header = lines.iter().rev().find(|line| line.starts_with('[')).map(|line| line.to_string());
        assert_eq!(header, table.map(|table| format!("[{table}]")), "{path}");
    }
}

/// A range in radians is reported in degrees; a range that is not an angle is reported as it is.
#[test]
fn a_range_is_reported_in_the_unit_of_the_key() {
    let error = |text: &str| {
        let text = format!("{text}\n[[targets.start]]\n");
        ScenarioTemplate::of_text("mine", &text, None).unwrap().draw(1).unwrap_err().to_string()
    };
    assert_eq!(
        error("[guidance]\ndesired_phase_deg = 181"),
        "mine:2:1: guidance.desired_phase_deg = 181: must be at least 0 and at most 180"
    );
    assert_eq!(
        error("[uavs]\nturn_rate_max_rad_s = 11"),
        "mine:2:1: uavs.turn_rate_max_rad_s = 11: must be at least 0.001 and at most 10"
    );
}

/// A default that depends on another number uses the drawn value of that number.
#[test]
fn the_filter_assumes_the_noise_that_was_drawn() {
    let text = "[sensor]\nrange_sd_m = { uniform = { min = 5, max = 6 } }\n[targets]\n\
                acceleration_sd_m_s2 = { normal = { mean = 1, sd = 0.1 } }\n[[targets.start]]\n";
    for seed in 1..4 {
        let settings = ScenarioTemplate::of_text("mine", text, None).unwrap().draw(seed).unwrap().settings;
        assert!(settings.noise.range_sd_m > 5.0);
        assert_eq!(settings.team.track.sensor.range_sd_m, settings.noise.range_sd_m);
        assert_eq!(Some(settings.team.track.target), settings.model);
    }
}
