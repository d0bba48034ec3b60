//! Reads the traffic files of a scenario and compares their time span with the mission.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use standoff_io::display_text::{count, quoted};

use super::builtin::BUILT_IN_TRAFFIC;
use super::dotted::value_at;
use super::error::ScenarioError;
use super::load::{Typed, related, stem};
use super::locate::Map;
use super::resolved::Settings;
use crate::traffic::{self, DAY_US, Joined, STANDARD_INPUT, Traffic, is_rollover};

/// Longest traffic that is flown to its end by default, s. Recordings last hours: a file that spans more than a day
/// contains a wrong time, and with it a file of two rows could fill a disk.
const UNASKED_MAX_S: f64 = 86_400.0;

/// Maximum length of the name of a traffic file or a map, bytes: the limit of Linux for a path.
pub(super) const NAME_MAX: usize = 4096;

/// Maximum number of traffic files.
const FILES_MAX: usize = 100;

/// Reads and checks the traffic files; takes their traffic from `known` if they have been read before.
pub(super) fn read(typed: &Typed, known: Option<&Arc<Traffic>>) -> Result<Option<Arc<Traffic>>, ScenarioError> {
    let Some(table) = &typed.file.traffic else { return Ok(None) };
    let refuse = |key: &str, message: String| {
        Err(ScenarioError::from(typed.origin.problem(&Map::new(&typed.origin.text), key, message, None)))
    };
    if typed.file.targets.is_some() {
        return refuse("traffic", "[targets] and [traffic] exclude each other; keep one".to_owned());
    }
    let names = table.file.names();
    if typed.left_out.iter().any(|key| related(key, "traffic.file")) {
        // Its value has a wrong form, which is reported.
        return Ok(None);
    }
    if names.iter().all(String::is_empty) {
        return refuse("traffic", "traffic.file: missing; name SUMO floating-car data, CSV tracks or GPX".to_owned());
    }
    if names.len() > FILES_MAX {
        let what = format!("traffic.file: {} files; must be at most {FILES_MAX}; join some of them", names.len());
        return refuse("traffic.file", what);
    }
    if let Some(name) = names.iter().find(|name| !(1..=NAME_MAX).contains(&name.len())) {
        let what = format!("traffic.file = {}: must be 1 to {NAME_MAX} bytes", quoted(name));
        return refuse("traffic.file", what);
    }
    if let Some(key) = ["traffic.gap_s", "traffic.frame_rate_hz"].into_iter().find(|key| typed.is_drawn(key)) {
        let what = "must be a number, not a distribution, because the file is read once for all seeds";
        return refuse(key, format!("{key}: {what}"));
    }
    let (gap_s, frame_rate_hz) = (table.gap_s, table.frame_rate_hz);
    if let Some(rate) = frame_rate_hz.filter(|rate| !(1.0..=1_000.0).contains(rate)) {
        return refuse("traffic.frame_rate_hz", format!("traffic.frame_rate_hz = {rate}: must be 1 to 1000"));
    }
    if let Some(gap_s) = gap_s.filter(|gap_s| *gap_s <= 0.0) {
        return refuse("traffic.gap_s", format!("traffic.gap_s = {gap_s}: must be above 0"));
    }
    if let Some(known) = known {
        return Ok(Some(Arc::clone(known)));
    }
    let coordinates = table.coordinates;
    let mut options = traffic::Options { coordinates, gap_s, persons: table.persons, frame_rate_hz, origin: None };
    let mut files = Joined::default();
    for name in names {
        let path = path(typed, name);
        let read = match built_in(name, &path) {
            Some((name, bytes)) => traffic::read_from(*bytes, name, &options),
            None if name == STANDARD_INPUT => traffic::read_standard_input(&options),
            None => traffic::read(&path, &options),
        }?;
        // All files have the plane of the first one.
        options.origin = options.origin.or(read.origin);
        files.add(path.to_string_lossy().into_owned(), stem(Path::new(name)), read)?;
    }
    Ok(Some(Arc::new(files.finish()?)))
}

/// Paths of the traffic files that are not built in.
pub(super) fn files(typed: &Typed) -> Vec<PathBuf> {
    let names = typed.file.traffic.iter().flat_map(|table| table.file.names());
    let paths = names.map(|name| (name, path(typed, name)));
    paths.filter(|(name, path)| built_in(name, path).is_none()).map(|(_, path)| path).collect()
}

