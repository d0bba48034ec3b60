//! Events of a run: counts per kind, and a list of the worst.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use standoff_io::display_text::{self, wrapped};
use standoff_record::{EventQuota, EventRow, target_name};

/// Maximum number of events in the table; the files contain the others.
const SHOWN: usize = 12;
/// Maximum number of event kinds that are counted separately; about twenty exist.
const KINDS: usize = 50;
/// Routine events, which the table does not list: first cue or measurement of a target, and ends of problems.
const ROUTINE: [&str; 5] = ["cued", "acquired", "orbit-feasible", "orbit-unblocked", "proximity-cleared"];
/// Events that degrade the tracking, and the events that end each.
const BAD: [(&str, &[&str]); 7] = [
    ("lost", &["reacquired"]),
    ("removed", &["readmitted", "admitted", "lost"]),
    ("orbit-infeasible", &["orbit-feasible", "group-retired"]),
    ("orbit-partly-blocked", &["orbit-blocked", "orbit-unblocked", "group-retired"]),
    ("orbit-blocked", &["orbit-partly-blocked", "orbit-unblocked", "group-retired"]),
    ("proximity-alert", &["proximity-cleared", "group-retired"]),
    ("uav-timeout", &["uav-joined"]),
];

/// The events of a run: a limited number in full, and counts of all.
#[derive(Default, Serialize)]
pub(crate) struct Events {
    events: Vec<Event>,
    #[serde(rename = "events_left_out", skip_serializing_if = "shows_all", serialize_with = "left_out")]
    allowance: EventQuota,
    #[serde(skip)]
    counts: BTreeMap<String, usize>,
}

fn shows_all(allowance: &EventQuota) -> bool {
    allowance.left_out() == 0
}

fn left_out<S: Serializer>(allowance: &EventQuota, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(allowance.left_out())
}

/// An event.
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

impl Events {
    /// Adds an event; `names` are the names of the run's targets.
    pub(crate) fn add(&mut self, time_us: i64, row: &EventRow, names: &[String]) {
        let is_known = self.counts.contains_key(&row.kind);
        let kind = if is_known || self.counts.len() < KINDS { row.kind.as_str() } else { "of other kinds" };
        match self.counts.get_mut(kind) {
            Some(count) => *count += 1,
            None => drop(self.counts.insert(kind.to_owned(), 1)),
        }
        let target = row.target_or_track().map(|target| target_name(target, names));
        if self.allowance.takes(row, target.as_deref()) {
            let EventRow { kind, group, to_group, uavs, .. } = row.clone();
            let reason = row.reason_text();
            self.events.push(Event { time_s: time_us as f64 / 1e6, kind, target, group, to_group, uavs, reason });
        }
    }

    /// Returns the number of events of a kind.
    pub(crate) fn count(&self, kind: &str) -> usize {
        self.counts.get(kind).copied().unwrap_or(0)
    }

    /// Returns the number of events that were counted but not kept.
    pub(crate) fn left_out(&self) -> u64 {
        self.allowance.left_out()
    }

