//! Scenario files: which are accepted, which are refused, and with which messages.

use std::fs;

use crate::common::{load as load_with, overrides};
use standoff_sim::scenario::{
    BUILT_IN, Overrides, Scenario, ScenarioTemplate, SensorModel, Settings, Targets, built_in,
};

/// Loads a scenario from this text.
fn load(text: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, text).unwrap();
    let error = |error: standoff_sim::scenario::ScenarioError| {
        error.to_string().replace(&folder.path().display().to_string(), "")
    };
    Scenario::load(path.to_str().unwrap(), &Overrides::default(), 1).map_err(error)
}

fn check_error(text: &str, expected: &str) {
    assert_eq!(load(text).expect_err(text), expected);
}

const TARGET: &str = "[[targets.start]]\nx_m = 1.0\n";

#[test]
fn every_built_in_scenario_loads_without_a_warning() {
    for scenario in BUILT_IN {
        let loaded = load_with(scenario.name, &[], 1);
        assert_eq!((loaded.name.as_str(), loaded.warnings.len()), (scenario.name, 0));
        assert!(!loaded.settings.about.is_empty());
    }
}

/// A resolved scenario is a valid scenario with nothing left to draw.
#[test]
fn resolved_scenario_resolves_to_itself() {
    for scenario in BUILT_IN.iter().filter(|scenario| !scenario.name.starts_with("traffic/")) {
        let first = load_with(scenario.name, &[], 9);
        let again = load(&first.resolved().unwrap()).unwrap();
        assert_eq!(again.resolved().unwrap(), first.resolved().unwrap(), "{}", scenario.name);
        assert_eq!((again.settings.team, again.uavs), (first.settings.team, first.uavs));
    }
}

/// Only the target model differs: without keys, the filter's is that of the targets.
#[test]
fn defaults_are_the_recommended_parameters() {
    let mut team = load(TARGET).unwrap().settings.team;
    let recommended = standoff::TeamParams::recommended();
    assert_ne!(team.track.target, recommended.track.target);
    team.track.target = recommended.track.target;
    team.track.sensor = recommended.track.sensor;
    // Collision avoidance needs simulated altitudes.
    assert_eq!(team.uav.climb, Some(standoff::ClimbParams::default()));
    team.uav.climb = recommended.uav.climb;
    // The targets of this scenario neither manoeuvre nor stop.
    assert_eq!((team.track.manoeuvre_rate_1_s, team.track.stop_rate_1_s), (0.0, 0.0));
    team.track.manoeuvre_rate_1_s = recommended.track.manoeuvre_rate_1_s;
    team.track.stop_rate_1_s = recommended.track.stop_rate_1_s;
    assert_eq!(team, recommended);
}

#[test]
fn distributions_are_drawn_from_the_seed() {
    let draw = |seed| load_with("paper/table-2-single", &[], seed).uavs;
    assert_eq!(draw(1), draw(1));
    assert_ne!(draw(1), draw(2));
    let scenario = load("[uavs]\nspeed_m_s = { uniform = { min = 30.0, max = 31.0 } }\n[[targets.start]]\n").unwrap();
    assert!(
        (30.0..31.0).contains(&scenario.settings.team.uav.speed_m_s) && scenario.settings.team.uav.speed_m_s > 30.0
    );
}

#[test]
fn additional_targets_do_not_change_the_first_ones() {
    let start =
        |count: &str| match load_with("paper/table-2-pair", &[&format!("targets.random.count={count}")], 1).targets {
            Targets::Random { start, .. } => start,
            Targets::Traffic(_) => panic!("random targets expected"),
        };
    assert_eq!(start("7")[..4], start("4"));
}

