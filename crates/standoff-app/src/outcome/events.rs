//! Events of a run: counts per kind, and a list of the worst.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use standoff_io::display_text::{self, wrapped};
use standoff_record::{EventQuota, EventRow, target_name};

/// Maximum number of events in the table; the files contain the others.
const SHOWN: usize = 8;
/// Maximum number of event kinds that are counted separately; about twenty exist.
const KINDS: usize = 50;
/// Routine events, which the table does not list.
const ROUTINE: [&str; 7] =
    ["cued", "acquired", "admitted", "group-created", "orbit-feasible", "orbit-unblocked", "proximity-cleared"];
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

    /// Formats the first events that are neither routine nor alarms of these kinds, and the number of events of each
    /// kind.
    pub(super) fn text(&self, alarms: &[&str], width: usize) -> String {
        let counts: Vec<String> =
            self.counts.iter().map(|(kind, n)| format!("{n} {}", display_text::printable(kind))).collect();
        let all = if counts.is_empty() { "none".to_owned() } else { counts.join(", ") };
        let is_shown = |event: &&Event| !ROUTINE.contains(&&*event.kind) && !alarms.contains(&&*event.kind);
        let shown: Vec<&Event> = self.events.iter().filter(is_shown).collect();
        let mut text = "\nEvents\n".to_owned();
        for event in shown.iter().take(SHOWN) {
            let [kind, objects, reason] =
                [&event.kind, &event.subject(), &event.reason].map(|part| display_text::printable(part));
            let first = format!("{:8.1} s  {kind:21}", event.time_s);
            let colon = if objects.is_empty() { "" } else { ": " };
            text += &wrapped(&first, &format!("{objects}{colon}{reason}"), width);
        }
        if shown.len() > SHOWN {
            text += &format!("  and {} more in summary.json\n", shown.len() - SHOWN);
        }
        if self.left_out() > 0 {
            text += &format!("  and {} later events of all kinds in events.parquet\n", self.left_out());
        }
        text + &wrapped("  all: ", &all, width)
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

    #[test]
    fn the_text_names_the_first_events_without_alarms() {
        let names: Vec<String> = (0..30).map(|number| format!("car-{number}")).collect();
        let mut events = Events::default();
        for n in 0..20 {
            events.add(i64::from(n) * 1_000_000, &event("lost", Some(n), None), &names);
            events.add(i64::from(n) * 1_000_000 + 500_000, &event("readmitted", Some(n), Some(3)), &names);
        }
        let text = events.text(&["lost"], WIDTH);
        assert!(text.contains("     0.5 s  readmitted           car-0, group 3: an orbit"), "{text}");
        assert!(!text.contains("lost                 car-0"), "{text}");
        assert!(text.ends_with("  and 12 more in summary.json\n  all: 20 lost, 20 readmitted\n"), "{text}");
    }

    /// The column `reason` is only for readers that do not interpret the other columns.
    #[test]
    fn the_reason_is_derived_from_the_columns() {
        let mut events = Events::default();
        let dwell = EventRow { dwell_s: Some(12.34), ..event("handoff-started", Some(0), Some(1)) };
        events.add(0, &dwell, &["lead".to_owned()]);
        let text = events.text(&[], WIDTH);
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
        let text = events.text(&[], WIDTH);
        for line in ["track 4, group 1: so", "track 5, group 1: so", "lead, to group 2: so"] {
            assert!(text.contains(line), "{line}: {text}");
        }
    }

    #[test]
    fn a_name_that_looks_like_a_number_is_quoted() {
        let mut events = Events::default();
        events.add(0, &event("lost", Some(0), Some(1)), &["0".to_owned()]);
        let text = events.text(&[], WIDTH);
        assert!(text.contains("target \"0\", group 1: so"), "{text}");
    }
}
