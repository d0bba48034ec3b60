//! The outcome of a run: a table for people, a JSON object for programs.

use std::collections::BTreeMap;
use std::path::Path;

use clap::Args;
use serde::{Serialize, Serializer};
use standoff_sim::record::{EventAllowance, EventRow};
use standoff_sim::score::{Choice, Chosen};
use standoff_sim::text;
use standoff_view::replay::Line;

use crate::failure::{Failure, print};

/// Events that a table shows before it refers to the file.
const EVENTS_SHOWN: usize = 12;
/// Kinds of events that are counted one by one; there are some twenty.
const KINDS: usize = 50;

/// Which metrics are told.
#[derive(Args)]
pub(crate) struct Wanted {
    /// Metrics to work out, with commas between: names of docs/metrics.md, and the sets standard, limits (how close the
    /// estimates come to their bound; takes a little longer), table-2 and all.
    #[arg(id = "metrics", long = "metrics", value_name = "LIST", default_value = "standard", value_parser = Choice::parse)]
    pub(crate) choice: Choice,
}

/// The table: topic, what, metric, unit. Shares of 0 to 1 are shown in percent.
const ROWS: [(&str, &str, &str, &str); 19] = [
    ("in view", "group members seen by no UAV", "out_of_view_fraction", "% of the time"),
    ("in view", "the longest that one was", "out_of_view_longest_s", "s"),
    ("in view", "targets in no group", "uncovered_fraction", "% of the time"),
    ("line of sight", "furthest member off boresight, mean", "line_of_sight_deg", "deg"),
    ("line of sight", "and at worst", "line_of_sight_max_deg", "deg"),
    ("estimates", "position error", "position_error_m", "m"),
    ("estimates", "velocity error", "velocity_error_m_s", "m/s"),
    ("estimates", "consistency (1 is right)", "anees", ""),
    ("estimates", "of the innovations (1 is right)", "nis", ""),
    ("estimates", "position error over its bound", "position_bound_ratio", ""),
    ("estimates", "velocity error over its bound", "velocity_bound_ratio", ""),
    ("orbit", "standoff error, true geometry", "standoff_error_m", "m"),
    ("orbit", "once settled", "standoff_error_m_settled", "m"),
    ("orbit", "standoff error, the agents' own view", "standoff_tracking_error_m", "m"),
    ("orbit", "once settled", "standoff_tracking_error_m_settled", "m"),
    ("orbit", "phase error", "phase_error_deg", "deg"),
    ("orbit", "smallest separation", "separation_min_m", "m"),
    ("limits", "turn rate at its limit", "turn_rate_saturated_fraction", "% of the time"),
    ("limits", "no feasible orbit", "infeasible_fraction", "% of the time"),
];

/// What a run came to.
#[derive(Serialize)]
pub(crate) struct Outcome {
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) duration_s: f64,
    /// The instant at which an unfinished run breaks off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unfinished_after_s: Option<f64>,
    pub(crate) uavs: usize,
    pub(crate) targets: usize,
    pub(crate) metrics: Chosen,
    #[serde(flatten)]
    pub(crate) events: Events,
}

/// The events of a run: the first of them one by one, all in numbers.
#[derive(Default, Serialize)]
pub(crate) struct Events {
    events: Vec<Event>,
    #[serde(rename = "events_left_out", skip_serializing_if = "tells_all", serialize_with = "left_out")]
    allowance: EventAllowance,
    #[serde(skip)]
    counts: BTreeMap<String, usize>,
}

fn tells_all(allowance: &EventAllowance) -> bool {
    allowance.left_out() == 0
}

fn left_out<S: Serializer>(allowance: &EventAllowance, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(allowance.left_out())
}

/// Something that happened.
#[derive(Serialize)]
struct Event {
    time_s: f64,
    kind: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    group: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to_group: Option<u32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    uavs: Vec<u32>,
    reason: String,
}

/// The rows of the table that were chosen; shares in percent.
pub(crate) fn lines(metrics: &Chosen) -> Vec<Line> {
    let line = |(topic, what, metric, unit): (_, _, &'static str, _)| {
        let percent = if metric.ends_with("_fraction") { 100.0 } else { 1.0 };
        let value = metrics.get(metric)?.map(|value| percent * value);
        Some(Line { topic, what, metric, value, unit })
    };
    ROWS.into_iter().filter_map(line).collect()
}

