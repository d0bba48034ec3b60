//! Tests that typed values and the library's checks fit together.

use standoff::{BankParams, ClimbParams, ParamValue, SeparationParams, TeamParams, WindParams};

use super::diagnostics::Problems;
use super::load::Typed;
use super::resolve::team;
use super::schema::root;
use super::validate::{check_settings, report};
use super::*;

#[test]
fn every_parameter_error_of_the_library_points_to_its_key() {
    let mut params = TeamParams::recommended();
    (params.uav.climb, params.uav.bank) = (Some(ClimbParams::default()), Some(BankParams::default()));
    (params.separation, params.wind) = (Some(SeparationParams::default()), Some(WindParams::default()));
    let printed = format!("{params:?}");
    let printed = printed.split([' ', ',', '(', ')']).filter(|word| word.parse::<f64>().is_ok()).count();
    let numbers = TeamParams::table().iter().filter(|param| param.kind.is_number());
    assert_eq!(printed, numbers.clone().count(), "every number is in the table");
    let text = "[separation]\n[uavs]\ndynamics = \"bank\"\n[uavs.climb]\n[wind]\n[[targets.start]]\n";
    let scenario = ScenarioTemplate::of_text("mine", text, &[]).unwrap().draw(1).unwrap();
    let text = scenario.resolved().unwrap();
    let typed = Typed::of_text("mine", &text).unwrap();
    assert_eq!(team(&scenario.file), scenario.settings.team);
    for param in numbers {
        let (path, key) = (param.path, param.key);
        let mut params = scenario.settings.team;
        assert!(param.set(&mut params, ParamValue::Number(f64::NAN)), "{path}");
        assert!(params.errors().iter().any(|error| error.path == path), "{path}");
        assert!(root().at(key).unwrap().is_number(), "{path}");
        let mut problems = Problems::default();
        check_settings(&scenario.file, &params, Vec::new(), &mut problems);
        problems.found.retain(|found| found.key == key);
        let error = report(problems, &typed, 1).expect_err(path);
        assert!(error.problems[0].message.starts_with(&format!("{key} = ")), "{path}: {error}");
        let line = error.problems[0].place.unwrap().line;
        let lines: Vec<&str> = text.lines().take(line).collect();
        // The period is above all tables.
        let (table, name) = key.rsplit_once('.').map_or((None, key), |(table, name)| (Some(table), name));
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
        ScenarioTemplate::of_text("mine", &text, &[]).unwrap().draw(1).unwrap_err().to_string()
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
        let settings = ScenarioTemplate::of_text("mine", text, &[]).unwrap().draw(seed).unwrap().settings;
        assert!(settings.sensor.truth.range_sd_m > 5.0);
        assert_eq!(settings.team.track.sensor.range_sd_m, settings.sensor.truth.range_sd_m);
        assert_eq!(Some(settings.team.track.target), settings.model);
    }
}

/// The defaults of other keys of the wind depend on a wrong value; they are not reported with it.
#[test]
fn a_wrong_wind_is_one_error() {
    for wrong in ["speed_m_s = 1000", "from_deg = 1000", "speed_m_s = 5\nreference_height_m = -1\nshear_exponent = 0.1"]
    {
        let text = format!("[wind]\n{wrong}\n[[targets.start]]\n");
        let error = ScenarioTemplate::of_text("mine", &text, &[]).unwrap().draw(1).unwrap_err();
        assert_eq!(error.problems.len(), 1, "{error}");
        let keys = ["wind.speed_m_s = 1000", "wind.from_deg = 1000", "wind.reference_height_m = -1"];
        assert!(keys.iter().any(|key| error.problems[0].message.starts_with(key)), "{error}");
    }
}