#[test]
fn unknown_key_suggests_the_right_one() {
    let unknown = |text: &str, expected: &str| check_error(&format!("{text}{TARGET}"), expected);
    unknown(
        "[uavs]\ncount = 1\n  speeed_m_s = 40.0\n",
        "/mine.toml:3:3: uavs.speeed_m_s: there is no such key; did you mean `speed_m_s`?",
    );
    unknown(
        "[guidance]\nlaw = \"standoff\"\nradial-gian = 1.0\n",
        "/mine.toml:3:1: guidance.radial-gian: there is no such key; did you mean `radial_gain`?",
    );
    unknown("duration = 5\n", "/mine.toml:1:1: duration: there is no such key; did you mean `duration_s`?");
    unknown("[guidence]\nlead_s = 5\n", "/mine.toml:1:2: guidence: there is no such key; did you mean `guidance`?");
    unknown(
        "[orbit]\nlead_s = 5\n",
        "/mine.toml:2:1: orbit.lead_s: there is no such key; `lead_s` belongs in [guidance]",
    );
    unknown(
        "[uavs]\nduration_s = 5\n",
        "/mine.toml:2:1: uavs.duration_s: there is no such key; `duration_s` belongs at the top",
    );
    unknown(
        "[uavs]\ncolour = 5\n",
        "/mine.toml:2:1: uavs.colour: there is no such key; the keys in [uavs] are speed_m_s, speed_change_max_m_s, \
         turn_rate_max_rad_s, speed_lag_s, turn_rate_lag_s, count, integrator, dynamics, boot_delay_s, start_ring, start, outage, restart, \
         clock, climb, bank",
    );
    unknown(
        "[[uavs.start]]\nheading = 5\n",
        "/mine.toml:2:1: uavs.start.0.heading: there is no such key; did you mean `heading_deg`?",
    );
}

#[test]
fn value_of_the_wrong_type_is_an_error_with_line_and_column() {
    let wrong = |text: &str, expected: &str| check_error(&format!("{text}{TARGET}"), expected);
    wrong(
        "[guidance]\nlead_s = \"long\"\n",
        "/mine.toml:2:1: guidance.lead_s = \"long\": must be a number, \
         { uniform = { min = .., max = .. } } or { normal = { mean = .., sd = .. } }",
    );
    wrong(
        "[guidance]\norbit_direction = \"left\"\n",
        "/mine.toml:2:1: guidance.orbit_direction = \"left\": must be \"anticlockwise\" or \"clockwise\"",
    );
    wrong(
        "[guidance]\norbit_direction = \"clokwise\"\n",
        "/mine.toml:2:1: guidance.orbit_direction = \"clokwise\": must be \"anticlockwise\" or \"clockwise\"; did you mean `clockwise`?",
    );
    wrong("duration_s = \n", "/mine.toml:1:14: not a value: a number, true, false, or text in \"quotes\"");
    wrong("uavs = 3\n", "/mine.toml:1:1: uavs = 3: must be a table");
    wrong("[uavs]\nstart = 3\n", "/mine.toml:2:1: uavs.start = 3: must be an array of tables, [[uavs.start]]");
    wrong(
        "[orbit]\nmargin_sds = { uniform = { min = 1, mox = 2 } }\n",
        "/mine.toml:2:37: orbit.margin_sds.uniform.mox = 2: unknown field `mox`, expected `min` or `max`",
    );
    wrong(
        "[orbit]\nmargin_sds = { normal = { mean = 1 } }\n",
        "/mine.toml:2:16: orbit.margin_sds.normal: missing field `sd`",
    );
}

