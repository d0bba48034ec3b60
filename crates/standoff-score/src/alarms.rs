//! Alarms: states of a run that degrade the tracking, each with the time from the event that begins it to its end.

use std::collections::BTreeMap;

use serde::Serialize;
use standoff_record::{EventQuota, EventRow, Frame};

/// Kinds of events that begin an alarm, and the kinds that end it.
const ALARMS: [(&str, &[&str]); 7] = [
    ("lost", &["reacquired"]),
    ("removed", &["readmitted", "admitted", "lost"]),
    ("orbit-infeasible", &["orbit-feasible", "group-retired"]),
    ("orbit-partly-blocked", &["orbit-blocked", "orbit-unblocked", "group-retired"]),
    ("orbit-blocked", &["orbit-partly-blocked", "orbit-unblocked", "group-retired"]),
    ("proximity-alert", &["proximity-cleared", "group-retired"]),
    ("uav-timeout", &["uav-joined"]),
];

/// A state that degrades the tracking.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alarm {
    /// Kind of the event that begins it.
    pub kind: &'static str,
    /// Cause of this event, in kebab-case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// Target or track concerned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<u32>,
    /// Group concerned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<u32>,
    /// UAV concerned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uav: Option<u32>,
    /// Begin, microseconds.
    pub begin_us: i64,
    /// End, microseconds: of the state, of its target or of the run.
    pub end_us: i64,
    /// Reason of the event that begins it.
    pub reason: String,
}

impl Alarm {
    /// Returns the duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        (self.end_us - self.begin_us) as f64 / 1e6
    }

    fn begun_by(time_us: i64, row: &EventRow) -> Option<Self> {
        let (kind, _) = ALARMS.iter().find(|(kind, _)| *kind == row.kind)?;
        let uav = row.uavs.first().copied().filter(|_| *kind == "uav-timeout");
        let EventRow { cause, group, .. } = row.clone();
        let (target, reason) = (row.target_or_track(), row.reason_text());
        Some(Self { kind, cause, target, group, uav, begin_us: time_us, end_us: time_us, reason })
    }
}

/// Alarms of one kind and cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Problem {
    /// Number of alarms.
    pub times: usize,
    /// Sum of their durations, microseconds.
    pub total_us: i64,
    /// The longest one; of several, the first.
    pub longest: Alarm,
}

/// Groups alarms by kind and cause: those that last longest in total come first.
#[must_use]
pub fn problems(alarms: &[Alarm]) -> Vec<Problem> {
    let mut problems: Vec<Problem> = Vec::new();
    for alarm in alarms {
        let lasting_us = alarm.end_us - alarm.begin_us;
        let is_same = |of: &&mut Problem| (of.longest.kind, &of.longest.cause) == (alarm.kind, &alarm.cause);
        let Some(known) = problems.iter_mut().find(is_same) else {
            problems.push(Problem { times: 1, total_us: lasting_us, longest: alarm.clone() });
            continue;
        };
        (known.times, known.total_us) = (known.times + 1, known.total_us + lasting_us);
        if lasting_us > known.longest.end_us - known.longest.begin_us {
            known.longest = alarm.clone();
        }
    }
    problems.sort_by_key(|problem| std::cmp::Reverse(problem.total_us));
    problems
}

