//! What is typed, and what the library says of it, meet.

use standoff::{Lead, Margin, TeamParams};

use super::check::{check_settings, report};
use super::load::Typed;
use super::problems::Problems;
use super::schema::KEYS;
use super::team::team;
use super::*;

/// A number of the library's, by its path.
type Parameter = (&'static str, fn(&mut TeamParams) -> &mut f64);

macro_rules! parameters {
    ($($($field:ident).+,)*) => {
        [$((stringify!($($field).+), |team: &mut TeamParams| &mut team.$($field).+),)*]
    };
}

const PARAMETERS: [Parameter; 45] = parameters![
    teammate_timeout_s,
    log.period_s,
    log.horizon_s,
    log.decision_lag_s,
    log.repair_bytes_per_s,
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
    track.lost_position_sd_m,
    track.lost_in_view_s,
    track.start_velocity_sd_m_s,
    track.forget_lost_s,
    group.standoff.field_of_view_rad,
    group.standoff.field_of_view_margin_rad,
    group.standoff.radius_min_m,
    group.standoff.radius_max_m,
    group.smoothing_s,
    group.motion.response_s,
    group.motion.acceleration_max_m_s2,
    group.motion.approach_max_m_s,
    group.take_back_fraction,
    group.convergence_limit_m2_s,
    group.convergence_patience_s,
    group.handoff_margin_m,
    group.dwell_min_s,
    group.dwell_max_s,
    group.review_period_s,
    group.reach_ahead_s,
    group.assignment_inertia,
    group.altitude_lowest_m,
    group.altitude_step_m,
    group.separation_alarm_m,
    guidance.radial_gain,
    guidance.heading_gain_1_s,
    guidance.turn_rate_gain,
    guidance.spacing_gain_1_s,
    guidance.separation_rad,
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
fn every_parameter_that_the_library_refuses_is_shown_where_it_was_typed() {
    let told = format!("{:?}", TeamParams::table_1());
    let numbers = told.split([' ', ',', '(', ')']).filter(|word| word.parse::<f64>().is_ok()).count();
    assert_eq!(numbers, PARAMETERS.len() + IN_WORDS.len(), "a new one is listed above");
    let scenario = Template::of_text("mine", "[[targets.at]]\n", None).unwrap().draw(1).unwrap();
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
        let told = report(problems, &typed, 1).expect_err(path);
        assert!(told.problems[0].message.starts_with(&format!("{key} = ")), "{path}: {told}");
        let line = told.problems[0].place.unwrap().line;
        let lines: Vec<&str> = text.lines().take(line).collect();
        // The period stands above all tables.
        let (table, name) = key.split_once('.').map_or((None, key), |(table, name)| (Some(table), name));
        assert!(lines[line - 1].starts_with(&format!("{name} = ")), "{path}: {}", lines[line - 1]);
        let header = lines.iter().rev().find(|line| line.starts_with('[')).map(|line| line.to_string());
        assert_eq!(header, table.map(|table| format!("[{table}]")), "{path}");
    }
}

/// What is out of range in radians is told in degrees, and what is not an angle as it is.
#[test]
fn a_range_is_told_in_the_unit_of_the_key() {
    let told = |text: &str| {
        let text = format!("{text}\n[[targets.at]]\n");
        Template::of_text("mine", &text, None).unwrap().draw(1).unwrap_err().to_string()
    };
    assert_eq!(
        told("[guidance]\nseparation_deg = 181"),
        "mine:2:1: guidance.separation_deg = 181: must be at least 0 and at most 180"
    );
    assert_eq!(
        told("[uavs]\nturn_rate_max_rad_s = 11"),
        "mine:2:1: uavs.turn_rate_max_rad_s = 11: must be at least 0.001 and at most 10"
    );
}

/// A number that follows another follows what was drawn for that.
#[test]
fn the_filter_assumes_the_noise_that_was_drawn() {
    let text = "[sensor]\nrange_sd_m = { uniform = { min = 5, max = 6 } }\n[targets]\n\
                acceleration_sd_m_s2 = { normal = { mean = 1, sd = 0.1 } }\n[[targets.at]]\n";
    for seed in 1..4 {
        let settings = Template::of_text("mine", text, None).unwrap().draw(seed).unwrap().settings;
        assert!(settings.noise.range_sd_m > 5.0);
        assert_eq!(settings.team.track.sensor.range_sd_m, settings.noise.range_sd_m);
        assert_eq!(Some(settings.team.track.target), settings.model);
    }
}