#[test]
fn all_errors_are_reported_together_in_the_order_of_the_text() {
    let text = "\
about = 3
duration = 5
transient_s = nan
period_s = 1..5
[guidance]
radial_gian = 0.5
lead_s = \"three\"
law = \"standof\"
[uavs]
count = 5000
start = [1, { x_m = 2 }]
[orbit]
margin_sds = { uniform = { min = 3, mx = 4 } }
radius_min_m = -1
[[targets.start]]
vx_m_s = 1e9
z_m = 1
[[targets.start]]
y_m = [
";
    let error = load(text).unwrap_err();
    let lines: Vec<_> = error.lines().map(|line| line.split_once(": ").unwrap()).collect();
    let places: Vec<_> = lines.iter().map(|(place, _)| place.trim_start_matches("/mine.toml:")).collect();
    let expected =
        ["1:1", "2:1", "3:1", "4:14", "6:1", "7:1", "8:1", "10:1", "11:10", "13:37", "14:1", "16:1", "17:1", "19:8"];
    assert_eq!(places, expected, "{error}");
}

#[test]
fn drawn_value_out_of_range_is_reported_as_drawn() {
    let text = format!("[guidance]\nlead_s = {{ uniform = {{ min = -3, max = -2 }} }}\n{TARGET}");
    let error = load(&text).unwrap_err();
    assert!(error.starts_with("/mine.toml:2:1: guidance.lead_s = -2."), "{error}");
    assert!(error.ends_with("; this value was drawn for seed 1: narrow the distribution"), "{error}");
}

#[test]
fn problems_have_an_excerpt_of_the_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, format!("\u{feff}[guidance]\nlead_s = -1\n{TARGET}")).unwrap();
    let error = Scenario::load(path.to_str().unwrap(), &overrides(&["guidance.radial_gain=7"]), 1).unwrap_err();
    let excerpts = error.problems.iter().map(|problem| problem.excerpt.clone().unwrap());
    let drawn: Vec<_> = excerpts.map(|excerpt| excerpt.text[excerpt.span].to_owned()).collect();
    assert_eq!(drawn, ["lead_s = -1", "--set guidance.radial_gain=7"]);
    assert_eq!(error.problems[0].place.unwrap().line, 2);
}

#[test]
fn files_with_other_encodings_are_refused_with_a_short_message() {
    let refused = |bytes: &[u8]| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        fs::write(&path, bytes).unwrap();
        let error = Scenario::load(path.to_str().unwrap(), &Overrides::default(), 1).unwrap_err().to_string();
        error.replace(&folder.path().display().to_string(), "")
    };
    let utf16 = "UTF-16 text; a scenario is a TOML file in UTF-8: save it again in that encoding";
    assert_eq!(refused(b"\xff\xfea\0 \0=\0"), format!("/mine.toml: {utf16}"));
    assert_eq!(refused(b"a\0 \0=\0"), format!("/mine.toml: {utf16}"));
    assert_eq!(
        refused(b"about = \"x\"\nabout2 = \"\xe9\""),
        "/mine.toml:2:11: not UTF-8 text; a scenario is a TOML file in UTF-8: save it again in that encoding"
    );
    let long = "/mine.toml: it has 2049 KiB; at most 2048 KiB; put many targets into a traffic file, see [traffic]";
    assert_eq!(refused(&vec![b' '; (2 << 20) + 1]), long);
    let nested = refused("[".repeat(100_000).as_bytes());
    assert!(nested.starts_with("/mine.toml:1:") && nested.lines().count() == 1, "{nested}");
    let nested = refused(format!("a = {}", "[".repeat(100_000)).as_bytes());
    assert_eq!(nested, "/mine.toml:1:85: cannot recurse further; max recursion depth met");
    let broken = refused(&[b"a = \0\n", b"about = \"\x1b[31m\"\n".as_slice()].concat());
    assert!(!broken.replace('\n', "").contains(char::is_control), "{broken:?}");
}

#[test]
fn line_endings_and_byte_order_mark_do_not_matter() {
    let text = format!("duration_s = 50\n{TARGET}");
    let plain = load(&text).unwrap();
    for same in [text.replace('\n', "\r\n"), format!("\u{feff}{text}")] {
        assert_eq!(load(&same).unwrap().resolved().unwrap(), plain.resolved().unwrap());
    }
}

#[test]
fn schema_for_editors_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/user/scenario.schema.json");
    let schema = format!("{:#}\n", standoff_sim::scenario::schema());
    let hint = "write it again: standoff scenarios schema > docs/user/scenario.schema.json";
    assert!(fs::read_to_string(path).unwrap() == schema, "{hint}");
}

