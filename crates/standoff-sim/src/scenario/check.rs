//! What is allowed in a scenario, and how what is not is reported: where it was typed, in the unit it was typed in.

use standoff::{Agent, Allowed, ParamError, TeamParams};

use super::Settings;
use super::error::{Problem, ScenarioError};
use super::file::ScenarioFile;
use super::form::{MISTAKES_MAX, value_at, with_value};
use super::load::{Typed, related};
use super::locate::Map;
use super::number::{Number, of, value};
use super::team::KEYS;
use crate::traffic;

/// Longer missions than this are refused: a record of them would fill the disk.
const TICKS_MAX: f64 = 10_000_000.0;

/// Most targets of a scenario that come from no traffic file.
pub(super) const TARGETS_MAX: usize = traffic::MAX_AT_ONCE;

/// Most outages, and most manoeuvres.
const LISTED_MAX: usize = 1_000;

/// Longest line that says what a scenario shows, characters.
const ABOUT_MAX: usize = 1_000;

/// Checks how the mission is flown: the simulator's own ranges here, the rest in the library.
pub(super) fn check_settings(file: &ScenarioFile, team: &TeamParams, problems: &mut Problems) {
    let period_s = of(&file.period_s);
    problems.check("period_s", period_s, Allowed::at_least(0.01).at_most(Agent::GAP_MAX.s()));
    let longest_s = period_s.max(0.01) * TICKS_MAX;
    let duration = Allowed::at_least(period_s).at_most(longest_s).because("one period_s to ten million of them");
    problems.check("duration_s", of(&file.duration_s), duration);
    problems.check("settle_s", of(&file.settle_s), Allowed::at_least(0.0).at_most(1e9));
    let (sensor, cue) = (&file.sensor, &file.cue);
    problems.check("sensor.range_sd_m", value(&sensor.range_sd_m), Allowed::at_least(0.0).at_most(1e5));
    problems.check("sensor.bearing_sd_deg", value(&sensor.bearing_sd_deg), Allowed::at_least(0.0).at_most(180.0));
    let findable = Allowed::at_least(1e-3)
        .below(value(&file.filter.lost_position_sd_m))
        .because("a less certain track is lost: below filter.lost_position_sd_m");
    problems.check("cue.position_sd_m", value(&cue.position_sd_m), findable);
    problems.check("cue.velocity_sd_m_s", value(&cue.velocity_sd_m_s), Allowed::at_least(1e-3).at_most(1e3));
    for error in team.errors() {
        problems.add_param(&error.path, &error);
    }
}

/// Checks what the UAVs are carried on with over a period. A record stays readable whatever it was flown with.
pub(super) fn check_step(settings: &Settings, problems: &mut Problems) {
    for error in settings.team.uav.errors_over(settings.period) {
        problems.add_param(&format!("uav.{}", error.path), &error);
    }
}

/// Checks what is shown of the scenario.
pub(super) fn check_about(file: &ScenarioFile, problems: &mut Problems) {
    if file.about.chars().any(char::is_control) || file.about.chars().count() > ABOUT_MAX {
        problems.add("about".to_owned(), format!("must be one line of at most {ABOUT_MAX} characters"));
    }
}