/// Kind of an alarm, and the target, group or UAV that it concerns.
type Subject = (&'static str, Option<u32>, Option<u32>);

fn subject(kind: &'static str, row: &EventRow) -> Subject {
    match kind {
        "lost" | "removed" => (kind, row.target_or_track(), None),
        "uav-timeout" => (kind, None, row.uavs.first().copied()),
        _ => (kind, None, row.group),
    }
}

/// All alarms of a run.
#[derive(Debug, Clone, Default)]
pub struct Alarms {
    all: Vec<Alarm>,
    /// Indices of those that have not ended.
    open: BTreeMap<Subject, usize>,
    /// Limits the memory.
    quota: EventQuota,
}

impl Alarms {
    /// Adds the next time step.
    pub fn add(&mut self, frame: &Frame) {
        let exists = |target: u32| frame.truth.binary_search_by_key(&target, |row| row.target).is_ok();
        // The loss of a vehicle that has left the traffic, or of a false track, is no problem.
        let concerns = |target: Option<u32>| frame.truth.is_empty() || target.is_none_or(exists);
        for row in &frame.events {
            for (kind, _) in ALARMS.iter().filter(|(_, ends)| ends.contains(&row.kind.as_str())) {
                self.end(subject(kind, row), frame.time_us);
            }
            let Some(alarm) = Alarm::begun_by(frame.time_us, row).filter(|alarm| concerns(alarm.target)) else {
                continue;
            };
            let subject = subject(alarm.kind, row);
            if !self.open.contains_key(&subject) && self.quota.takes(row, None) {
                self.open.insert(subject, self.all.len());
                self.all.push(alarm);
            }
        }
        // An alarm of a target ends when the target leaves the traffic.
        self.open.retain(|(_, target, _), index| {
            self.all[*index].end_us = frame.time_us;
            concerns(*target)
        });
    }

    fn end(&mut self, subject: Subject, time_us: i64) {
        if let Some(index) = self.open.remove(&subject) {
            self.all[index].end_us = time_us;
        }
    }

    /// Returns all alarms, in the order in which they begin.
    #[must_use]
    pub fn all(&self) -> &[Alarm] {
        &self.all
    }
}

#[cfg(test)]
mod tests {
    use standoff_record::TruthRow;

    use super::*;

    fn event(kind: &str, target: Option<u32>, group: Option<u32>) -> EventRow {
        EventRow { kind: kind.into(), target, group, uavs: vec![0], reason: "so".into(), ..EventRow::default() }
    }

    /// Kind, begin and duration of each alarm of these time steps of 1 s; targets 1 and 2 exist until step `gone`.
    fn alarms(steps: &[&[EventRow]], gone: usize) -> Vec<(&'static str, i64, f64)> {
        let mut alarms = Alarms::default();
        for (step, events) in steps.iter().enumerate() {
            let existing = if step < gone { &[1, 2][..] } else { &[2] };
            let truth = existing.iter().map(|target| TruthRow { target: *target, ..TruthRow::default() }).collect();
            alarms.add(&Frame { time_us: step as i64 * 1_000_000, events: events.to_vec(), truth, ..Frame::default() });
        }
        alarms.all().iter().map(|alarm| (alarm.kind, alarm.begin_us / 1_000_000, alarm.duration_s())).collect()
    }

    #[test]
    fn an_alarm_lasts_until_the_event_that_ends_it() {
        let steps: [&[EventRow]; 5] = [
            &[event("removed", Some(1), Some(0)), event("lost", Some(2), None)],
            &[event("reacquired", Some(1), None)],
            // Admission to another group ends the removal.
            &[event("admitted", Some(1), Some(4)), event("orbit-infeasible", None, Some(3))],
            &[event("group-retired", None, Some(2))],
            &[],
        ];
        assert_eq!(alarms(&steps, 9), [("removed", 0, 2.0), ("lost", 0, 4.0), ("orbit-infeasible", 2, 2.0)]);
    }

    #[test]
    fn an_alarm_of_a_target_ends_when_the_target_leaves_the_traffic() {
        let steps: [&[EventRow]; 5] = [&[event("lost", Some(1), None)], &[], &[], &[], &[]];
        assert_eq!(alarms(&steps, 2), [("lost", 0, 2.0)]);
        assert_eq!(alarms(&steps, 9), [("lost", 0, 4.0)]);
        // Its track ends later.
        assert_eq!(alarms(&steps, 0), []);
    }

    /// A UAV that is reported as silent again, without having joined.
    #[test]
    fn a_repeated_event_begins_no_other_alarm() {
        let steps: [&[EventRow]; 3] = [&[event("uav-timeout", None, None)], &[], &[event("uav-timeout", None, None)]];
        assert_eq!(alarms(&steps, 9), [("uav-timeout", 0, 2.0)]);
    }
}