#[test]
fn descriptions_in_the_schema_contain_every_allowed_word() {
    let schema = standoff_sim::scenario::schema();
    let definitions = schema["definitions"].as_object().unwrap();
    let mut checked = 0;
    for (table, definition) in definitions {
        for (key, property) in definition["properties"].as_object().into_iter().flatten() {
            // Options of the library are listed at their key, others in a definition.
            let choices = match property["allOf"][0]["$ref"].as_str() {
                Some(reference) => &definitions[reference.rsplit('/').next().unwrap()]["oneOf"],
                None => &property["oneOf"],
            };
            for word in choices.as_array().into_iter().flatten().filter_map(|choice| choice["const"].as_str()) {
                let description = property["description"].as_str().unwrap();
                assert!(description.contains(&format!("`{word}`")), "{table}.{key}: {word}: {description}");
                checked += 1;
            }
        }
    }
    assert!(checked > 20, "{checked} words");
}

#[test]
fn impossible_values_name_key_value_and_range() {
    let with_target = |text: &str| format!("{text}\n{TARGET}");
    check_error(
        &with_target("[uavs]\ncount = 0"),
        "/mine.toml:2:1: uavs.count = 0: must be at least 1 and at most 4096",
    );
    check_error(
        &with_target("[sensor]\nfield_of_view_deg = 10.0"),
        "/mine.toml:2:1: orbit.field_of_view_margin_deg = 10: must be at least 0 and below 10 \
         (the margin must leave some of the field of view)",
    );
    check_error(
        &with_target("[orbit]\nradius_min_m = 800.0"),
        "/mine.toml:2:1: orbit.radius_max_m = 700: must be at least 800 and at most 100000 \
         (not smaller than radius_min_m)",
    );
    check_error(
        &with_target("[orbit]\nradius_max_m = nan"),
        "/mine.toml:2:1: orbit.radius_max_m = nan: must be a finite number",
    );
    check_error(
        &with_target("[cue]\nposition_sd_m = { uniform = { min = 3.0, max = 2.0 } }"),
        "/mine.toml:2:1: cue.position_sd_m: must be uniform between finite bounds, min <= max, not 3 and 2",
    );
    check_error(
        "duration_s = 10.0\n",
        "/mine.toml: targets: no targets; give [targets.random], [[targets.start]] or [traffic]",
    );
    check_error(
        &with_target("[traffic]\nfile = \"a.xml\""),
        "/mine.toml:1:2: [targets] and [traffic] exclude each other; keep one",
    );
}

#[test]
fn all_values_out_of_range_are_reported_together() {
    let error = load(&format!("period_s = 0.0\n[guidance]\nradial_gain = 2.0\ndesired_phase_deg = 200.0\n{TARGET}"));
    let lines: Vec<_> = error.unwrap_err().lines().map(str::to_owned).collect();
    assert_eq!(
        lines,
        [
            "/mine.toml:1:1: period_s = 0: must be at least 0.01 and at most 10",
            "/mine.toml:3:1: guidance.radial_gain = 2: must be at least 0.001 and at most 1",
            "/mine.toml:4:1: guidance.desired_phase_deg = 200: must be at least 0 and at most 180",
        ]
    );
}

#[test]
fn errors_in_command_line_values_are_reported_for_the_command_line() {
    let good = Scenario::load(
        "paper/table-2-pair",
        &overrides(&["guidance.radial_gain=0.5", "guidance.orbit_direction=clockwise"]),
        1,
    );
    assert!((good.unwrap().settings.team.guidance.radial_gain - 0.5).abs() < 1e-12);
    let error = |values: &[&str]| Scenario::load("paper/table-2-pair", &overrides(values), 1).unwrap_err().to_string();
    assert_eq!(
        error(&["guidance.radial_gain=5"]),
        "command line: guidance.radial_gain = 5: must be at least 0.001 and at most 1"
    );
    assert_eq!(
        error(&["radial_gain"]),
        "command line: \"radial_gain\": must be KEY=VALUE, like guidance.radial_gain=0.5"
    );
    assert!(error(&["duration_s.x=5"]).contains("goes through something that is not a table"));
}