/// Checks who takes part, and where they start: before targets are drawn, so that every error is where it was typed.
pub(super) fn check_who(file: &mut ScenarioFile, problems: &mut Problems) {
    let count = of(&file.uavs.count);
    problems.check_whole("uavs.count", count, Allowed::at_least(1.0).at_most(100.0));
    let listed = file.uavs.at.len() as f64;
    if listed > 0.0 {
        let as_listed = Allowed::at_least(listed).at_most(listed).because("as many as [[uavs.at]]");
        problems.check("uavs.count", count, as_listed);
        if file.uavs.ring.is_some() {
            problems.add("uavs.ring".to_owned(), "[uavs.ring] and [[uavs.at]] exclude each other; keep one".to_owned());
        }
    }
    if let Some(ring) = &file.uavs.ring {
        let angle = Allowed::at_least(-1e6).at_most(1e6);
        let keys = [
            ("radius_m", &ring.radius_m, Allowed::above(0.0).at_most(1e6)),
            ("phase_deg", &ring.phase_deg, angle),
            ("spacing_deg", &ring.spacing_deg, angle),
        ];
        for (key, number, allowed) in keys {
            if let Some(number) = number {
                problems.check(&format!("uavs.ring.{key}"), value(number), allowed);
            }
        }
    }
    for (index, at) in file.uavs.at.iter_mut().enumerate() {
        problems.check_start(&format!("uavs.at.{index}"), at.numbers());
    }
    let whom = Allowed::at_least(0.0).at_most((count - 1.0).max(0.0)).because("one of the UAVs, counted from 0");
    problems.check_many("uavs.outage", file.uavs.outage.len(), LISTED_MAX);
    for (index, outage) in file.uavs.outage.iter().enumerate() {
        let table = format!("uavs.outage.{index}");
        problems.check_whole(&format!("{table}.uav"), value(&outage.uav), whom);
        problems.check_span(&table, value(&outage.from_s), value(&outage.until_s));
    }
    let has_targets = file.targets.as_ref().is_some_and(|targets| targets.scatter.is_some() || !targets.at.is_empty());
    if file.traffic.is_none() && !has_targets {
        problems
            .add("targets".to_owned(), "no targets; give [targets.scatter], [[targets.at]] or [traffic]".to_owned());
    }
    let Some(targets) = &mut file.targets else { return };
    let rate = Allowed::at_least(0.0).at_most(100.0);
    problems.check("targets.correlation_rate_1_s", value(&targets.correlation_rate_1_s), rate);
    problems.check("targets.acceleration_sd_m_s2", value(&targets.acceleration_sd_m_s2), rate);
    for (index, at) in targets.at.iter_mut().enumerate() {
        problems.check_start(&format!("targets.at.{index}"), at.numbers());
    }
    let scattered = targets.scatter.as_ref().map_or(0.0, |scatter| value(&scatter.count));
    problems.check_many("targets.at", targets.at.len(), TARGETS_MAX);
    problems.check_many("targets.manoeuvre", targets.manoeuvre.len(), LISTED_MAX);
    let whom = Allowed::at_least(1.0).at_most(targets.at.len() as f64 + scattered).because("one of the targets");
    for (index, manoeuvre) in targets.manoeuvre.iter_mut().enumerate() {
        let table = format!("targets.manoeuvre.{index}");
        problems.check_whole(&format!("{table}.target"), value(&manoeuvre.target), whom);
        problems.check_span(&table, value(&manoeuvre.from_s), value(&manoeuvre.until_s));
        problems.check_start(&table, manoeuvre.numbers());
    }
    if let Some(scatter) = &mut targets.scatter {
        let most = TARGETS_MAX as f64 - targets.at.len() as f64;
        let count = Allowed::at_least(1.0).at_most(most.max(1.0)).because("5,000 targets in all");
        problems.check_whole("targets.scatter.count", value(&scatter.count), count);
        problems.check_start("targets.scatter", scatter.numbers());
    }
}

/// Keys that bound each other: where only one was typed, that is the one to point at.
const PARTNERS: &[(&str, &str)] = &[
    ("orbit.field_of_view_margin_deg", "sensor.field_of_view_deg"),
    ("orbit.radius_max_m", "orbit.radius_min_m"),
    ("groups.dwell_max_s", "groups.dwell_min_s"),
    ("uavs.speed_change_max_m_s", "uavs.speed_m_s"),
    ("uavs.speed_lag_s", "uavs.integrator"),
    ("uavs.turn_rate_lag_s", "uavs.integrator"),
    ("sensor.sensing_range_m", "orbit.radius_min_m"),
    ("cue.position_sd_m", "filter.lost_position_sd_m"),
    ("filter.range_sd_m", "sensor.range_sd_m"),
    ("filter.bearing_sd_deg", "sensor.bearing_sd_deg"),
    ("filter.correlation_rate_1_s", "targets.correlation_rate_1_s"),
    ("filter.acceleration_sd_m_s2", "targets.acceleration_sd_m_s2"),
    ("duration_s", "period_s"),
];

/// So many are looked at; where there are more, most follow from others.
const FOUND_MAX: usize = 200;

/// Problems found so far.
#[derive(Default)]
pub(super) struct Problems {
    found: Vec<Found>,
}

struct Found {
    key: String,
    what: String,
    /// The key's value, where the scenario does not tell it any more.
    value: Option<toml::Value>,
}

impl Problems {
    pub(super) fn add(&mut self, key: String, what: String) {
        self.push(Found { key, what, value: None });
    }

    /// Something wrong with a number itself. A sound one takes its place, so that everything else can be checked.
    pub(super) fn replace(&mut self, key: String, what: String, number: &mut Number) {
        let value = toml::Value::try_from(std::mem::replace(number, Number::Constant(1.0))).ok();
        self.push(Found { key, what, value });
    }

    fn push(&mut self, found: Found) {
        if self.found.len() < FOUND_MAX {
            self.found.push(found);
        }
    }

    fn check(&mut self, key: &str, number: f64, allowed: Allowed) {
        if !allowed.contains(number) {
            self.add(key.to_owned(), format!("must be {allowed}"));
        }
    }