    /// Formats the events in the order of their cost to the mission, and the number of events of each kind. Events that
    /// degrade the tracking come first, the longest before the others: they last until the event that ends them, or
    /// until their target (times by name in `ends_s`) or the run (`end_s`) ends. The other events follow in order of
    /// time.
    pub(super) fn text(&self, end_s: f64, ends_s: &BTreeMap<&str, f64>, width: usize) -> String {
        let counts: Vec<String> =
            self.counts.iter().map(|(kind, n)| format!("{n} {}", display_text::printable(kind))).collect();
        let all = if counts.is_empty() { "none".to_owned() } else { counts.join(", ") };
        let lasting_s = self.lasting_s(end_s, ends_s);
        let mut shown: Vec<usize> =
            (0..self.events.len()).filter(|&index| !ROUTINE.contains(&self.events[index].kind.as_str())).collect();
        let left = shown.len().saturating_sub(SHOWN);
        let cost_s = |index: &usize| lasting_s[*index].unwrap_or(f64::NEG_INFINITY);
        shown.sort_by(|a, b| cost_s(b).total_cmp(&cost_s(a)).then(a.cmp(b)));
        shown.truncate(SHOWN);
        let heading = if shown.is_empty() { "Events" } else { "Events, the longest-lasting problems first" };
        let mut text = format!("\n{heading}\n");
        for index in shown {
            let event = &self.events[index];
            let [kind, objects, reason] =
                [&event.kind, &event.subject(), &event.reason].map(|part| display_text::printable(part));
            let lasting = lasting_s[index].map_or_else(String::new, |s| format!(" (lasts {s:.1} s)"));
            let first = format!("{:8.1} s  {kind:21}", event.time_s);
            let colon = if objects.is_empty() { "" } else { ": " };
            text += &wrapped(&first, &format!("{objects}{colon}{reason}{lasting}"), width);
        }
        if left > 0 {
            text += &format!("  and {left} more in summary.json\n");
        }
        if self.left_out() > 0 {
            text += &format!("  and {} later events of all kinds in events.parquet\n", self.left_out());
        }
        text + &wrapped("  all: ", &all, width)
    }

    /// Returns the duration of each bad event, s; `None` for other events.
    fn lasting_s(&self, end_s: f64, ends_s: &BTreeMap<&str, f64>) -> Vec<Option<f64>> {
        let mut over_s = BTreeMap::new();
        let lasting_s = self.events.iter().rev().map(|event| {
            let objects = (event.target.as_deref(), event.group, event.uavs.first());
            for (kind, _) in BAD.iter().filter(|(_, ends)| ends.contains(&event.kind.as_str())) {
                over_s.insert((*kind, subject(kind, objects)), event.time_s);
            }
            let (kind, _) = BAD.iter().find(|(kind, _)| *kind == event.kind)?;
            let gone_s = event.target.as_deref().and_then(|target| ends_s.get(target)).copied().unwrap_or(end_s);
            let until_s = over_s.get(&(*kind, subject(kind, objects))).copied().unwrap_or(end_s).min(gone_s);
            Some((until_s - event.time_s).max(0.0))
        });
        let mut lasting_s: Vec<_> = lasting_s.collect();
        lasting_s.reverse();
        lasting_s
    }
}

/// Returns the object that an event of this kind concerns: its target, its group or its UAV.
fn subject<'a>(
    kind: &str,
    (target, group, uav): (Option<&'a str>, Option<u32>, Option<&u32>),
) -> (Option<&'a str>, Option<u32>) {
    match kind {
        "lost" | "removed" => (target, None),
        "uav-timeout" => (None, uav.copied()),
        _ => (None, group),
    }
}