#[test]
fn euler_step_with_the_gain_of_table_1_gives_a_warning() {
    let set = ["uavs.integrator=euler", "uavs.speed_lag_s=0.5", "uavs.turn_rate_lag_s=0.5"];
    let scenario = load_with("paper/table-2-pair", &set, 1);
    assert_eq!(scenario.warnings.len(), 1);
    assert!(scenario.warnings[0].contains("modulus 1.000"), "{}", scenario.warnings[0]);
}

#[test]
fn overshooting_euler_step_is_refused_at_the_lag_or_the_integrator() {
    let drawn = |text: &str| ScenarioTemplate::of_text("mine.toml", text, &[]).and_then(|template| template.draw(1));
    let expected_message = |place: &str, lag: &str, value: &str| {
        format!(
            "mine.toml:{place}: uavs.{lag} = {value}: must be at least 0.5 (the period: with a shorter lag an Euler step \
             overshoots, an exact one does not)"
        )
    };
    let text =
        "[[targets.start]]\nvx_m_s = 3\n[uavs]\nintegrator = \"euler\"\nspeed_lag_s = 0.4\nturn_rate_lag_s = 0.5\n";
    assert_eq!(drawn(text).unwrap_err().to_string(), expected_message("5:1", "speed_lag_s", "0.4"));
    assert!(drawn(&text.replace("euler", "exact")).is_ok());
    assert!(drawn(&text.replace("0.4", "0.5")).is_ok());
    let by_default = drawn("[[targets.start]]\nvx_m_s = 3\n[uavs]\nintegrator = \"euler\"\n").unwrap_err().to_string();
    for lag in ["speed_lag_s", "turn_rate_lag_s"] {
        assert!(by_default.contains(&expected_message("4:1", lag, "0.3333333333333333")), "{by_default}");
    }
    // A record with such values, from a version that allowed them, can still be read.
    let flown = drawn(&text.replace("euler", "exact")).unwrap().resolved().unwrap().replace("\"exact\"", "\"euler\"");
    assert_eq!(Settings::of_record("record", &flown, &[]).unwrap().team.uav.speed_lag_s, 0.4);
}

/// A ring around targets at the limit of allowed positions extends beyond it: such a record can still be read.
#[test]
fn record_with_distant_starts_can_be_read() {
    let text = "[uavs]\ncount = 2\n[uavs.start_ring]\nradius_m = 1e6\n[[targets.start]]\nx_m = 1e7\n";
    let flown = load(text).unwrap();
    assert!(flown.uavs[0].position.x_m() > 1e7);
    assert_eq!(Settings::of_record("record", &flown.resolved().unwrap(), &[]).unwrap(), flown.settings);
}

#[test]
fn traffic_error_has_the_position_in_the_traffic_file() {
    let folder = tempfile::tempdir().unwrap();
    let traffic = folder.path().join("city.xml");
    fs::write(&traffic, "<fcd-export>\n<timestep time=\"1\">\n<vehicle id=\"a\" x=\"?\" y=\"1\"/>\n").unwrap();
    let overrides = Overrides { traffic: vec![traffic.clone()], ..Overrides::default() };
    let error = Scenario::load("traffic/convoy", &overrides, 1).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}:3:", traffic.display())), "{error}");
    assert!(error.contains("x = \"?\" is not a number"), "{error}");
}

#[test]
fn unknown_name_lists_the_built_in_scenarios_and_suggests_the_nearest() {
    let error = |name| Scenario::load(name, &Overrides::default(), 1).unwrap_err().to_string();
    let far = error("nonsense");
    assert!(far.contains("no such scenario") && far.contains("paper/table-2-pair, "), "{far}");
    assert!(!far.contains("did you mean"), "{far}");
    let both = "figure-9: no such scenario, built in or as a file (No such file or directory (os error 2)); \
        did you mean `paper/figure-9` or `improved/figure-9`?";
    assert_eq!(error("figure-9"), both);
    assert!(error("table-2-pairs").ends_with("; did you mean `paper/table-2-pair` or `improved/table-2-pair`?"));
    assert!(error("paper/figure9").ends_with("; did you mean `paper/figure-9`?"), "{}", error("paper/figure9"));
}

