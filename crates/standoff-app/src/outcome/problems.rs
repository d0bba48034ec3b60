//! Problems of a run: alarms grouped by kind and cause.

use serde::Serialize;
use standoff_io::display_text::{count, printable, wrapped};
use standoff_record::target_name;
use standoff_score::Alarm;

use super::events::named;

/// Alarms of one kind and cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Problem {
    pub(super) kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    cause: Option<String>,
    /// Number of alarms.
    times: usize,
    /// Sum of their durations, s.
    total_s: f64,
    longest_s: f64,
    /// Begin of the longest one, s.
    begin_s: f64,
    /// Targets, groups or UAVs of the longest one.
    subject: String,
    /// Reason of the longest one.
    reason: String,
    /// Setting that limits what the UAVs can do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<&'static str>,
}

impl Problem {
    /// Describes the alarms of one kind and cause; `names` are those of the targets, by id.
    pub(crate) fn of(found: &standoff_score::Problem, names: &[String]) -> Self {
        let longest = &found.longest;
        Self {
            kind: longest.kind,
            cause: longest.cause.clone(),
            times: found.times,
            total_s: found.total_us as f64 / 1e6,
            longest_s: longest.duration_s(),
            begin_s: longest.begin_us as f64 / 1e6,
            subject: subject(longest, names),
            reason: longest.reason.clone(),
            limit: limit(longest.kind, longest.cause.as_deref()),
        }
    }
}

/// Names the target, UAV and group of an alarm.
fn subject(alarm: &Alarm, names: &[String]) -> String {
    let target = alarm.target.map(|target| named(&target_name(target, names)));
    let uav = alarm.uav.map(|uav| format!("UAV {uav}"));
    let group = alarm.group.map(|group| format!("group {group}"));
    target.into_iter().chain(uav).chain(group).collect::<Vec<_>>().join(", ")
}

/// Returns the setting that limits what the UAVs can do about a problem.
fn limit(kind: &str, cause: Option<&str>) -> Option<&'static str> {
    match (kind, cause?) {
        ("removed", "radius-exceeded") => Some("orbit.radius_max_m"),
        ("orbit-infeasible", "radius-exceeded") => Some("orbit.radius_max_m or sensor.sensing_range_m"),
        ("removed" | "orbit-infeasible", "too-fast") => Some("uavs.speed_change_max_m_s"),
        ("orbit-blocked" | "orbit-partly-blocked", _) => Some("geofence"),
        _ => None,
    }
}

impl Problem {
    /// Formats the problem: its extent, and the reason of its longest alarm.
    pub(super) fn text(&self, width: usize) -> String {
        let Self { kind, times, total_s, longest_s, begin_s, limit, .. } = self;
        let subject = printable(&self.subject);
        let colon = if subject.is_empty() { "" } else { ": " };
        let extent = match times {
            1 => format!("{longest_s:.1} s from {begin_s:.1} s on{colon}{subject}"),
            _ => {
                let longest = format!("longest {longest_s:.1} s from {begin_s:.1} s on");
                format!("{}, {total_s:.1} s in all, {longest}{colon}{subject}", count(*times, "time"))
            }
        };
        let limit = limit.map_or_else(String::new, |key| format!(" ({key})"));
        wrapped(&format!("  {kind:21} "), &extent, width)
            + &wrapped(&" ".repeat(24), &format!("{}{limit}", printable(&self.reason)), width)
    }
}

#[cfg(test)]
mod tests {
    use standoff_io::display_text::WIDTH;
    use standoff_score::problems;

    use super::*;

    fn alarm(kind: &'static str, target: u32, begin_s: i64, end_s: i64) -> Alarm {
        Alarm {
            kind,
            cause: Some("radius-exceeded".to_owned()),
            target: Some(target),
            group: Some(3),
            uav: None,
            begin_us: begin_s * 1_000_000,
            end_us: end_s * 1_000_000,
            reason: "so".to_owned(),
        }
    }

    #[test]
    fn alarms_are_grouped_and_the_longest_one_is_named() {
        let names = ["a", "0"].map(str::to_owned);
        let alarms = [alarm("lost", 0, 0, 5), alarm("removed", 0, 1, 3), alarm("removed", 1, 10, 20)];
        let problems = problems(&alarms);
        let text: String = problems.iter().map(|problem| Problem::of(problem, &names).text(WIDTH)).collect();
        let removed =
            "  removed               2 times, 12.0 s in all, longest 10.0 s from 10.0 s on: target \"0\", group 3\n";
        assert!(text.starts_with(removed), "{text}");
        assert!(
            text.contains("so (orbit.radius_max_m)\n  lost                  5.0 s from 0.0 s on: a, group 3"),
            "{text}"
        );
    }
}