    /// Where and how fast something starts: positions, velocities, accelerations and headings by their endings.
    fn check_start(&mut self, table: &str, numbers: Vec<(&'static str, &mut Number)>) {
        for (key, number) in numbers {
            let allowed = match key {
                "speed_m_s" => Allowed::above(0.0).at_most(1e3),
                _ if key.ends_with("_m_s2") => Allowed::at_least(-100.0).at_most(100.0),
                _ if key.ends_with("_m_s") => Allowed::at_least(-1e3).at_most(1e3),
                _ if key.ends_with("_deg") => Allowed::at_least(-1e6).at_most(1e6),
                _ if key.ends_with("_m") => Allowed::at_least(-1e7).at_most(1e7),
                _ => continue,
            };
            if let Some(outside) = number.extremes().into_iter().find(|extreme| !allowed.contains(*extreme)) {
                let drawn =
                    if matches!(number, Number::Constant(_)) { String::new() } else { format!("up to {outside}: ") };
                self.add(format!("{table}.{key}"), format!("{drawn}must be {allowed}"));
            }
        }
    }

    /// How many tables an array has.
    fn check_many(&mut self, key: &str, tables: usize, most: usize) {
        if tables > most {
            self.add(
                key.to_owned(),
                format!("must be at most {most}, not {tables}; many targets belong in a traffic file"),
            );
        }
    }

    /// From when until when.
    fn check_span(&mut self, table: &str, from_s: f64, until_s: f64) {
        self.check(&format!("{table}.from_s"), from_s, Allowed::at_least(0.0).at_most(1e9));
        let later = Allowed::at_least(from_s).at_most(1e9).because("not before from_s");
        self.check(&format!("{table}.until_s"), until_s, later);
    }

    /// A number that counts things.
    fn check_whole(&mut self, key: &str, number: f64, allowed: Allowed) {
        if allowed.contains(number) && number.fract().abs() > 0.0 {
            self.add(key.to_owned(), "must be a whole number".to_owned());
        }
        self.check(key, number, allowed);
    }

    /// A library parameter out of range, in the unit in which it was typed.
    fn add_param(&mut self, path: &str, error: &ParamError) {
        let (key, in_degrees) =
            KEYS.iter().find(|(known, ..)| *known == path).map_or((path, false), |(_, key, degrees)| (*key, *degrees));
        let allowed = if in_degrees { error.allowed.map(f64::to_degrees) } else { error.allowed };
        self.add(key.to_owned(), format!("must be {allowed}"));
    }

    /// All of them and those of the form, if there are any, with the values of `file`: those typed, or drawn from them
    /// for the seed.
    pub(super) fn report(self, typed: &Typed, file: &ScenarioFile, seed: u64) -> Result<(), ScenarioError> {
        let mut problems = typed.problems.clone();
        if self.found.is_empty() && problems.is_empty() {
            return Ok(());
        }
        let map = Map::new(&typed.origin.text);
        let is_typed = |key: &str| typed.origin.is_typed(&map, key);
        let is_left_out = |key: &str| typed.left_out.iter().any(|out| related(out, key));
        let values = toml::Table::try_from(file).unwrap_or_default();
        let as_typed = toml::Table::try_from(&typed.file).unwrap_or_default();
        let keys: Vec<String> = self.found.iter().map(|found| found.key.clone()).collect();
        for (index, Found { key, what, value: replaced }) in self.found.into_iter().enumerate() {
            if problems.len() >= MISTAKES_MAX {
                break;
            }
            let partner = PARTNERS.iter().find(|(bounded, _)| *bounded == key).map(|(_, by)| *by);
            // What follows from something that was left out is not a mistake of its own.
            if is_left_out(&key) || partner.is_some_and(is_left_out) || typed.is_text_broken && !is_typed(&key) {
                continue;
            }
            let partner = partner.filter(|by| !is_typed(&key) && is_typed(by));
            // Nor is a default that follows another value, nor what has been told.
            if partner.is_some_and(|by| keys.iter().any(|key| key == by)) || keys[..index].contains(&key) {
                continue;
            }
            let is_typed_as_table = value_at(&as_typed, &key).is_some_and(toml::Value::is_table);
            let value = replaced.as_ref().or_else(|| value_at(&values, &key));
            let is_drawn = is_typed_as_table && value.is_some_and(|value| !value.is_table());
            let message = format!("{}: {what}", with_value(&key, value));
            let help = is_drawn.then(|| format!("this is what was drawn for seed {seed}: narrow the distribution"));
            let problem = typed.origin.problem(&map, partner.unwrap_or(&key), message, help);
            // Where the text cannot be read, that is the mistake.
            let line = |problem: &Problem| problem.place.map(|place| place.line);
            if !(typed.is_text_broken && typed.problems.iter().any(|told| line(told) == line(&problem))) {
                problems.push(problem);
            }
        }
        problems.sort_by_key(|problem| problem.place.map_or((usize::MAX, 0), |place| (place.line, place.column)));
        Err(problems.into())
    }
}