#[test]
fn only_an_invalid_override_is_reported() {
    let error = Scenario::load("paper/table-2-pair", &overrides(&["duration_s.x=1"]), 1).unwrap_err().to_string();
    assert_eq!(error, "command line: duration_s.x: goes through something that is not a table");
}

#[test]
fn targets_are_limited_however_they_are_listed() {
    let refused = |scattered: usize, listed: usize| {
        let at = "{x_m=1,y_m=2,vx_m_s=0,vy_m_s=0},".repeat(listed);
        let scatter = format!("random = {{count={scattered},x_m=0,y_m=0,vx_m_s=0,vy_m_s=0}}");
        let text = format!("[targets]\nstart = [{at}]\n{scatter}\n");
        ScenarioTemplate::of_text("many", &text, &[])
            .and_then(|template| template.draw(1))
            .map(drop)
            .map_err(|e| e.to_string())
    };
    assert_eq!(refused(13_384, 3000), Ok(()));
    let expected = "targets.random.count = 13385: must be at least 1 and at most 13384 (the maximum of targets, less those of [[targets.start]])";
    let error = refused(13_385, 3000).unwrap_err();
    assert!(error.contains(expected), "{error}");
    let many = "many:2:1: targets.start: must be at most 16384, not 16385; put many targets into a traffic file";
    let error = refused(1, 16_385).unwrap_err();
    assert!(error.starts_with(many), "{error}");
}

#[test]
fn a_text_too_large_to_be_read_is_refused() {
    let at = "{x_m=1,y_m=2,vx_m_s=0,vy_m_s=0},".repeat(80_000);
    let error = ScenarioTemplate::of_text("many", &format!("targets.start = [{at}]\n"), &[]).unwrap_err().to_string();
    assert!(error.starts_with("many: it has more than 4194304 bytes, or more than 800000 line ends"), "{error}");
}

/// The maximum numbers of UAVs and targets, with all values spelt out.
#[test]
fn the_largest_scenario_can_be_read_again() {
    let number = "{uniform={min=-99999.9,max=99999.9}}";
    let text = format!(
        "[uavs]\ncount = 4096\n[targets]\nacceleration_sd_m_s2 = 0.2\n\
         random = {{count=16384,x_m={number},y_m={number},vx_m_s=-1.1,vy_m_s=-1.1}}\n"
    );
    let scenario = ScenarioTemplate::of_text("many", &text, &[]).and_then(|template| template.draw(1)).unwrap();
    let resolved = scenario.resolved().unwrap();
    let again = ScenarioTemplate::of_text("many", &resolved, &[]).and_then(|template| template.draw(1)).unwrap();
    assert_eq!((again.uavs.len(), again.resolved().unwrap() == resolved), (4096, true));
}

/// Every key of a resolved scenario is on the reference page, and every example there loads.
#[test]
fn reference_page_has_every_key() {
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/user/scenarios.md")).unwrap();
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(blocks.len(), 13);
    let keys = |text: &str| -> Vec<String> {
        let mut table = String::new();
        let mut keys = Vec::new();
        for line in text.lines() {
            if let Some(header) = line.strip_prefix('[') {
                table = header.split(']').next().unwrap().trim_start_matches('[').to_owned();
            } else if let Some((key, _)) = line.split_once(" = ") {
                // For a distribution, the key of the number itself.
                keys.push(table.strip_suffix(".uniform").map_or_else(|| format!("{table}.{key}"), str::to_owned));
            }
        }
        keys
    };
    let on_page: Vec<String> = blocks.iter().flat_map(|block| keys(block)).collect();
    for block in &blocks[..11] {
        let resolved = load(block).unwrap().resolved().unwrap();
        for key in keys(&resolved) {
            assert!(on_page.contains(&key), "{key} is not on the page");
        }
    }
    let traffic = load_with("traffic/convoy", &["traffic.gap_s=1.25"], 1).resolved().unwrap();
    for key in keys(&traffic) {
        assert!(on_page.contains(&key), "{key} is not on the page");
    }
    for key in blocks[11..].iter().flat_map(|block| keys(block)) {
        assert!(keys(&traffic).contains(&key), "{key} is not known");
    }
}

