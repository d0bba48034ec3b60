//! Checks of a scenario beyond the range of each number. Errors point to where the value was typed, in the unit in
//! which it was typed.

use standoff::validation::Allowed;
use standoff::{ParamError, TeamParams};
use standoff_io::display_text::quoted;

use super::basemap::MAPS_MAX;
use super::diagnostics::{Found, Problems};
use super::dotted::value_at;
use super::error::{Problem, ScenarioError};
use super::load::{Typed, related};
use super::locate::Map;
use super::number::Number;
use super::parameters::number;
use super::parse::{MISTAKES_MAX, with_value};
use super::schema_types::{AgentSetup, Dynamics, Intruder, Labels, Link, Radio, ScenarioFile, Targets, Uavs};
use super::traffic::NAME_MAX;
use crate::traffic::MAX_AT_ONCE;

/// Maximum number of time steps of a mission: a longer record would fill the disk.
const TICKS_MAX: f64 = 10_000_000.0;

/// Maximum number of outages, manoeuvres and other listed faults, each.
const LISTED_MAX: usize = 1_000;

/// Maximum number of UAVs: as many as a team accepts.
const UAVS_MAX: f64 = 4_096.0;

/// Maximum number of UAVs with one agent each: an agent keeps the reports of all others for the retention time, so that
/// memory grows with the square. 100 agents over 1,000 targets have taken 1.1 GB.
const AGENTS_MAX: f64 = 100.0;

/// Maximum number of intruders, which is also the number that an agent can track.
const INTRUDERS_MAX: usize = 100;

/// Maximum length of the description of a scenario, characters.
const ABOUT_MAX: usize = 1_000;

/// Checks the settings: relations between numbers here, everything else by the library, which also found the errors
/// `over` a period.
pub(super) fn check_settings(file: &ScenarioFile, team: &TeamParams, over: Vec<ParamError>, problems: &mut Problems) {
    let longest_s = file.period_s.max(0.01) * TICKS_MAX;
    let duration =
        Allowed::at_least(file.period_s).at_most(longest_s).with_reason("one period_s to ten million of them");
    problems.check("duration_s", file.duration_s, duration);
    let findable = Allowed::at_least(1e-3)
        .below(team.track.deletion_position_sd_m)
        .with_reason("a less certain track is lost: below filter.deletion_position_sd_m");
    problems.check("cue.position_sd_m", file.cue.position_sd_m, findable);
    if file.sensor.labels == Labels::All && file.sensor.false_alarms_per_scan > 0.0 {
        let what = "a false alarm is of no target and cannot have a label; set sensor.labels = \"none\", or 0";
        problems.add("sensor.false_alarms_per_scan", what, Some(file.sensor.false_alarms_per_scan.into()));
    }
    for ParamError { path, value, allowed } in team.errors().into_iter().chain(over) {
        let param = TeamParams::table().iter().find(|param| param.path == path);
        let (key, is_angle) = param.map_or((path.as_str(), false), |param| (param.key, param.is_angle()));
        let typed = number(&file.parameters, key).unwrap_or(value);
        // Converted to the unit in which the value was typed.
        let allowed = if is_angle { allowed.map(f64::to_degrees) } else { allowed };
        problems.add(key, format!("must be {allowed}"), Some(typed.into()));
    }
}

/// Checks UAVs, targets, intruders, radio and description. This happens before targets are drawn, so that every error
/// points to where it was typed.
pub(super) fn check_objects(file: &ScenarioFile, problems: &mut Problems) {
    if file.about.chars().any(char::is_control) || file.about.chars().count() > ABOUT_MAX {
        problems.add("about", format!("must be one line of at most {ABOUT_MAX} characters"), None);
    }
    if file.basemap.len() > MAPS_MAX {
        problems.add("basemap", format!("must be at most {MAPS_MAX} files, not {}", file.basemap.len()), None);
    }
    if let Some(name) = file.basemap.iter().find(|name| name.is_empty() || name.len() > NAME_MAX) {
        let what = format!("{}: must be names of files, at most {NAME_MAX} bytes each", quoted(name));
        problems.add("basemap", what, None);
    }
    check_uavs(file, problems);
    let last = (file.uavs.count - 1.0).max(0.0);
    let uav_range = Allowed::at_least(0.0).at_most(last).with_reason("one of the UAVs, counted from 0");
    check_faults(&file.uavs, uav_range, problems);
    if let Some(radio) = &file.radio {
        check_radio(radio, uav_range, problems);
    }
    check_intruders(&file.intruders, uav_range, problems);
    match &file.targets {
        Some(targets) => check_targets(targets, problems),
        None if file.traffic.is_none() => problems.add("targets", NO_TARGETS, None),
        None => {}
    }
}

