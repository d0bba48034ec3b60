//! What happened in a run: how often, and the worst of it.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use standoff_sim::record::{EventAllowance, EventRow};
use standoff_sim::text;

/// Events that a table shows before it refers to the file.
const SHOWN: usize = 12;
/// Kinds of events that are counted one by one; there are some twenty.
const KINDS: usize = 50;
/// That a target is cued or first measured is routine, and that something is over tells little.
const ROUTINE: [&str; 5] = ["cued", "acquired", "orbit-feasible", "orbit-clear", "uavs-apart"];
/// What is bad for who watches, and what ends it.
const BAD: [(&str, &[&str]); 7] = [
    ("lost", &["reacquired"]),
    ("discarded", &["taken-back", "joined", "lost"]),
    ("orbit-infeasible", &["orbit-feasible", "group-dissolved"]),
    ("orbit-cut", &["orbit-barred", "orbit-clear", "group-dissolved"]),
    ("orbit-barred", &["orbit-cut", "orbit-clear", "group-dissolved"]),
    ("uavs-close", &["uavs-apart", "group-dissolved"]),
    ("uav-lost", &["uav-joined"]),
];

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
            let EventRow { kind, group, to_group, uavs, .. } = row.clone();
            let (target, reason) = (name.cloned(), row.why());
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

    /// How many events of each kind, and the worst of them, in the order in which they came. A bad one is the worse the
    /// longer it lasts: until what ends it, or until its target, whose end `ends_s` tells by its name, or the run ends.
    pub(super) fn told(&self, end_s: f64, ends_s: &BTreeMap<&str, f64>) -> String {
        let counts: Vec<String> = self.counts.iter().map(|(kind, n)| format!("{n} {}", text::words(kind))).collect();
        let mut told = String::from("\nevents\n");
        told += &wrapped("  ", &if counts.is_empty() { "none".to_owned() } else { counts.join(", ") });
        let lasting_s = self.lasting_s(end_s, ends_s);
        let mut telling: Vec<usize> =
            (0..self.events.len()).filter(|&place| !ROUTINE.contains(&self.events[place].kind.as_str())).collect();
        let left = telling.len().saturating_sub(SHOWN);
        // Those that are not bad come after all that are.
        let badness_s = |place: &usize| lasting_s[*place].unwrap_or(f64::NEG_INFINITY);
        telling.sort_by(|a, b| badness_s(b).total_cmp(&badness_s(a)).then(a.cmp(b)));
        telling.truncate(SHOWN);
        telling.sort_unstable();
        if left > 0 {
            told += &format!("the worst {SHOWN}, by how long they last:\n");
        }
        for place in telling {
            let event = &self.events[place];
            let [kind, who, reason] = [&event.kind, &event.who(), &event.reason].map(|part| text::words(part));
            let lasting = lasting_s[place].map_or_else(String::new, |s| format!(" (lasts {s:.1} s)"));
            told += &format!("{:8.1} s  {kind:17}  {who}: {reason}{lasting}\n", event.time_s);
        }
        if left > 0 {
            told += &format!("  and {left} more in summary.json\n");
        }
        if self.left_out() > 0 {
            told += &format!("  and {} later events of any kind in events.parquet\n", self.left_out());
        }
        told
    }

    /// How long each bad event lasts, s; `None` of those that are not bad.
    fn lasting_s(&self, end_s: f64, ends_s: &BTreeMap<&str, f64>) -> Vec<Option<f64>> {
        let mut over_s = BTreeMap::new();
        let lasting_s = self.events.iter().rev().map(|event| {
            let whom = (event.target.as_deref(), event.group, event.uavs.first());
            for (kind, _) in BAD.iter().filter(|(_, ends)| ends.contains(&event.kind.as_str())) {
                over_s.insert((*kind, subject(kind, whom)), event.time_s);
            }
            let (kind, _) = BAD.iter().find(|(kind, _)| *kind == event.kind)?;
            let gone_s = event.target.as_deref().and_then(|target| ends_s.get(target)).copied().unwrap_or(end_s);
            let until_s = over_s.get(&(*kind, subject(kind, whom))).copied().unwrap_or(end_s).min(gone_s);
            Some((until_s - event.time_s).max(0.0))
        });
        let mut lasting_s: Vec<_> = lasting_s.collect();
        lasting_s.reverse();
        lasting_s
    }
}