/// The defaults on the reference page are the actual defaults.
#[test]
fn reference_page_has_the_defaults() {
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/user/scenarios.md")).unwrap();
    let full = page.split("```toml\n").nth(2).unwrap().split("```").next().unwrap();
    let (page, bare) = (load(full).unwrap().settings, load(TARGET).unwrap().settings);
    assert_eq!((page.duration, page.period, page.transient), (bare.duration, bare.period, bare.transient));
    assert_eq!(
        (page.team.uav, page.team.guidance, page.team.group),
        (bare.team.uav, bare.team.guidance, bare.team.group)
    );
    // On the page, the optional range rate has its most common value.
    let sensor = SensorModel { range_rate_sd_m_s: None, ..page.sensor };
    assert_eq!((sensor, page.cue), (bare.sensor, bare.cue));
    assert_eq!(page.team.track.sensor, bare.team.track.sensor);
}

#[test]
fn false_alarms_need_detections_without_labels() {
    check_error(
        &format!("[sensor]\nfalse_alarms_per_scan = 2\n{TARGET}"),
        "/mine.toml:2:1: sensor.false_alarms_per_scan = 2: a false alarm is of no target and cannot have a label; set \
         sensor.labels = \"none\", or 0",
    );
    let unlabelled = format!("[sensor]\nfalse_alarms_per_scan = 2\nlabels = \"none\"\n{TARGET}");
    assert_eq!(load(&unlabelled).unwrap().settings.sensor.truth.false_alarms_per_scan, 2.0);
}

/// The team assumes the true sensor unless `[filter]` gives other values; without noise of the range rate, 0.5 m/s.
#[test]
fn assumptions_of_the_team_follow_the_sensor() {
    let sensor = "[sensor]\nlabels = \"none\"\ndetection_probability = 0.9\nmdv_m_s = 2\nfalse_alarms_per_scan = 5\n";
    let of = |more: &str| load(&format!("{sensor}{more}{TARGET}")).unwrap().settings;
    let assumed = |more: &str| {
        let sensor = of(more).team.track.sensor;
        [sensor.detection_probability, sensor.mdv_m_s, sensor.false_alarms_per_scan, sensor.range_rate_sd_m_s]
    };
    assert_eq!(assumed(""), [0.9, 2.0, 5.0, 0.5]);
    assert_eq!(assumed("range_rate_sd_m_s = 0.25\n"), [0.9, 2.0, 5.0, 0.25]);
    assert_eq!(assumed("[filter]\ndetection_probability = 0.7\nmdv_m_s = 3\n"), [0.7, 3.0, 5.0, 0.5]);
    assert_eq!(of("[filter]\nmdv_m_s = 3\n").sensor.truth.mdv_m_s, 2.0);
}

#[test]
fn count_may_be_drawn_and_must_be_an_integer() {
    let count = |seed: u64| {
        let set = ["targets.random.count={ uniform = { min = 2, max = 9 } }"];
        match load_with("paper/table-2-pair", &set, seed).targets {
            Targets::Random { start, .. } => start.len(),
            Targets::Traffic(_) => 0,
        }
    };
    let counts: Vec<_> = (1..=20).map(count).collect();
    assert!(counts.iter().all(|count| (2..=9).contains(count)) && counts.iter().any(|count| *count != counts[0]));
    check_error(&format!("[uavs]\ncount = 1.5\n{TARGET}"), "/mine.toml:2:1: uavs.count = 1.5: must be a whole number");
}