impl Event {
    /// Formats the target or UAV of the event, and its groups.
    fn subject(&self) -> String {
        let groups = match (self.group, self.to_group) {
            (Some(from), Some(to)) => format!("group {from} to {to}"),
            (Some(group), None) => format!("group {group}"),
            (None, Some(to)) => format!("to group {to}"),
            (None, None) => String::new(),
        };
        let target = self.target.as_deref().map(named);
        let concerns_uav =
            ["reassigned", "search-started", "search-ended", "uav-timeout", "uav-joined"].contains(&self.kind.as_str());
        let uav = self.uavs.first().filter(|_| concerns_uav).map(|uav| format!("UAV {uav}"));
        let objects = [target.unwrap_or_default(), uav.unwrap_or_default(), groups];
        objects.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// Formats the name of a target; a name that is empty or could be read as a number is quoted after the word "target".
pub(super) fn named(name: &str) -> String {
    if name.starts_with(char::is_alphabetic) { name.to_owned() } else { format!("target \"{name}\"") }
}

#[cfg(test)]
mod tests {
    use standoff_io::display_text::WIDTH;
    use standoff_record::NO_TARGET;

    use super::*;

    fn event(kind: &str, target: Option<u32>, group: Option<u32>) -> EventRow {
        EventRow { kind: kind.into(), target, group, uavs: vec![0], reason: "so".into(), ..EventRow::default() }
    }

    /// The long loss after twenty short ones is listed.
    #[test]
    fn the_table_lists_the_longest_bad_events_not_the_first() {
        let names: Vec<String> = (0..30).map(|number| format!("car-{number}")).collect();
        let mut events = Events::default();
        for n in 0..20 {
            events.add(i64::from(n) * 1_000_000, &event("lost", Some(n), None), &names);
            events.add(i64::from(n) * 1_000_000 + 500_000, &event("reacquired", Some(n), None), &names);
        }
        events.add(30_000_000, &event("orbit-infeasible", None, Some(3)), &names);
        events.add(70_000_000, &event("orbit-feasible", None, Some(3)), &names);
        events.add(80_000_000, &event("lost", Some(25), None), &names);
        let text = events.text(100.0, &BTreeMap::new(), WIDTH);
        assert!(text.contains("30.0 s  orbit-infeasible     group 3: so (lasts 40.0 s)"), "{text}");
        assert!(text.contains("80.0 s  lost                 car-25: so (lasts 20.0 s)"), "{text}");
        assert!(text.find("group 3").unwrap() < text.find("car-25").unwrap(), "{text}");
        assert!(text.contains("and 30 more in summary.json"), "{text}");
        // Admission to another group ends the removal.
        events.add(85_000_000, &event("removed", Some(26), Some(3)), &names);
        events.add(86_000_000, &event("admitted", Some(26), Some(4)), &names);
        let text = events.text(100.0, &BTreeMap::new(), WIDTH);
        assert!(text.contains("car-26, group 3: so (lasts 1.0 s)"), "{text}");
        // A loss ends when the vehicle leaves the traffic.
        let text = events.text(100.0, &BTreeMap::from([("car-25", 81.0)]), WIDTH);
        assert!(text.contains("car-25: so (lasts 1.0 s)"), "{text}");
    }

    /// The column `reason` is only for readers that do not interpret the other columns.
    #[test]
    fn the_reason_is_derived_from_the_columns() {
        let mut events = Events::default();
        let dwell = EventRow { dwell_s: Some(12.34), ..event("handoff-started", Some(0), Some(1)) };
        events.add(0, &dwell, &["lead".to_owned()]);
        let text = events.text(1.0, &BTreeMap::new(), WIDTH);
        assert!(text.contains("lead, group 1: closer to the new group; in both for 12.3"), "{text}");
    }

    /// A track of no target, and an event whose target is not known any more.
    #[test]
    fn an_event_of_a_track_without_target_names_the_track() {
        let mut events = Events::default();
        events.add(0, &event("lost", Some(NO_TARGET + 4), Some(1)), &["lead".to_owned()]);
        events.add(0, &EventRow { track: Some(NO_TARGET + 5), ..event("lost", None, Some(1)) }, &["lead".to_owned()]);
        let handoff = EventRow { group: None, to_group: Some(2), ..event("handoff-started", Some(0), None) };
        events.add(0, &handoff, &["lead".to_owned()]);
        let text = events.text(1.0, &BTreeMap::new(), WIDTH);
        for line in ["track 4, group 1: so", "track 5, group 1: so", "lead, to group 2: so"] {
            assert!(text.contains(line), "{line}: {text}");
        }
    }

    #[test]
    fn a_name_that_looks_like_a_number_is_quoted() {
        let mut events = Events::default();
        events.add(0, &event("lost", Some(0), Some(1)), &["0".to_owned()]);
        let text = events.text(1.0, &BTreeMap::new(), WIDTH);
        assert!(text.contains("target \"0\", group 1: so"), "{text}");
    }
}