/// Whose event it is, of its target, its group and its UAV.
fn subject<'a>(
    kind: &str,
    (target, group, uav): (Option<&'a str>, Option<u32>, Option<&u32>),
) -> (Option<&'a str>, Option<u32>) {
    match kind {
        "lost" | "discarded" => (target, None),
        "uav-lost" => (None, uav.copied()),
        _ => (None, group),
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
        let target = self.target.as_deref().map(named);
        let of_uav =
            ["reassigned", "search-started", "search-ended", "uav-lost", "uav-joined"].contains(&self.kind.as_str());
        let uav = self.uavs.first().filter(|_| of_uav).map(|uav| format!("UAV {uav}"));
        let who = [target.unwrap_or_default(), uav.unwrap_or_default(), groups];
        who.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// A target by its name; one that could be taken for a number, or for nothing, is said to be a name.
pub(super) fn named(name: &str) -> String {
    if name.starts_with(char::is_alphabetic) { name.to_owned() } else { format!("target \"{name}\"") }
}

/// In lines of at most 99 characters, the first behind a sign of two characters, the others indented as far.
pub fn wrapped(sign: &str, words: &str) -> String {
    let (mut text, mut line) = (String::new(), sign.to_owned());
    for word in words.split(' ') {
        if line.chars().count() + word.chars().count() > 99 {
            text += &format!("{}\n", line.trim_end());
            line = "  ".to_owned();
        }
        line += word;
        line.push(' ');
    }
    text + line.trim_end() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(kind: &str, target: Option<u32>, group: Option<u32>) -> EventRow {
        EventRow { kind: kind.into(), target, group, uavs: vec![0], reason: "so".into(), ..EventRow::default() }
    }

    /// Twenty short losses, then one that lasts: the one that lasts is told.
    #[test]
    fn the_worst_events_are_told_not_the_first() {
        let names: Vec<String> = (0..30).map(|number| format!("car-{number}")).collect();
        let mut events = Events::default();
        for n in 0..20 {
            events.add(i64::from(n) * 1_000_000, &event("lost", Some(n), None), &names);
            events.add(i64::from(n) * 1_000_000 + 500_000, &event("reacquired", Some(n), None), &names);
        }
        events.add(30_000_000, &event("orbit-infeasible", None, Some(3)), &names);
        events.add(70_000_000, &event("orbit-feasible", None, Some(3)), &names);
        events.add(80_000_000, &event("lost", Some(25), None), &names);
        let told = events.told(100.0, &BTreeMap::new());
        assert!(told.contains("30.0 s  orbit-infeasible   group 3: so (lasts 40.0 s)"), "{told}");
        assert!(told.contains("80.0 s  lost               car-25: so (lasts 20.0 s)"), "{told}");
        assert!(told.contains("and 30 more in summary.json"), "{told}");
        // Who joins another group is discarded no more.
        events.add(85_000_000, &event("discarded", Some(26), Some(3)), &names);
        events.add(86_000_000, &event("joined", Some(26), Some(4)), &names);
        let told = events.told(100.0, &BTreeMap::new());
        assert!(told.contains("car-26, group 3: so (lasts 1.0 s)"), "{told}");
        // Who has left is not missed.
        let told = events.told(100.0, &BTreeMap::from([("car-25", 81.0)]));
        assert!(told.contains("car-25: so (lasts 1.0 s)"), "{told}");
    }

    /// What a table of events says is said from its columns; the words beside them are for who reads no columns.
    #[test]
    fn why_is_told_from_the_columns() {
        let mut events = Events::default();
        let dwell = EventRow { dwell_s: Some(12.34), ..event("handoff-requested", Some(0), Some(1)) };
        events.add(0, &dwell, &["lead".to_owned()]);
        let told = events.told(1.0, &BTreeMap::new());
        assert!(told.contains("lead, group 1: nearer to the new group; in both for 12.3 s, in which"), "{told}");
    }

    #[test]
    fn a_name_is_not_read_as_a_number() {
        let mut events = Events::default();
        events.add(0, &event("lost", Some(0), Some(1)), &["0".to_owned()]);
        let told = events.told(1.0, &BTreeMap::new());
        assert!(told.contains("target \"0\", group 1: so"), "{told}");
    }
}