#[test]
fn starts_out_of_range_are_refused_at_their_position() {
    check_error(
        "[targets.random]\nx_m = { normal = { mean = 0.0, sd = 1e7 } }\n",
        "/mine.toml:2:1: targets.random.x_m: up to -60000000: must be at least -10000000 and at most 10000000",
    );
    check_error(
        "[[targets.start]]\nvx_m_s = 1e300\n",
        "/mine.toml:2:1: targets.start.0.vx_m_s = 1e300: must be at least -1000 and at most 1000",
    );
    check_error(
        &format!("[uavs.start_ring]\nspacing_deg = 1e300\n{TARGET}"),
        "/mine.toml:2:1: uavs.start_ring.spacing_deg = 1e300: must be at least -1000000 and at most 1000000",
    );
    check_error(
        &format!("[uavs.start_ring]\n[[uavs.start]]\n{TARGET}"),
        "/mine.toml:1:7: uavs.start_ring: [uavs.start_ring] and [[uavs.start]] exclude each other; keep one",
    );
    check_error(
        &format!("[sensor]\nsensing_range_m = 100.0\n{TARGET}"),
        "/mine.toml:2:1: sensor.sensing_range_m = 100: must be above 250 \
         (the centre must be in view from the smallest orbit, radius_min_m)",
    );
}

#[test]
fn errors_are_reported_once_and_command_line_errors_as_such() {
    check_error(
        &format!("[sensor]\nrange_sd_m = 1e6\n{TARGET}"),
        "/mine.toml:2:1: sensor.range_sd_m = 1000000: must be at least 0 and at most 100000",
    );
    let error = |values: &[&str]| Scenario::load("tour/01-one-uav", &overrides(values), 1).unwrap_err().to_string();
    assert!(error(&["nope.key=1"]).starts_with("command line: nope: there is no such key"));
    assert!(error(&["uavs.start=[{x_m=1,z=2}]"]).contains("command line: uavs.start.0.z: there is no such key"));
}

#[test]
fn resolved_traffic_scenario_still_finds_the_built_in_traffic() {
    let scenario = load_with("traffic/convoy", &[], 1);
    let again = load(&scenario.resolved().unwrap()).unwrap();
    assert_eq!((again.settings, again.uavs), (scenario.settings, scenario.uavs));
}

#[test]
fn too_short_traffic_is_refused_with_its_file_name() {
    let folder = tempfile::tempdir().unwrap();
    let traffic = folder.path().join("short.csv");
    fs::write(&traffic, "t,id,x,y\n0,a,0,0\n0.3,a,1,0\n").unwrap();
    let overrides = Overrides { traffic: vec![traffic.clone()], ..Overrides::default() };
    let error = Scenario::load("traffic/convoy", &overrides, 1).unwrap_err().to_string();
    assert_eq!(error, format!("{}: spans 0.3 s; a mission needs at least one period_s of 0.5 s", traffic.display()));
    check_error("[traffic]\n", "/mine.toml:1:2: traffic.file: missing; name SUMO floating-car data, CSV tracks or GPX");
}

/// `improved/*` differs from `paper/*` only by the law; figure 9 also by its start.
#[test]
fn improved_scenarios_differ_from_the_paper_only_by_the_law() {
    let improved = ["about", "guidance.law", "uavs.start"];
    fn flat(prefix: &str, table: &toml::Table, all: &mut std::collections::BTreeMap<String, toml::Value>) {
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) if key != "phase_deg" => flat(&format!("{prefix}{key}."), inner, all),
                _ => drop(all.insert(format!("{prefix}{key}"), value.clone())),
            }
        }
    }
    for name in ["table-2-pair", "figure-9"] {
        let keys = |folder: &str| {
            let mut all = std::collections::BTreeMap::new();
            flat("", &toml::from_str(built_in(&format!("{folder}/{name}")).unwrap().text).unwrap(), &mut all);
            all
        };
        let (paper, best) = (keys("paper"), keys("improved"));
        let differ = paper.keys().chain(best.keys()).filter(|key| paper.get(*key) != best.get(*key));
        for key in differ {
            assert!(improved.contains(&key.as_str()), "{name}: {key} differs");
        }
    }
}