impl Outcome {
    /// One JSON object and a newline.
    pub(crate) fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Prints it: for programs, or for people.
    pub(crate) fn print(&self, json: bool, out: &Path) -> Result<(), Failure> {
        print(&if json { self.json().map_err(Failure::running)? } else { text::lines(&self.table(out)) })
    }

    /// What a person wants to know first.
    fn table(&self, out: &Path) -> String {
        let Self { scenario, seed, duration_s, unfinished_after_s, uavs, targets, .. } = self;
        let end = unfinished_after_s.map_or_else(String::new, |end_s| format!(", unfinished after {end_s} s"));
        let mut told = format!(
            "{}, seed {seed}: {}, {}, {duration_s} s{end}\n\n",
            text::words(scenario),
            count(*uavs, "UAV"),
            count(*targets, "target")
        );
        let mut last = "";
        for Line { topic, what, value, unit, .. } in lines(&self.metrics) {
            let value = value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
            let heading = if topic == last { "" } else { topic };
            told += format!("{heading:14} {what:37} {value:>9} {unit}").trim_end();
            told += "\n";
            last = topic;
        }
        told += &self.events_told();
        told + &format!("\nresults in {}\n", out.display())
    }
}

impl Outcome {
    /// How many events of each kind, and the first of those that matter most: that a target is cued or first measured is
    /// routine, and that something is over tells little.
    fn events_told(&self) -> String {
        let Events { events, counts, .. } = &self.events;
        let counts: Vec<String> = counts.iter().map(|(kind, n)| format!("{n} {}", text::words(kind))).collect();
        let mut told =
            format!("\nevents         {}\n", if counts.is_empty() { "none".to_owned() } else { counts.join(", ") });
        let routine = ["cued", "acquired", "orbit-feasible", "uavs-apart"];
        let telling: Vec<&Event> = events.iter().filter(|event| !routine.contains(&event.kind.as_str())).collect();
        for event in telling.iter().take(EVENTS_SHOWN) {
            let [kind, who, reason] = [&event.kind, &event.who(), &event.reason].map(|part| text::words(part));
            told += &format!("{:8.1} s  {kind:17}  {who}: {reason}\n", event.time_s);
        }
        if telling.len() > EVENTS_SHOWN {
            told += &format!("  and {} more in summary.json\n", telling.len() - EVENTS_SHOWN);
        }
        let left_out = self.events.left_out();
        if left_out > 0 {
            told += &format!("  and {left_out} later events of any kind in events.parquet\n");
        }
        told
    }
}

impl Events {
    /// Takes in an event of a run whose targets have these names.
    pub(crate) fn add(&mut self, time_us: i64, row: &EventRow, names: &[String]) {
        let is_known = self.counts.contains_key(&row.kind);
        let kind = if is_known || self.counts.len() < KINDS { row.kind.as_str() } else { "of other kinds" };
        match self.counts.get_mut(kind) {
            Some(count) => *count += 1,
            None => drop(self.counts.insert(kind.to_owned(), 1)),
        }
        let name = row.target.and_then(|target| names.get(target as usize));
        if self.allowance.takes(row, name.map(String::as_str)) {
            let EventRow { kind, target: _, group, to_group, uavs, reason } = row.clone();
            let target = name.cloned();
            self.events.push(Event { time_s: time_us as f64 / 1e6, kind, target, group, to_group, uavs, reason });
        }
    }

    /// How many there are of a kind.
    pub(crate) fn count(&self, kind: &str) -> usize {
        self.counts.get(kind).copied().unwrap_or(0)
    }

    /// How many are not told one by one.
    pub(crate) fn left_out(&self) -> u64 {
        self.allowance.left_out()
    }
}

impl Event {
    /// The target or the UAV it happened to, and the groups.
    fn who(&self) -> String {
        let groups = match (self.group, self.to_group) {
            (Some(from), Some(to)) => format!("group {from} to {to}"),
            (Some(group), None) => format!("group {group}"),
            _ => String::new(),
        };
        let target = self.target.clone();
        let of_uav = ["reassigned", "uav-lost", "uav-joined"].contains(&self.kind.as_str());
        let uav = self.uavs.first().filter(|_| of_uav).map(|uav| format!("UAV {uav}"));
        let who = [target.or(uav).unwrap_or_default(), groups];
        who.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// `1 UAV`, `2 UAVs`.
pub(crate) fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