const NO_TARGETS: &str = "no targets; give [targets.random], [[targets.start]] or [traffic]";

fn check_uavs(file: &ScenarioFile, problems: &mut Problems) {
    let (uavs, count) = (&file.uavs, file.uavs.count);
    let allowed = if file.team.agents == AgentSetup::PerUav {
        Allowed::at_least(1.0).at_most(AGENTS_MAX).with_reason("the maximum of UAVs with an agent each")
    } else {
        Allowed::at_least(1.0).at_most(UAVS_MAX)
    };
    problems.check_whole("uavs.count", count, allowed);
    let listed = uavs.start.len() as f64;
    if listed > 0.0 {
        problems.check("uavs.count", count, Allowed::exactly(listed).with_reason("as many as [[uavs.start]]"));
        if uavs.start_ring.is_some() {
            problems.add("uavs.start_ring", "[uavs.start_ring] and [[uavs.start]] exclude each other; keep one", None);
        }
    }
    if uavs.dynamics == Dynamics::Kinematic && uavs.bank.is_some() {
        let what = "describes a banking aircraft; set uavs.dynamics = \"bank\", or leave out the table";
        problems.add("uavs.bank", what, None);
    }
}

/// Returns the tables of an array with their keys; reports too many of them.
fn listed<'a, T>(key: &str, tables: &'a [T], problems: &mut Problems) -> Vec<(String, &'a T)> {
    problems.check_many(key, tables.len(), LISTED_MAX);
    let with_key = |(index, table): (usize, &'a T)| (format!("{key}.{index}"), table);
    tables.iter().take(LISTED_MAX).enumerate().map(with_key).collect()
}

/// Checks outages, restarts and clocks; `uav_range` are the valid UAVs.
fn check_faults(uavs: &Uavs, uav_range: Allowed, problems: &mut Problems) {
    for (table, outage) in listed("uavs.outage", &uavs.outage, problems) {
        problems.check_whole(&format!("{table}.uav"), outage.uav, uav_range);
        problems.check_until(&table, outage.from_s, outage.until_s);
    }
    for (table, restart) in listed("uavs.restart", &uavs.restart, problems) {
        problems.check_whole(&format!("{table}.uav"), restart.uav, uav_range);
    }
    for (index, (table, clock)) in listed("uavs.clock", &uavs.clock, problems).into_iter().enumerate() {
        let key = format!("{table}.uav");
        problems.check_whole(&key, clock.uav, uav_range);
        if uavs.clock[..index].iter().any(|other| is_same(other.uav, clock.uav)) {
            problems.add(key, "already has a clock; at most one per UAV", Some(clock.uav.into()));
        }
    }
}

fn check_targets(targets: &Targets, problems: &mut Problems) {
    let at = targets.start.len();
    if targets.random.is_none() && at == 0 {
        problems.add("targets", NO_TARGETS, None);
    }
    problems.check_many("targets.start", at, MAX_AT_ONCE);
    let random = targets.random.as_ref().map_or(0.0, |random| random.count);
    let last = (at as f64 + random - 1.0).max(0.0);
    let target_range = Allowed::at_least(0.0).at_most(last).with_reason("one of the targets, counted from 0");
    for (table, manoeuvre) in listed("targets.manoeuvre", &targets.manoeuvre, problems) {
        problems.check_whole(&format!("{table}.target"), manoeuvre.target, target_range);
        problems.check_until(&table, manoeuvre.from_s, manoeuvre.until_s);
    }
    if targets.random.is_some() {
        let most = MAX_AT_ONCE.saturating_sub(at).max(1) as f64;
        let count =
            Allowed::at_least(1.0).at_most(most).with_reason("the maximum of targets, less those of [[targets.start]]");
        problems.check_whole("targets.random.count", random, count);
    }
}

/// Checks the intruders; `uav_range` are the valid UAVs.
fn check_intruders(intruders: &[Intruder], uav_range: Allowed, problems: &mut Problems) {
    if intruders.len() > INTRUDERS_MAX {
        problems.add("intruders", format!("must be at most {INTRUDERS_MAX}, not {}", intruders.len()), None);
    }
    for (index, intruder) in intruders.iter().take(INTRUDERS_MAX).enumerate() {
        let table = format!("intruders.{index}");
        if let Some(uav) = intruder.pursued_uav {
            problems.check_whole(&format!("{table}.pursued_uav"), uav, uav_range);
            if intruder.turn_rate_deg_s.is_some() {
                let what = "an intruder with a `pursued_uav` turns towards that UAV; keep one";
                problems.add(format!("{table}.turn_rate_deg_s"), what, None);
            }
        }
        check_start(&table, intruder, problems);
        for (silence_table, silence) in listed(&format!("{table}.transponder_off"), &intruder.transponder_off, problems)
        {
            problems.check_until(&silence_table, silence.from_s, silence.until_s);
        }
    }
}

/// Checks that an intruder has one start.
fn check_start(table: &str, intruder: &Intruder, problems: &mut Problems) {
    let Intruder { pursued_uav, x_m, y_m, distance_m, bearing_deg, .. } = intruder;
    let (from_uav, in_plane) = (distance_m.or(*bearing_deg), x_m.or(*y_m));
    let half = match (x_m, y_m) {
        (Some(_), None) => Some(("x_m", "y_m")),
        (None, Some(_)) => Some(("y_m", "x_m")),
        _ => None,
    };
    if in_plane.is_some() && from_uav.is_some() {
        problems.add(table, "has both `x_m`, `y_m` and a start relative to a UAV; keep one", None);
    } else if let Some((given, missing)) = half {
        problems.add(format!("{table}.{given}"), format!("incomplete start; give `{missing}` as well"), None);
    } else if in_plane.or(from_uav).or(*pursued_uav).is_none() {
        problems.add(table, "has no start; give `x_m` and `y_m`, or `pursued_uav`", None);
    } else if from_uav.is_some() && pursued_uav.is_none() {
        let what = "`distance_m` and `bearing_deg` are relative to the pursued UAV; give `pursued_uav`";
        problems.add(table, what, None);
    }
}

/// Checks links and partitions; `uav_range` are the valid UAVs.
fn check_radio(radio: &Radio, uav_range: Allowed, problems: &mut Problems) {
    for (index, (table, link)) in listed("radio.link", &radio.link, problems).into_iter().enumerate() {
        problems.check_whole(&format!("{table}.from"), link.from, uav_range);
        problems.check_whole(&format!("{table}.to"), link.to, uav_range);
        if is_same(link.from, link.to) {
            problems.add(format!("{table}.to"), "must be another UAV than `from`", Some(link.to.into()));
        }
        let is_same_link = |other: &Link| is_same(other.from, link.from) && is_same(other.to, link.to);
        if radio.link[..index].iter().any(is_same_link) {
            problems.add(table, "is the second link between the same two UAVs; keep one", None);
        }
    }
    for (table, partition) in listed("radio.partition", &radio.partition, problems) {
        problems.check_until(&table, partition.from_s, partition.until_s);
        if partition.sides.is_empty() {
            problems.add(format!("{table}.sides"), "must be lists of UAVs, like [[0, 1], [2, 3]]", None);
        }
        let mut sided: Vec<f64> = Vec::new();
        for (side, uavs) in partition.sides.iter().enumerate() {
            for (place, uav) in uavs.iter().enumerate() {
                let key = format!("{table}.sides.{side}.{place}");
                problems.check_whole(&key, *uav, uav_range);
                if sided.iter().any(|other| is_same(*other, *uav)) {
                    problems.add(key, "is listed already; a UAV is on one side, and once", Some((*uav).into()));
                } else if uav_range.contains(*uav) {
                    sided.push(*uav);
                }
            }
        }
    }
}

/// Returns whether two numbers are the same UAV. Numbers that are not whole are reported elsewhere.
fn is_same(one: f64, other: f64) -> bool {
    (one - other).abs() < 0.5
}

/// Keys whose ranges depend on each other: if only one of them was typed, the error points to that one.
const PARTNERS: &[(&str, &str)] = &[
    ("orbit.field_of_view_margin_deg", "sensor.field_of_view_deg"),
    ("orbit.radius_max_m", "orbit.radius_min_m"),
    ("groups.dwell_max_s", "groups.dwell_min_s"),
    ("uavs.speed_change_max_m_s", "uavs.speed_m_s"),
    ("uavs.speed_lag_s", "uavs.integrator"),
    ("uavs.turn_rate_lag_s", "uavs.integrator"),
    ("sensor.sensing_range_m", "orbit.radius_min_m"),
    ("cue.position_sd_m", "filter.deletion_position_sd_m"),
    ("filter.range_sd_m", "sensor.range_sd_m"),
    ("filter.bearing_sd_deg", "sensor.bearing_sd_deg"),
    ("filter.detection_probability", "sensor.detection_probability"),
    ("filter.mdv_m_s", "sensor.mdv_m_s"),
    ("filter.range_rate_sd_m_s", "sensor.range_rate_sd_m_s"),
    ("filter.false_alarms_per_scan", "sensor.false_alarms_per_scan"),
    ("filter.own_position_sd_m", "navigation.position_sd_m"),
    ("filter.own_position_correlation_s", "navigation.correlation_s"),
    ("filter.own_heading_sd_deg", "navigation.heading_bias_deg"),
    ("filter.correlation_rate_1_s", "targets.correlation_rate_1_s"),
    ("filter.acceleration_sd_m_s2", "targets.acceleration_sd_m_s2"),
    ("duration_s", "period_s"),
    ("targets", "traffic"),
    ("wind.orbit_wind_m_s", "wind.speed_m_s"),
    ("wind.orbit_wind_m_s", "wind.reference_height_m"),
    ("wind.orbit_wind_m_s", "wind.shear_exponent"),
    ("wind.believed_speed_m_s", "wind.speed_m_s"),
    ("wind.believed_speed_m_s", "wind.reference_height_m"),
    ("wind.believed_speed_m_s", "wind.shear_exponent"),
    ("wind.believed_from_deg", "wind.from_deg"),
];

/// Returns all problems found, and those in the form of the scenario, as an error with the values that were typed or
/// drawn for the seed.
pub(super) fn report(problems: Problems, typed: &Typed, seed: u64) -> Result<(), ScenarioError> {
    let found = problems.found;
    let mut problems = typed.problems.clone();
    if found.is_empty() && problems.is_empty() {
        return Ok(());
    }
    let map = Map::new(&typed.origin.text);
    let is_typed = |key: &str| typed.origin.is_typed(&map, key);
    let is_left_out = |key: &str| typed.left_out.iter().any(|out| related(out, key));
    let keys: Vec<String> = found.iter().map(|found| found.key.clone()).collect();
    for (index, Found { key, what, number }) in found.into_iter().enumerate() {
        if problems.len() >= MISTAKES_MAX {
            break;
        }
        let partners = || PARTNERS.iter().filter(|(bounded, _)| *bounded == key).map(|(_, by)| *by);
        // A consequence of a part that was left out is not a separate mistake.
        if is_left_out(&key) || partners().any(is_left_out) || typed.is_text_broken && !is_typed(&key) {
            continue;
        }
        let mut partners = partners().filter(|by| !is_typed(&key) && is_typed(by));
        let partner = partners.clone().next();
        // Nor is a default that depends on another wrong value, nor a key that has been reported.
        if partners.any(|by| keys.iter().any(|key| key == by)) || keys[..index].contains(&key) {
            continue;
        }
        let is_drawn = typed.is_drawn(&key) && matches!(number, Some(Number::Constant(_)));
        let value = number.and_then(|number| toml::Value::try_from(number).ok());
        let value = value.as_ref().or_else(|| value_at(&typed.table, &key));
        let message = format!("{}: {what}", with_value(&key, value));
        let help = is_drawn.then(|| format!("this value was drawn for seed {seed}: narrow the distribution"));
        let problem = typed.origin.problem(&map, partner.unwrap_or(&key), message, help);
        // If a line cannot be parsed, that is the only mistake in it.
        let line = |problem: &Problem| problem.place.map(|place| place.line);
        if !(typed.is_text_broken && typed.problems.iter().any(|reported| line(reported) == line(&problem))) {
            problems.push(problem);
        }
    }
    problems.sort_by_key(|problem| problem.place.map_or((usize::MAX, 0), |place| (place.line, place.column)));
    Err(problems.into())
}