/// Returns the built-in traffic file of that name, unless a file of that name exists on disk.
fn built_in(name: &str, path: &Path) -> Option<&'static (&'static str, &'static [u8])> {
    BUILT_IN_TRAFFIC.iter().find(|(built_in, _)| *built_in == name).filter(|_| !path.exists())
}

/// Path at which the file is expected.
fn path(typed: &Typed, name: &str) -> PathBuf {
    match name {
        STANDARD_INPUT => PathBuf::from(name),
        _ => typed.files_from.as_deref().unwrap_or(Path::new("")).join(name),
    }
}

/// Rejects a file that is shorter than one period, or implausibly long.
pub(super) fn check_span(typed: &Typed, period_s: f64, traffic: &Traffic) -> Result<(), ScenarioError> {
    let (Some(table), None) = (&typed.file.traffic, value_at(&typed.table, "duration_s")) else { return Ok(()) };
    let span_s = traffic.span_s();
    let wrong = if span_s < period_s {
        format!("a mission needs at least one period_s of {period_s} s")
    } else if span_s > UNASKED_MAX_S {
        format!(
            "{}; at most {UNASKED_MAX_S} s (a day) are flown by default; correct a time, cut the file into parts, or set the \
             length: --set duration_s=...",
            described_span(traffic)
        )
    } else {
        return Ok(());
    };
    let paths: Vec<String> = table.file.names().iter().map(|name| path(typed, name).display().to_string()).collect();
    Err(ScenarioError::one(paths.join(", "), None, format!("spans {span_s} s; {wrong}")))
}

/// Describes when the traffic begins and ends, and the gap if that is most of it, as after a wrong date.
fn described_span(traffic: &Traffic) -> String {
    let shown = |time_us| traffic.times.shown(time_us);
    let (begin, end) = (shown(traffic.begin_us), shown(traffic.end_us));
    let span = format!("its times are {begin} to {end}");
    let (gap_us, [before, after]) = traffic.longest_gap();
    if 2 * gap_us <= traffic.end_us - traffic.begin_us {
        return span;
    }
    let [before, after] =
        [before, after].map(|(name, time_us)| format!("vehicle {} at {}", quoted(name), shown(time_us)));
    let weeks = match is_rollover(gap_us) {
        true => {
            ": the week number of GPS starts again after 1024 weeks, so that the earlier times are 7168 days too early"
        }
        false => "",
    };
    let days = gap_us as f64 / DAY_US as f64;
    format!("{span}, with {days:.0} days between {before} and {after}{weeks}")
}

/// Returns a warning about vehicles that appear more than a day after the end of the mission, probably at a wrong time.
pub(super) fn absence_warning(settings: &Settings, traffic: &Traffic) -> Option<String> {
    let end_us = traffic.begin_us + settings.duration.us();
    let late: Vec<_> = traffic.vehicles.iter().filter(|vehicle| vehicle.first_us() - end_us > DAY_US).collect();
    let first = late.first()?;
    let (all, late) = (count(traffic.vehicles.len(), "vehicle"), late.len());
    Some(format!(
        "the mission ends before {late} of {all}: {} begins at {}, the traffic at {}; correct the times of one",
        quoted(first.name()),
        traffic.times.shown(first.first_us()),
        traffic.times.shown(traffic.begin_us)
    ))
}

/// Returns a warning if the traffic ends before the mission or continues after it, unless the command line requested
/// this.
pub(super) fn length_warning(typed: &Typed, settings: &Settings, traffic: &Traffic) -> Option<String> {
    // Without `duration_s`, the mission is as long as the traffic.
    value_at(&typed.table, "duration_s")?;
    let (span_s, duration_s, period_s) = (traffic.span_s(), settings.duration.s(), settings.period.s());
    if span_s <= duration_s - period_s {
        let shortest_s = span_s.max(period_s);
        return Some(format!(
            "the traffic ends after {span_s} s, but duration_s = {duration_s}: afterwards there is nothing to track; \
             --set duration_s={shortest_s} ends the mission with it"
        ));
    }
    if span_s < duration_s + period_s || typed.origin.is_edited("duration_s") {
        return None;
    }
    let advice = if span_s > UNASKED_MAX_S {
        "does the file contain a wrong time?".to_owned()
    } else {
        format!("--set duration_s={span_s} flies all of it")
    };
    Some(format!("the traffic lasts {span_s} s, but duration_s = {duration_s}: the rest is not flown; {advice}"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::{Overrides, Scenario, ScenarioTemplate};
    use crate::common::overrides;

    /// Loads a scenario with the traffic of one car that exists from 0 s to `until_s`.
    fn load(scenario: &str, until_s: f64, set: &[&str]) -> Result<Scenario, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cars.csv");
        fs::write(&file, format!("t,id,x,y\n0,a,0,0\n{until_s},a,1,0\n")).unwrap();
        let overrides = Overrides { traffic: vec![file.clone()], ..overrides(set) };
        let loaded = Scenario::load(scenario, &overrides, 1);
        loaded.map_err(|error| error.to_string().replace(&file.display().to_string(), "cars.csv"))
    }

    fn warnings(until_s: f64, set: &[&str]) -> Vec<String> {
        load("improved/figure-9", until_s, set).unwrap().warnings
    }

    #[test]
    fn traffic_longer_than_a_day_is_flown_only_on_request() {
        assert_eq!(load("traffic/convoy", 86_400.0, &[]).unwrap().settings.duration.s(), 86_400.0);
        let expected = "cars.csv: spans 1000000000 s; its times are 0 s to 1000000000 s, with 11574 days between vehicle \"a\" \
                        at 0 s and vehicle \"a\" at 1000000000 s; at most 86400 s (a day) are flown by default; correct a time, cut the file into parts, or set the length: --set duration_s=...";
        assert_eq!(load("traffic/convoy", 1e9, &[]).unwrap_err(), expected);
        assert!(load("traffic/convoy", 86_400.5, &[]).is_err());
        assert_eq!(load("traffic/convoy", 1e9, &["duration_s=100000"]).unwrap().settings.duration.s(), 1e5);
    }

    #[test]
    fn a_mismatch_of_traffic_and_mission_length_is_a_warning() {
        let ends = "the traffic ends after 60 s, but duration_s = 100: afterwards there is nothing to track; \
                    --set duration_s=60 ends the mission with it";
        assert_eq!(warnings(60.0, &[]), [ends]);
        let too_long = "the traffic lasts 309.5 s, but duration_s = 100: the rest is not flown; \
                       --set duration_s=309.5 flies all of it";
        assert_eq!(warnings(309.5, &[]), [too_long]);
        let far = &warnings(1e9, &[])[0];
        assert!(far.ends_with("the rest is not flown; does the file contain a wrong time?"), "{far}");
        let short = &warnings(0.25, &[])[0];
        assert!(
            short.ends_with("--set duration_s=0.5 ends the mission with it"),
            "no mission is shorter than a period: {short}"
        );
    }

    /// A receiver whose week number has started again writes dates that are 1024 weeks too early.
    #[test]
    fn a_vehicle_at_a_wrong_date_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let rows = |name: &str, day: &str| format!("{day}T09:00:00Z,{name},0,0\n{day}T09:00:09Z,{name},9,0\n");
        let traffic = folder.path().join("cars.csv");
        fs::write(&traffic, format!("t,id,x,y\n{}{}", rows("van", "2026-05-04"), rows("truck", "2006-09-18"))).unwrap();
        let load = |set: &[&str]| {
            let overrides = Overrides { traffic: vec![traffic.clone()], ..overrides(set) };
            Scenario::load("traffic/convoy", &overrides, 1)
        };
        let error = load(&[]).unwrap_err().to_string();
        let expected = "its times are 2006-09-18T09:00:00Z to 2026-05-04T09:00:09Z, with 7168 days between vehicle \"truck\" at \
                        2006-09-18T09:00:09Z and vehicle \"van\" at 2026-05-04T09:00:00Z: the week number of GPS";
        assert!(error.contains(expected), "{error}");
        let expected = "the mission ends before 1 of 2 vehicles: \"van\" begins at 2026-05-04T09:00:00Z, the traffic at \
                        2006-09-18T09:00:00Z; correct the times of one";
        assert_eq!(load(&["duration_s=5"]).unwrap().warnings, [expected]);
    }

    #[test]
    fn no_warning_if_the_lengths_match_or_were_requested() {
        assert_eq!(warnings(100.25, &[]), [""; 0], "within a period");
        assert_eq!(warnings(99.75, &[]), [""; 0], "within a period");
        assert_eq!(warnings(309.5, &["duration_s=40"]), [""; 0]);
        assert_eq!(warnings(60.0, &["duration_s=70"]).len(), 1, "a request cannot extend the traffic");
        for scenario in ["traffic/convoy", "traffic/city"] {
            assert_eq!(Scenario::load(scenario, &Overrides::default(), 1).unwrap().warnings, [""; 0]);
        }
    }

    /// The file is gone when the scenario is changed.
    #[test]
    fn a_changed_scenario_reads_its_traffic_again_only_if_the_changes_concern_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cars.csv");
        fs::write(&file, "t,id,x,y\n0,a,0,0\n60,a,1,0\n").unwrap();
        let overrides = Overrides { traffic: vec![file.clone()], ..overrides(&["uavs.count=2"]) };
        let template = ScenarioTemplate::load("traffic/convoy", &overrides).unwrap();
        let set = |set: &str| [set.to_owned()];
        let again = ScenarioTemplate::load(
            "traffic/convoy",
            &Overrides { set: [&overrides.set[..], &set("sensor.range_sd_m=7")].concat(), ..overrides.clone() },
        );
        fs::remove_file(&file).unwrap();
        let changed = template.changed(&set("sensor.range_sd_m=7")).unwrap();
        assert_eq!(changed.text().unwrap(), again.unwrap().text().unwrap());
        assert_eq!(changed.traffic_crc32(), template.traffic_crc32());
        assert!(changed.draw(1).is_ok());
        let error = |of: &str| template.changed(&set(of)).unwrap_err().to_string();
        assert!(error("traffic.gap_s=9").contains("cars.csv"), "{}", error("traffic.gap_s=9"));
        assert!(error("targets.random.count=3").contains("[targets] and [traffic] exclude each other"));
        assert!(error("sensor.range=1").contains("sensor.range: there is no such key"), "{}", error("sensor.range=1"));
    }

    #[test]
    fn traffic_files_are_one_name_or_a_list() {
        let folder = tempfile::tempdir().unwrap();
        for (name, y_m) in [("a.csv", 0), ("b.csv", 9)] {
            fs::write(folder.path().join(name), format!("t,id,x,y\n0,car,0,{y_m}\n60,car,9,{y_m}\n")).unwrap();
        }
        let load = |file: &str| {
            let toml = format!("[traffic]\nfile = {file}");
            super::super::ScenarioTemplate::of_toml("mine", &toml, &Overrides::default(), folder.path())
        };
        let one = load("\"a.csv\"").unwrap();
        assert!(one.text().unwrap().contains("file = \"a.csv\""));
        let both = load("[\"a.csv\", \"b.csv\"]").unwrap();
        assert!(both.text().unwrap().contains("file = [\"a.csv\", \"b.csv\"]"));
        assert_eq!(both.traffic_files(), ["a.csv", "b.csv"].map(|name| folder.path().join(name)));
        let again =
            super::super::ScenarioTemplate::of_text("mine", &both.text().unwrap(), &both.traffic_files()).unwrap();
        assert_eq!(
            (again.traffic_crc32(), again.traffic_crc32() == one.traffic_crc32()),
            (both.traffic_crc32(), false)
        );
        let many = format!("[{}]", "\"a.csv\", ".repeat(101));
        for (file, expected) in [
            ("3", "mine:2:1: traffic.file = 3: must be a string or an array, in []"),
            ("[\"a.csv\", 4]", "traffic.file.1 = 4: must be a string"),
            ("[]", "traffic.file: missing; name SUMO"),
            ("[\"a.csv\", \"\"]", "traffic.file = \"\": must be 1 to 4096 bytes"),
            (&many, "traffic.file: 101 files; must be at most 100"),
            ("[\"a.csv\", \"c.csv\"]", "c.csv: cannot be read"),
        ] {
            let error = load(file).unwrap_err().to_string();
            assert!(error.contains(expected) && !error.contains('\n'), "{file}: {error}");
        }
    }

    #[test]
    fn the_name_of_a_traffic_file_is_not_repeated_at_length() {
        let overrides = Overrides { traffic: vec!["x".repeat(100_000).into()], ..Overrides::default() };
        let error = Scenario::load("traffic/convoy", &overrides, 1).unwrap_err().to_string();
        assert!(error.contains("traffic.file = \"xxx") && error.len() < 1000, "{error}");
    }
}
